#pragma once

#include <gradpsi/scheme.hpp>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "common/progress.hpp"
#include "studies/lattices.hpp"

// Errors of the schemes of the paper on u = 1 + cos(pi x) (in d dimensions 1 + the product of the cosines)
// in [-1, 1]^d, on points of ever smaller spacing, supports truncated at the boundary.

namespace gradpsi::apps::converge {

inline constexpr std::uint64_t seed = 1;

struct Study {
  int dimension;
  int points_max;  ///< the most points of a cloud
  int threads;
};

/// Points per side of the successive clouds; [-1, 1] has length 2.
std::vector<int> sides(int dimension, int points_max);

/// The errors of one scheme on one cloud.
struct Result {
  Scheme scheme;
  Arrangement arrangement;
  double support_ratio;
  int points;
  double spacing;
  int degenerate_rows;
  double l2 = 0, max = 0;  ///< over all points
  /// Over [-1/2, 1/2]^d; NaN if supports there are truncated.
  double interior_l2 = 0, interior_max = 0;
  /// Between this spacing and the one before on the curve; NaN for its first.
  double order = std::numeric_limits<double>::quiet_NaN(), interior_order = order;
};
using Error = double Result::*;

/// All results, curve by curve, each from the largest spacing to the smallest.
std::vector<Result> results(const Study& study, const ShowProgress& show);

/// convergence.csv
std::string csv(const std::vector<Result>& results, int dimension);

/// Results of one scheme, arrangement and support ratio.
using Curve = std::span<const Result>;
std::vector<Curve> curves(const std::vector<Result>& results);

/// A curve's part between the coarsest clouds and the rounding of u: the finer half of its spacings
/// down to 1e-3, at least three.
Curve fitted_part(Curve curve);

/// The order of an error on the fitted part.
double fitted_order(Curve curve, Error error);

}  // namespace gradpsi::apps::converge
