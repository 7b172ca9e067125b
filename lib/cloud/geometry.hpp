#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "cloud/points.hpp"

namespace gradpsi {

/// Two directions at right angles to a normal of length 1 and to each other; 0, if it is.
inline Eigen::Matrix<double, 3, 2> tangents(const Vector<3>& normal) {
  Eigen::Matrix<double, 3, 2> result;
  if (normal.isZero(0)) return result.setZero();
  result.col(0) = normal.unitOrthogonal();
  result.col(1) = normal.cross(result.col(0));
  return result;
}

// Where derivatives are taken: what a row's offsets to its neighbours are, in how many dimensions.

/// In space, as the points are.
template <int D>
class Space {
 public:
  static constexpr int dimension = D;
  explicit Space(const Cloud& cloud) : cloud_(cloud) {}

  void stand_at(int) {}
  Vector<D> offset(int i, int j) const { return displacement<D>(cloud_, i, j); }
  /// In terms of the offsets' coordinates, derivative along the points' coordinate `a`.
  Vector<D> along(int a) const { return Vector<D>::Unit(a); }
  /// A direction in these coordinates, or its part that is within them.
  Vector<D> within(const Vector<D>& direction) const { return direction; }

 private:
  const Cloud& cloud_;
};

/// In the planes that touch a surface.
class TangentPlanes {
 public:
  static constexpr int dimension = 2;
  /// @param normals  n x 3, of length 1 or 0
  TangentPlanes(const Cloud& cloud, const Positions& normals) : cloud_(cloud), normals_(normals) {}

  void stand_at(int i) { axes_ = tangents(normals_.row(i)); }
  Vector<2> offset(int i, int j) const { return axes_.transpose() * displacement<3>(cloud_, i, j); }
  Vector<2> along(int a) const { return axes_.row(a); }
  Vector<2> within(const Vector<3>& direction) const { return axes_.transpose() * direction; }

 private:
  const Cloud& cloud_;
  const Positions& normals_;
  Eigen::Matrix<double, 3, 2> axes_ = Eigen::Matrix<double, 3, 2>::Zero();
};

}  // namespace gradpsi
