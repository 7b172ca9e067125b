#include "cloud/points.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "base/text.hpp"

namespace gradpsi {

std::string coordinates(const Positions& x, Eigen::Index i) {
  std::string text = "(";
  for (Eigen::Index a = 0; a < x.cols(); ++a) text += (a > 0 ? ", " : "") + shortest(x(i, a));
  return text + ")";
}

Positions wrapped_positions(const Cloud& cloud) {
  Positions x = cloud.positions();
  for (int a = 0; a < cloud.dimension() && cloud.size() > 0; ++a) {
    const double length = cloud.box()[a];
    if (length == 0) continue;
    const double largest = std::max(length, x.col(a).cwiseAbs().maxCoeff());
    const double last_digit = std::ldexp(1.0, std::ilogb(largest) - 52);
    for (int i = 0; i < cloud.size(); ++i) {
      double y = x(i, a) - length * std::floor(x(i, a) / length);
      y = last_digit * std::nearbyint(y / last_digit);
      x(i, a) = y < length ? y : 0;
    }
  }
  return x;
}

Coincidences coincidences(const Cloud& cloud) {
  const Positions x = wrapped_positions(cloud);
  const auto compare = [&](int i, int j) {
    for (Eigen::Index a = 0; a < x.cols(); ++a)
      if (x(i, a) != x(j, a)) return x(i, a) < x(j, a) ? -1 : 1;
    return 0;
  };
  std::vector<int> order(cloud.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int i, int j) {
    const int c = compare(i, j);
    return c != 0 ? c < 0 : i < j;
  });
  Coincidences result;
  int first = 0;
  int group = 0;  // where in `order` the current group of coincident points begins
  for (int k = 1; k < cloud.size(); ++k) {
    if (compare(order[group], order[k]) != 0) {
      group = k;
      continue;
    }
    if (result.points.empty() || order[k] < first) {
      first = order[k];
      result.first_partner = order[group];
    }
    result.points.push_back(order[k]);
  }
  std::ranges::sort(result.points);
  return result;
}

std::vector<int> distinct_points(const Cloud& cloud) {
  const std::vector<int> dropped = coincidences(cloud).points;
  std::vector<int> all(cloud.size()), kept;
  std::iota(all.begin(), all.end(), 0);
  std::ranges::set_difference(all, dropped, std::back_inserter(kept));
  return kept;
}

std::string words(const Coincidences& found, const Cloud& cloud, std::int64_t count,
                  std::int64_t all) {
  const int first = found.points.front();
  return "points " + std::to_string(cloud.number(found.first_partner)) + " and " +
         std::to_string(cloud.number(first)) + " coincide at " +
         coordinates(cloud.positions(), first) + "; " + std::to_string(count) + " of " +
         std::to_string(all) + " points coincide with an earlier one";
}

}  // namespace gradpsi
