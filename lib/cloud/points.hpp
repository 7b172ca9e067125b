#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "gradpsi/cloud.hpp"

namespace gradpsi {

template <int D>
using Vector = Eigen::Matrix<double, D, 1>;

/// The positions, in periodic directions their images in [0, length). Those are rounded to the last
/// digit of the largest coordinate, so that points given as 0.1 and 1.1 in a box of 1 coincide.
Positions wrapped_positions(const Cloud& cloud);

/// "(x, y)" of point i, for messages.
std::string coordinates(const Positions& x, Eigen::Index i);

/// Points that have the position of another one of a lower number.
struct Coincidences {
  std::vector<int> points;  // ascending
  int first_partner = 0;    // the first point's
};
[[gnu::visibility("default")]] Coincidences coincidences(
    const Cloud& cloud);  // gradpsi::petsc calls it, too
/// The first one's words for messages, with how many points of how many coincide with an earlier one.
[[gnu::visibility("default")]] std::string words(const Coincidences& found, const Cloud& cloud,
                                                 std::int64_t count, std::int64_t all);

/// The way along an axis, in a periodic one (box > 0) to the nearest image.
inline double to_nearest_image(double r, double box) {
  return box > 0 && std::abs(r) > box / 2 ? r - box * std::nearbyint(r / box) : r;
}

/// The way from one place to another, in periodic directions to the nearest image.
template <int D>
Vector<D> displacement(const double* from, const double* to, const std::array<double, 3>& box) {
  Vector<D> r;
  for (int a = 0; a < D; ++a) r[a] = to_nearest_image(to[a] - from[a], box[a]);
  return r;
}

/// Its length squared; nothing passes through memory.
template <int D>
double squared_distance(const double* from, const double* to, const std::array<double, 3>& box) {
  double sum = 0;
  for (int a = 0; a < D; ++a) {
    const double r = to_nearest_image(to[a] - from[a], box[a]);
    sum += r * r;
  }
  return sum;
}
template <int D>
double squared_distance(const Cloud& cloud, int i, int j) {
  const double* const x = cloud.positions().data();
  return squared_distance<D>(x + std::ptrdiff_t{i} * D, x + std::ptrdiff_t{j} * D, cloud.box());
}

/// r_ij = x_j - x_i, in periodic directions to the nearest image of j.
template <int D>
Vector<D> displacement(const Cloud& cloud, int i, int j) {
  const double* const x = cloud.positions().data();
  return displacement<D>(x + std::ptrdiff_t{i} * D, x + std::ptrdiff_t{j} * D, cloud.box());
}

}  // namespace gradpsi
