#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/operators.hpp"

// Results, the report, and what is said of them.

namespace gradpsi::apps {

/// OUT of -o: a file in one of the formats of write_table().
Option declare_table_output(Options& options, std::filesystem::path& output,
                            const std::string& description);

/// Throws unless the files can be written, as far as can be told beforehand, and are neither points, probes
/// nor the report nor one another. To be called before long work.
void check_outputs(const OperatorOptions& options, std::vector<std::filesystem::path> files,
                   const std::filesystem::path& probes = {});

/// The most memory that this process has had, in bytes.
std::int64_t peak_memory();

/// Adds the peak memory to the report and writes it where --report says.
void write_report(const OperatorOptions& options, Report& report);

/// How many rows are by which scheme, "ls-2 20, positive 7".
std::string words(const std::map<std::string, std::int64_t>& schemes);

/// Prints what was assembled and written, unless that went to standard output itself.
/// @param support_column  whether the points have one
/// @return  whether more may be printed
bool print_summary(const OperatorOptions& options, const Report& report, bool support_column,
                   const std::vector<std::filesystem::path>& files);

/// Calls write(), reports its time, writes the report, and prints the summary.
void write_and_report(const OperatorOptions& options, Report& report, bool support_column,
                      const std::vector<std::filesystem::path>& files,
                      const std::function<void()>& write);

}  // namespace gradpsi::apps
