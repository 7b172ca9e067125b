#pragma once

#include <string>
#include <vector>

// Orders of laplacian-ls-P on ever finer irregular squares.

namespace gradpsi::apps::orders {

/// A degree with a support that suits it.
struct Degree {
  int degree;
  double support_ratio;
};

/// One matrix.
struct Result {
  Degree of;
  int points_per_side;
  int points = 0;
  double neighbours = 0;                 ///< on average
  double error_l2 = 0, interior_l2 = 0;  ///< over all points, and those a support from the boundary
  double worst_condition = 0;
};

/// Degree by degree, each from the coarsest square to the finest.
std::vector<Result> results(bool quick);

/// orders.csv
std::string csv(const std::vector<Result>& results);

/// Errors and observed orders of each degree; for people.
std::string table(const std::vector<Result>& results);

}  // namespace gradpsi::apps::orders
