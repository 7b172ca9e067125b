#pragma once

#include <Eigen/Core>
#include <cmath>

#include "gradpsi/cloud.hpp"

namespace gradpsi {

template <int D>
using Vector = Eigen::Matrix<double, D, 1>;

/// The image of coordinate x in [0, length); x itself in an open direction (length 0).
inline double wrapped(double x, double length) {
  if (length == 0) return x;
  const double y = x - length * std::floor(x / length);
  return y < length ? y : 0;  // rounding can give y = length
}

/// r_ij = x_j - x_i, in periodic directions to the nearest image of j.
template <int D>
Vector<D> displacement(const Cloud& cloud, int i, int j) {
  const double* const x = cloud.positions().data();
  Vector<D> r;
  for (int a = 0; a < D; ++a) {
    r[a] = x[std::ptrdiff_t{j} * D + a] - x[std::ptrdiff_t{i} * D + a];
    const double length = cloud.box()[a];
    if (length > 0) r[a] -= length * std::nearbyint(r[a] / length);
  }
  return r;
}

}  // namespace gradpsi
