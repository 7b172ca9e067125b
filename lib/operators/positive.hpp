#pragma once

#include <Eigen/Core>
#include <vector>

#include "operators/basis.hpp"

namespace gradpsi {

/// A wall at the point: the derivative along its normal is known, and takes part.
template <int D>
struct Wall {
  Eigen::Matrix<double, D, 1> normal;  // of length 1
  /// Whether of the second moments their trace alone is asked for, sum psi_j |s_j|^2 = 2 d.
  bool trace_only = false;
  double slope = 0;  // what solve() multiplies it by, b
};

/// Minimal positive stencils (B. Seibold): of all weights psi_j >= 0 with
///
///     sum psi_j s_j = 0,    sum psi_j s_j s_j^T = 2 I,
///
/// those with the least sum q_j^5 psi_j; at most d(d+3)/2 are not zero. A linear programme, solved by the
/// dual simplex method: the costs are positive, so that no weights at all are a dual feasible start.
/// Ties are broken by distance and position, not by number: permuted neighbours get permuted weights.
template <int D>
class PositiveStencil {
 public:
  /// Sets the weights psi (n) of neighbours at s (n x D), q = |s| > 0 (n).
  /// @return  reciprocal condition number (1-norm) of the equations that determine the weights;
  ///   0: there are no such weights, psi is zero
  double solve(const Columns& s, const Columns& q, Columns psi) {
    return solve(s, q, psi, nullptr);
  }
  /// The same at a wall: sum psi_j s_j + b n = 0 with b >= 0 takes the place of sum psi_j s_j = 0, so that
  /// neighbours on one side will do.
  double solve(const Columns& s, const Columns& q, Columns psi, Wall<D>& wall) {
    return solve(s, q, psi, &wall);
  }

 private:
  static constexpr int m = quadratic_size<D>;
  using Vector = Eigen::Matrix<double, m, 1>;
  using Matrix = Eigen::Matrix<double, m, m>;

  double solve(const Columns& s, const Columns& q, Columns psi, Wall<D>* wall);
  void start(const Columns& s, const Columns& q, const Wall<D>* wall);
  void add_slope(const Wall<D>& wall, double unit);
  bool optimise();
  int leaving(bool first) const;
  int entering(int row, bool first);
  void pivot(int row, int column);

  // In the unknowns x_j = psi_j q_j^2, neighbours by distance:
  Columns equations() { return equations_.columns(n_, m + 1); }  // a column each; then the costs
  Columns tableau() { return tableau_.columns(n_, m + 1); }      // the same, eliminated

  int n_ = 0;               // unknowns: neighbours, at a wall the slope as well
  std::vector<int> order_;  // of the neighbours
  Buffer equations_, tableau_;
  Vector value_;  // of the basic unknowns
  Eigen::Array<int, m, 1>
      basis_;  // the unknown that row holds; -1: none yet, its sum is lacking value_
};

}  // namespace gradpsi
