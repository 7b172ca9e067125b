#include "tolerance/directions.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace gradpsi {
namespace {

constexpr double pi = std::numbers::pi;

Directions on_a_circle(int count) {
  Directions result{Eigen::MatrixXd(count, 2), pi / (2 * count)};
  for (int i = 0; i < count; ++i) {
    const double angle = pi * (i + 0.5) / count;
    result.axes.row(i) << std::cos(angle), std::sin(angle);
  }
  return result;
}

/// Three faces of a cube, each in n x n cells: the middles. Cells are convex, so their corners are furthest.
Directions on_a_sphere(int n) {
  Directions result{Eigen::MatrixXd(3 * n * n, 3), 0};
  const auto toward = [&](int face, double a, double b) {
    Eigen::Vector3d v;
    v[face] = 1;
    v[(face + 1) % 3] = std::tan(pi / 4 * (2 * a / n - 1));
    v[(face + 2) % 3] = std::tan(pi / 4 * (2 * b / n - 1));
    return Eigen::Vector3d(v.normalized());
  };
  for (int face = 0; face < 3; ++face)
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b) {
        const Eigen::Vector3d middle = toward(face, a + 0.5, b + 0.5);
        result.axes.row((face * n + a) * n + b) = middle;
        for (const int c : {0, 1})
          for (const int d : {0, 1}) {
            const Eigen::Vector3d corner = toward(face, a + c, b + d);
            result.apart =
                std::max(result.apart, std::atan2(middle.cross(corner).norm(), middle.dot(corner)));
          }
      }
  return result;
}

}  // namespace

const Directions& directions(int dimension) {
  static const std::array<Directions, 3> all = {Directions{Eigen::MatrixXd::Ones(1, 1), 0},
                                                on_a_circle(24), on_a_sphere(10)};
  return all[dimension - 1];
}

}  // namespace gradpsi
