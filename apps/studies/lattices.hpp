#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <gradpsi/cloud.hpp>
#include <string_view>
#include <vector>

// The points and supports that studies look at.

namespace gradpsi::apps {

/// Supports of the studies of convergence, in spacings.
inline constexpr std::array support_ratios = {2.5, 3.5, 4.5};

enum class Arrangement { Regular, Irregular };

inline std::string_view name(Arrangement arrangement) {
  return arrangement == Arrangement::Regular ? "regular" : "irregular";
}

/// How far points are moved off the lattice, in spacings.
inline constexpr double irregular_jitter = 0.2;
inline double jitter(Arrangement arrangement) {
  return arrangement == Arrangement::Regular ? 0 : irregular_jitter;
}

/// Irregular points in the unit line, square or cube.
inline Cloud irregular_points(int dimension, int points_per_side, std::uint64_t seed) {
  return make_cloud(Lattice{.dimension = dimension,
                            .points_per_side = points_per_side,
                            .jitter = irregular_jitter,
                            .seed = seed});
}

/// Points of a lattice that are not in its outermost layer, ascending.
inline std::vector<int> inner_points(int dimension, int points_per_side) {
  std::vector<int> inner;
  const int n = static_cast<int>(std::lround(std::pow(points_per_side, dimension)));
  for (int i = 0; i < n; ++i) {
    bool outermost = false;
    for (int a = 0, rest = i; a < dimension; ++a, rest /= points_per_side) {
      const int place = rest % points_per_side;
      outermost |= place == 0 || place == points_per_side - 1;
    }
    if (!outermost) inner.push_back(i);
  }
  return inner;
}

/// The points of 0 .. n - 1 that `some` has not, which ascend; ascending.
inline std::vector<int> others(int n, const std::vector<int>& some) {
  std::vector<int> rest;
  for (int i = 0, k = 0; i < n; ++i)
    if (k < std::ssize(some) && some[k] == i)
      ++k;
    else
      rest.push_back(i);
  return rest;
}

}  // namespace gradpsi::apps
