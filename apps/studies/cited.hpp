#pragma once

#include <gradpsi/scheme.hpp>
#include <limits>
#include <string>
#include <vector>

#include "common/progress.hpp"

// Errors of all schemes, those that the paper cites beside its own, away from the boundary and at it: on
// u = 1 + the product of cos(pi x) over the axes of (0, 1)^d, irregular points of two spacings.

namespace gradpsi::apps::cited {

inline constexpr std::uint64_t seed = 1;

/// A scheme on the finer points with one support, and how its errors fell from the points of twice the spacing.
/// An error is the Euclidean norm of what is wrong: a gradient's components, all d^2 entries of a Hessian.
struct Result {
  Scheme scheme;
  double support_ratio;
  int points;
  double spacing;
  int degenerate_rows;  ///< lowered to what could be solved
  /// Root mean squares over the points deeper than rows reach, and over the others; NaN if there are none.
  double interior = std::numeric_limits<double>::quiet_NaN(), boundary = interior;
  double worst = interior;  ///< of all points
  double coarse_interior = interior, coarse_boundary = interior;
  double interior_order = interior, boundary_order = interior;
  int place =
      0;  ///< of its interior error, 1 for the smallest, among its derivative's with this support
};

/// Every scheme with every support that is enough for it; a scheme's supports follow one another.
/// @param points_per_side  of the finer points; those of the coarser are half as many
std::vector<Result> results(int dimension, int points_per_side, int threads,
                            const ShowProgress& show);

/// cited.csv
std::string csv(const std::vector<Result>& results);

/// Tables of interior and boundary errors with orders, and the worst, a table for each derivative.
std::string summary(const std::vector<Result>& results);

}  // namespace gradpsi::apps::cited
