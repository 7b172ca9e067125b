#pragma once

#include <limits>
#include <stdexcept>
#include <string>

#pragma GCC visibility push(default)
namespace gradpsi {

/// The caller's or the file's mistake: the message says what was expected and what came.
struct InvalidInput : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

/// A point whose row cannot be computed: its moment system is singular, or it has no neighbour.
struct StencilError : std::runtime_error {
  /// A message and what is known of the point.
  StencilError(const std::string& message, int point, int neighbours, double reciprocal_condition)
      : std::runtime_error(message),
        point(point),
        neighbours(neighbours),
        reciprocal_condition(reciprocal_condition) {}

  int point;                    ///< 0-based
  int neighbours;               ///< without the point itself
  double reciprocal_condition;  ///< of the moment system, see RowReport
};

/// A linear system that could not be solved: singular, not positive definite, too large for the memory
/// given, or no convergence.
struct SolverError : std::runtime_error {
  /// A message, and how near to a solution the solver came.
  explicit SolverError(const std::string& message,
                       double residual = std::numeric_limits<double>::quiet_NaN())
      : std::runtime_error(message), residual(residual) {}

  double residual;  ///< relative, the last one reached; NaN if there was no solution
};

}  // namespace gradpsi
#pragma GCC visibility pop
