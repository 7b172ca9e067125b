#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "gradpsi/cloud.hpp"
#include "gradpsi/kernel.hpp"
#include "operators/row.hpp"

namespace gradpsi {

using Direction = Eigen::Vector3d;         // of length 1
using Axes = Eigen::Matrix<double, 3, 2>;  // two of them, at a right angle

/// The part of the heights' mean square that a polynomial may leave, over h^2: beyond it the neighbours are
/// no surface.
inline constexpr double rough_above = 0.01;

/// Matrices of a scheme whose equations are those of two dimensions.
int surface_outputs(const Equations& equations);

/// Coefficients of the polynomial that the surface is taken for, with a scheme of that degree.
int surface_unknowns(int degree);

/// One row of an operator within a surface in three dimensions: that of two dimensions, in the plane that
/// touches the surface at the point.
///
/// Let zeta(xi, eta) be the height over a plane through the point. Where its slope is 0, the metric is
/// g_ab = delta_ab + zeta_a zeta_b with no first derivatives and without Christoffel symbols, so that
/// gradient and Laplace-Beltrami operator are those of the plane, d/dxi, d/deta and their squares. The slope is
/// that of a polynomial fitted to the heights, of the scheme's degree but 2 at least, which is off by
/// O(h^degree), as the gradient is; the plane is turned until it is 0.
class SurfaceRow {
 public:
  explicit SurfaceRow(const Kernel& kernel) : kernel_(kernel), row_(kernel) {}

  /// Takes up the neighbours of point i within `support`, volumes being areas.
  void gather(const Cloud& cloud, std::span<const int> neighbours, double support,
              const DenseVector& volumes, int i);

  /// Computes the weights of a scheme in two dimensions; zeros, if it cannot be or no plane touches.
  Solution solve(const Equations& equations);

  /// Of the surface, of either sign; 0, if no plane touches.
  const Direction& normal() const { return normal_; }

  /// Matrices: 3 for a gradient, whose components are along the surface, 1 for a Laplacian.
  int outputs() const { return outputs_; }
  /// Writes one of them as row i, see Row::write().
  void write(std::span<const int> neighbours, int i, int output, double* entry);

 private:
  Columns r() { return r_.columns(n_, 3); }            // r_ij / h
  Columns area() { return area_.columns(n_, 1); }      // omega_j
  Columns weight() { return weight_.columns(n_, 1); }  // see weigh()

  template <class Offsets>
  void weigh(const Offsets& s);
  Direction flattest();
  bool touch(int degree);
  std::optional<Eigen::Vector2d> slope(const Direction& normal, const Axes& axes, int degree);

  Kernel kernel_;
  Row<2> row_;
  int n_ = 0;  // neighbours
  double h_ = 0, own_area_ = 0;
  int outputs_ = 0;  // of the last solve()
  Direction normal_ = Direction::Zero();
  Axes axes_;
  int degree_ = 0;  // of the polynomial that the plane touches; 0: not yet known
  Buffer r_, area_, weight_, plane_, monomials_, weighted_, entries_;
};

}  // namespace gradpsi
