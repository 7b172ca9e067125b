#pragma once

#include <gradpsi/scheme.hpp>
#include <string>
#include <vector>

// The second-order Laplacians of the paper's tables where they break, and least squares with the same
// weights: on irregular squares and cubes, truncated at the boundary.

namespace gradpsi::apps::failing {

/// One matrix.
struct Result {
  Scheme scheme;
  int dimension, points_per_side;
  double support_ratio;
  int seed;
  int points = 0;
  double error_max = 0, worst_condition = 0, worst_amplification = 0;
  double bound_over_error = 0;  ///< at the point of the largest error
  int rows_above_bound = 0;
};

/// @param seeds  clouds of each kind
std::vector<Result> results(int seeds);

/// failure.csv
std::string csv(const std::vector<Result>& results);

/// Medians and spreads over the seeds; for people.
std::string table(const std::vector<Result>& results);

}  // namespace gradpsi::apps::failing
