#pragma once

#include <string>
#include <vector>

// Where rounding ends the convergence of a second derivative: laplacian-mixed-soc in 1D at ever smaller
// spacing, its moments in units of h, as the library has them, and in lengths, as Table II does.

namespace gradpsi::apps::floor {

/// Largest error and condition number on one cloud.
struct Result {
  double spacing;
  double error_scaled = 0, error_raw = 0;
  double condition_scaled = 0, condition_raw = 0;
  double floor = 0;  ///< eps |u| / dx^2
};
std::vector<Result> results();

/// floor.csv
std::string csv(const std::vector<Result>& results);

/// The same for people.
std::string table(const std::vector<Result>& results);

}  // namespace gradpsi::apps::floor
