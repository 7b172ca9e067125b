#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <gradpsi/gradpsi.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

/// The options that say which operator is assembled on which points, the same in every subcommand.
struct OperatorOptions {
  std::filesystem::path points;
  std::string scheme;
  std::optional<double> support, support_ratio, volume;
  std::string kernel = std::string(gradpsi::kernels().front().name);
  std::vector<double> periodic;
  std::string on_degenerate = "fail";
  std::string duplicates = "error";
  int threads = 0;
  std::filesystem::path report;

  void add_to(CLI::App& command);
};

/// The points of a file, coincident ones dropped if so wished, and the operator on them.
struct Problem {
  gradpsi::Table table;
  gradpsi::Cloud cloud;
  gradpsi::Operator op;
  nlohmann::ordered_json report;  ///< what --report writes
};

/// Reads the points; the operator is still empty.
Problem read_points(const OperatorOptions& options);

/// Finds the neighbours and assembles the operator.
void assemble(const OperatorOptions& options, Problem& problem);

/// Calls write(), adds its time and the peak memory to the report, writes it where --report says,
/// and prints a line about the result.
void write_and_report(const OperatorOptions& options, Problem& problem,
                      const std::filesystem::path& output, const std::function<void()>& write);
