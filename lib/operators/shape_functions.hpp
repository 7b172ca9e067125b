#pragma once

#include <vector>

#include "gradpsi/kernel.hpp"
#include "operators/basis.hpp"
#include "schemes/recipe.hpp"

namespace gradpsi {

/// Derivatives of the shape functions of RKPM at a point x,
///
///     N_j = f_j . b,   f_j = omega_j W(s) p_1(s),   (sum_j f_j p_1(s_j)^T) b = (1, 0, ..),   s = (x_j - x) / h,
///
/// p_1 the monomials of degree 0 to P, j = i among them: every factor differentiated by x / h.
/// W. K. Liu, S. Jun, Y. F. Zhang, Int. J. Numer. Methods Fluids 20 (1995).
template <int D>
class ShapeFunctions {
 public:
  /// At neighbours s (n x D) with the kernel's profile w, w'/q, w'' (n x 3) and volumes (n x 1), and the
  /// point's own.
  ShapeFunctions(int degree, const Columns& s, const Columns& profile, const Columns& volumes,
                 const Profile& own_profile, double own_volume);

  /// Of the moment matrix; 0: there are no derivatives.
  double reciprocal_condition() const { return reciprocal_condition_; }

  /// d N_j / dx_a of the neighbours, or d^2 N_j / dx_a dx_b.
  Eigen::ArrayXd first(int a) const;
  Eigen::ArrayXd second(int a, int b) const;
  /// omega_j W(s_j) c . p_1(s_j) of the neighbours, c such that the moments with the monomials of degree 1 to P
  /// are these, to the rounding of the inverse, and the sum with the point itself 0.
  Eigen::ArrayXd with_moments(const Eigen::VectorXd& moments) const;

 private:
  using Column = Eigen::ArrayXd;
  using Functions = Eigen::MatrixXd;  // n + 1, the point itself the last, x p_1

  Eigen::VectorXd solve(const Eigen::VectorXd& of) const { return -(inverse_ * of); }
  /// (d M / dx_a) v.
  Eigen::VectorXd first_of_moments(int a, const Eigen::VectorXd& v) const;
  Eigen::VectorXd second_of_moments(int a, int b) const;
  int pair(int a, int b) const {
    return diagonal_row<D>(a < b ? a : b) - D + (a < b ? b - a : a - b);
  }

  Column A_, dA_[D], ddA_[quadratic_size<D> - D];     // omega W and its derivatives
  Functions p_, dp_[D], ddp_[quadratic_size<D> - D];  // p_1 and its
  Eigen::MatrixXd inverse_;                           // of the moments
  Eigen::VectorXd b_, db_[D];                         // coefficients and their derivatives
  double reciprocal_condition_ = 0;
};

}  // namespace gradpsi
