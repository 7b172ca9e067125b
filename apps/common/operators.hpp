#pragma once

#include <functional>
#include <gradpsi/assemble.hpp>
#include <gradpsi/error.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/points.hpp"
#include "common/report.hpp"

// The operator on the points of a file.

namespace gradpsi::apps {

/// The options that say which operator is assembled on which points, the same in every command.
struct OperatorOptions : PointOptions {
  std::string scheme;
  std::optional<double> tolerance;
  std::string wavelength;  // a number, or a column
  std::optional<double> support, support_ratio;
  std::optional<int> neighbours;
  std::optional<std::string> on_degenerate;
  bool on_surface = false;
  bool symmetric_support = false;
  std::filesystem::path report;

  void declare(Options& options);
  /// Throws unless there is a scheme, or what rows are chosen by: then `scheme` becomes the most accurate that they
  /// are chosen from.
  /// @param derivative  of the rows, where they are chosen: "gradient", "laplacian" or "hessian"
  void settle(const std::string& derivative);
};

/// The option --what of commands that assemble a derivative as it is.
Option declare_derivative(Options& options, std::optional<std::string>& derivative);
/// Settles the options for it.
/// @throws BadUsage  if rows are to be chosen, and it is not said of what; if a scheme is of another derivative
void settle(OperatorOptions& options, const std::optional<std::string>& derivative);

/// Whether the options or a column say what the supports are.
bool has_support(const OperatorOptions& options, const Table& table);

/// How the points lie, as far as supports need it: asked only if they do.
struct Lie {
  std::function<DenseVector()> spacing;              ///< one for all, or one a point
  std::function<DenseVector(int)> kth_nearest = {};  ///< distances
};

/// One support for all or one for each row of the table.
Eigen::VectorXd supports(const OperatorOptions& options, const Table& table, const Lie& lie);

/// Kernel, policy for degenerate rows and threads. Without a policy such rows are an error, unless the
/// support is the scheme's own: then they are widened.
AssemblyOptions assembly_options(const OperatorOptions& options, const Table& table);

/// The points of a file and the operator on them.
struct Problem : Points {
  Neighbours near = {};
  Operator op = {};
  std::vector<int> unused =
      {};  ///< points whose rows may be anything, where rows are chosen; ascending
};

/// Reads the points, and begins the report; neighbours and operator are still empty.
Problem read_problem(const PointOptions& options, Report& report);

/// Prints warnings on standard error and keeps them for the report.
void warn(const Notes& warnings, Report& report);

/// One support for all points, or one for each.
Eigen::VectorXd supports(const OperatorOptions& options, const Problem& problem);

/// Finds the neighbours, and warns on standard error of what about the points deserves it.
void find_neighbours(const OperatorOptions& options, Problem& problem, Report& report);

/// Reports an operator of all points, or of some, or of probes.
void describe(const Operator& op, const Problem& problem, Report& report);

/// Chooses the operator's rows to a tolerance, and keeps the neighbours within their supports.
/// @param unused  points whose rows may be anything, ascending
/// @param stable  whether no solution of du/dt = lap u is to grow
Operator choose_rows(const OperatorOptions& options, Problem& problem,
                     const std::vector<int>& unused, bool stable, Report& report);

/// Finds the neighbours and assembles the operator.
/// @param rows  points whose rows are wanted; unset: all
/// @throws StencilError  for a row that cannot be computed, with what can be done about it
void assemble(const OperatorOptions& options, Problem& problem, Report& report,
              const std::optional<std::vector<int>>& rows = {});

/// components() in terms of the points' own coordinates: of points in a plane of constant y, "xz", "x" and
/// "y" are "x" and "z".
std::vector<std::string> in_axes(std::vector<std::string> components, const std::string& axes);

/// What the matrices of a scheme are called.
std::vector<std::string> component_names(const Scheme& scheme, const std::string& axes);

/// What went wrong with a row.
std::string words(const StencilError& error, const Report& report);

/// The rows that are zero because they could not be computed, unless that was asked for.
std::vector<int> rows_without_answer(const OperatorOptions& options, const Operator& op);

/// The rows that were lowered, widened or left zero, by the points' numbers.
DegenerateRows degenerate_rows(const Operator& op, const Cloud& cloud);

}  // namespace gradpsi::apps
