#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <gradpsi/gradpsi.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/cli.hpp"

namespace gradpsi::apps {

/// The options that say which operator is assembled on which points, the same in every subcommand.
struct OperatorOptions {
  std::filesystem::path points;
  std::string scheme;
  std::optional<double> support, support_ratio, volume;
  std::string kernel = std::string(gradpsi::kernels().front().name);
  std::array<double, 3> periodic = {0, 0, 0};
  std::optional<std::string> on_degenerate;
  std::string duplicates = "error";
  int threads = 0;
  std::filesystem::path report;

  void declare(Options& options);
  /// Only those that say what the points are; then scheme and support are the program's choice.
  void declare_points(Options& options);
};

/// The smallest reciprocal condition number and its point, if there are rows.
using WorstRow = std::optional<std::pair<double, std::int64_t>>;

/// The points of a file, coincident ones dropped if so wished, and the operator on them.
struct Problem {
  gradpsi::Table table;
  gradpsi::Cloud cloud;
  gradpsi::Neighbours near;
  gradpsi::Operator op;
  nlohmann::ordered_json report;  ///< what --report writes
  WorstRow worst = {};
};

/// Volumes and box of a table's points.
gradpsi::CloudOptions cloud_options(const OperatorOptions& options, const gradpsi::Table& table);

/// One support for all or one for each row of the table; the spacing is asked for if it is needed.
Eigen::VectorXd supports(const OperatorOptions& options, const gradpsi::Table& table,
                         const std::function<double()>& spacing);

/// Kernel, policy for degenerate rows and threads. Without a policy such rows are an error, unless the
/// support is the scheme's own: then they are widened.
gradpsi::AssemblyOptions assembly_options(const OperatorOptions& options,
                                          const gradpsi::Table& table);

/// Reads the points; neighbours and operator are still empty.
Problem read_points(const OperatorOptions& options);

/// The report before anything has been assembled.
nlohmann::ordered_json first_report(const OperatorOptions& options, std::int64_t points,
                                    std::int64_t dropped, double read_seconds);

/// Assembles rows of a scheme with given options.
using Assemble =
    std::function<gradpsi::Operator(const gradpsi::Scheme&, const gradpsi::AssemblyOptions&)>;

/// Assembles, and fails for degenerate rows unless they are of points that are not used.
/// @param points  in the cloud
gradpsi::Operator assembled(const OperatorOptions& options, gradpsi::AssemblyOptions assembly,
                            const std::vector<int>& unused, int points, const Assemble& assemble);

/// What a user can do about a row that cannot be computed.
std::string advice(const gradpsi::StencilError& error, const nlohmann::ordered_json& report);

/// How many rows were lowered, widened or left zero, and which: points by their numbers.
nlohmann::ordered_json degenerate_rows(const gradpsi::Operator& op, const gradpsi::Cloud& cloud);

/// Finds the neighbours, warns on standard error of what about the points deserves it, and assembles the
/// operator. Rows of `unused` points are left zero where the
/// policy is to fail.
void assemble(const OperatorOptions& options, Problem& problem,
              const std::vector<int>& unused = {});

/// A number as the terminal shows it, six digits.
std::string text(double x);

/// A column of the points, all its values finite. Errors name points by their numbers in the cloud.
Eigen::VectorXd finite_column(const gradpsi::Table& table, const gradpsi::Cloud& cloud,
                              const std::string& name);

/// OUT of -o: a file that ends in .csv or .vtu, written by write_table().
Option declare_table_output(Options& options, std::filesystem::path& output,
                            const std::string& description);
void write_table(const std::filesystem::path& file, const gradpsi::Table& table);

/// Throws unless the files can be written, as far as can be told beforehand, and are neither the points
/// nor the report nor one another. To be called before long work.
void check_outputs(const OperatorOptions& options, std::vector<std::filesystem::path> files);

/// Adds the peak memory to the report and writes it where --report says.
void write_report(const OperatorOptions& options, Problem& problem);

/// Prints what was assembled and written, unless that went to standard output itself.
/// @param support_column  whether the points have one
/// @return  whether more may be printed
bool print_summary(const OperatorOptions& options, const nlohmann::ordered_json& report,
                   const WorstRow& worst, bool support_column,
                   const std::vector<std::filesystem::path>& files);

/// Calls write(), adds its time and the peak memory to the report, writes it where --report says, and
/// prints what was written unless that went to standard output itself.
/// @return  whether more may be printed
bool write_and_report(const OperatorOptions& options, Problem& problem,
                      const std::vector<std::filesystem::path>& files,
                      const std::function<void()>& write);

}  // namespace gradpsi::apps
