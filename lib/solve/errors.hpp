#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/solver.hpp"
#include "solve/choice.hpp"

// What solvers say, on one machine and on several processes.
namespace gradpsi {

/// Throws unless the numbers of the options are in their ranges.
inline void check_options(const SolverOptions& options) {
  if (!(options.tolerance > 0 && options.tolerance < 1))
    throw InvalidInput("tolerance must be between 0 and 1, not " + shortest(options.tolerance));
  if (options.mean && !std::isfinite(*options.mean))
    throw InvalidInput("mean must be finite, not " + shortest(*options.mean));
  if (options.solves < 0)
    throw InvalidInput("solves must be >= 0, not " + std::to_string(options.solves));
  if (options.max_iterations < 1)
    throw InvalidInput("max_iterations must be at least 1, not " +
                       std::to_string(options.max_iterations));
  if (!(options.memory >= 0))
    throw InvalidInput("memory must be >= 0 bytes, not " + shortest(options.memory));
}

inline InvalidInput not_symmetric() {
  return InvalidInput(
      "cholesky needs a matrix that is symmetric after scaling its rows by volume; this one is "
      "not: use lu or krylov");
}

inline InvalidInput no_volumes() {
  return InvalidInput("multigrid needs the points of the unknowns, with their volumes");
}

/// Cholesky met a pivot that is not positive.
struct Indefinite : SolverError {
  Indefinite() : SolverError("the matrix is symmetric but not positive definite: use lu") {}
};

/// Constants on a connected set of `count` rows are in the null space; `row` is one of them.
inline SolverError floating(std::int64_t count, const std::string& row) {
  return SolverError("the matrix is singular: the " + std::to_string(count) +
                     " rows connected with that of " + row +
                     " sum to zero (to rounding), so any constant may be added to their solution; "
                     "a fixed value, an exchange with the outside or a shorter time step makes it "
                     "unique");
}

/// The residual stayed above the tolerance.
inline SolverError unsolved(const SolverReport& solver, const SolveReport& result) {
  const std::string cause = solver.caution.empty() ? "" : "; " + solver.caution;
  if (!std::isfinite(result.residual))
    return SolverError("the solution by " + solver.description + " is not finite" + cause);
  return SolverError(solver.description + " did not converge: relative residual " +
                         rounded(result.residual) + " after " + std::to_string(result.iterations) +
                         (iterates(solver.method) ? " iterations; try lu"
                                                  : " refinements; the matrix is nearly singular") +
                         cause,
                     result.residual);
}

}  // namespace gradpsi
