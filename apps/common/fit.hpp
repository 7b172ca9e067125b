#pragma once

#include <cmath>
#include <limits>
#include <span>

// Powers of errors: err = c size^order is a line of slope `order` in logarithms.

namespace gradpsi::apps {

/// The order between two sizes.
inline double order_between(double coarse, double coarse_error, double fine, double fine_error) {
  return std::log(coarse_error / fine_error) / std::log(coarse / fine);
}

/// The slope of log(y) against log(x) by least squares, over pairs whose logarithms are finite. NaN with
/// fewer than two.
/// @param x, y  of equal length
inline double log_slope(std::span<const double> x, std::span<const double> y) {
  double n = 0, sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double lx = std::log(x[k]), ly = std::log(y[k]);
    if (!std::isfinite(lx) || !std::isfinite(ly)) continue;
    n += 1, sum_x += lx, sum_y += ly, sum_xx += lx * lx, sum_xy += lx * ly;
  }
  if (n < 2) return std::numeric_limits<double>::quiet_NaN();
  return (n * sum_xy - sum_x * sum_y) / (n * sum_xx - sum_x * sum_x);
}

}  // namespace gradpsi::apps
