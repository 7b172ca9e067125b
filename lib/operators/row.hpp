#pragma once

#include <span>

#include "gradpsi/cloud.hpp"
#include "gradpsi/kernel.hpp"
#include "operators/basis.hpp"
#include "operators/positive.hpp"
#include "schemes/recipe.hpp"

namespace gradpsi {

/// Least squares whose system, its diagonal scaled to 1, has a smaller reciprocal condition number are
/// refined once, or twice.
inline constexpr double refined_below = 1e-4, refined_twice_below = 1e-9;

/// Rows whose system has a smaller reciprocal condition number are asked whether they keep their promises;
/// the others do, by two digits and more.
inline constexpr double checked_below = 1e-12;

/// How a row was solved.
struct Solution {
  double reciprocal_condition = 0;  // see RowReport
  bool solved = false;
};

/// One row of an operator, of any scheme, one neighbour after the other as the formulas have it: the slow
/// way, and the reference. Its memory is used again for the next row.
template <int D>
class Row {
 public:
  explicit Row(const Kernel& kernel) : kernel_(kernel) {}

  /// Takes up the neighbours of point i within `support`.
  void gather(const Cloud& cloud, std::span<const int> neighbours, double support,
              const DenseVector& volumes, int i);
  /// Takes up neighbours at s (n x d), in units of the support, with these volumes (n x 1) and the point's own,
  /// 0 where there is no point.
  void gather(double support, const Columns& s, const Columns& volumes, double own_volume);

  /// Computes the weights a_ij of a scheme; zeros, if it cannot be.
  Solution solve(const Equations& equations);

  /// Matrices that the last solve() was about.
  int outputs() const { return outputs_; }

  /// Writes one of the outputs as row i of a matrix, neighbours ascending, the diagonal in its place.
  void write(std::span<const int> neighbours, int i, int output, double* entry);

 private:
  Columns s() { return s_.columns(n_, D); }            // r_ij / h
  Columns q() { return q_.columns(n_, 1); }            // |r_ij| / h
  Columns volume() { return volume_.columns(n_, 1); }  // omega_j s_d / h^d
  Columns weight() { return weight_.columns(n_, 1); }  // omega_j phi(r), but for powers of h

  Columns profile() { return profile_.columns(n_, 3); }         // w, w'/q, w''
  Columns weights() { return weights_.columns(n_, outputs_); }  // a_ij of the last solve()

  void prepare();
  void weigh(const Equations& equations);
  Solution own(const Equations& equations);
  Solution given(const Equations& equations);
  Solution moments(const Equations& equations);
  Solution normalized(const Equations& equations);
  Solution least_squares(const Equations& equations);
  Solution shape_functions(const Equations& equations);
  Solution positive();
  double unit(const Equations& equations) const;
  Eigen::MatrixXd targets(const Equations& equations) const;
  void fill(const Equations& equations, Columns t);
  void centre(const Equations& equations, Columns t);
  Eigen::MatrixXd lacking(const Equations& equations, const Columns& p);
  bool keeps_promises(const Equations& equations);
  /// Whether u is fitted where there is no point: no diagonal then makes up for what the others lack.
  bool is_alone(const Equations& equations) const { return equations.fitted && own_volume_ == 0; }
  void combine(const Columns& t, const Eigen::MatrixXd& C);
  void take_first_moments_away(const Columns& gradient);

  Kernel kernel_;
  int n_ = 0;                            // neighbours
  double h_ = 0;                         // support
  double own_volume_ = 0;                // as volume()
  int outputs_ = 0;                      // of the last solve()
  double diagonal_ = -1, constant_ = 0;  // see Equations
  Buffer s_, q_, volume_, weight_, profile_, trial_, test_, weighted_, weights_, sum_, gradient_;
  PositiveStencil<D> stencil_;
  Eigen::ArrayXd sums_;
};

extern template class Row<1>;
extern template class Row<2>;
extern template class Row<3>;

}  // namespace gradpsi
