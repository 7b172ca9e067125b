#include "operators/shape_functions.hpp"

#include "operators/moments.hpp"

namespace gradpsi {

template <int D>
ShapeFunctions<D>::ShapeFunctions(int degree, const Columns& s, const Columns& profile,
                                  const Columns& volumes, const Profile& own_profile,
                                  double own_volume) {
  const auto n = s.rows();
  const int m = monomials_to(D, degree);
  Eigen::ArrayXXd all = Eigen::ArrayXXd::Zero(n + 1, D);
  all.topRows(n) = s;
  Column omega(n + 1), w(n + 1), dw(n + 1), over(n + 1);
  omega << volumes.col(0), own_volume;
  w << profile.col(0), own_profile.w;
  dw << profile.col(1), own_profile.dw_over_q;
  over << (profile.col(2) - profile.col(1)) / s.square().rowwise().sum(), 0;
  A_ = omega * w;
  for (int a = 0; a < D; ++a) {
    dA_[a] = -omega * dw * all.col(a);
    for (int b = a; b < D; ++b) {
      ddA_[pair(a, b)] = omega * over * all.col(a) * all.col(b);
      if (a == b) ddA_[pair(a, b)] += omega * dw;
    }
  }

  // By d/dx = -d/ds. Monomial k is s_factor times monomial `rest`, of which the constant one is in front.
  constexpr const auto& table = monomial_table<D, highest_degree>;
  p_ = Functions::Ones(n + 1, m + 1);
  for (Functions& f : dp_) f = Functions::Zero(n + 1, m + 1);
  for (Functions& f : ddp_) f = Functions::Zero(n + 1, m + 1);
  for (int k = 0; k < m; ++k) {
    const int f = k < D ? k : table.factor[k], rest = k < D ? 0 : 1 + table.rest[k];
    const auto times_s = [&](const Functions& g) {
      return (all.col(f) * g.col(rest).array()).matrix();
    };
    p_.col(1 + k) = times_s(p_);
    for (int a = 0; a < D; ++a) {
      dp_[a].col(1 + k) = times_s(dp_[a]);
      if (a == f) dp_[a].col(1 + k) -= p_.col(rest);
      for (int b = a; b < D; ++b) {
        Functions& dd = ddp_[pair(a, b)];
        dd.col(1 + k) = times_s(dd);
        if (a == f) dd.col(1 + k) -= dp_[b].col(rest);
        if (b == f) dd.col(1 + k) -= dp_[a].col(rest);
      }
    }
  }

  const Inverse inverse = invert_definite(p_.transpose() * A_.matrix().asDiagonal() * p_);
  reciprocal_condition_ = inverse.reciprocal_condition;
  if (reciprocal_condition_ == 0) return;
  inverse_ = inverse.matrix;
  b_ = inverse_.col(0);
  for (int a = 0; a < D; ++a) db_[a] = solve(first_of_moments(a, b_));
}

template <int D>
Eigen::VectorXd ShapeFunctions<D>::first_of_moments(int a, const Eigen::VectorXd& v) const {
  const Column f = p_ * v, df = dp_[a] * v;
  return p_.transpose() * (dA_[a] * f + A_ * df).matrix() + dp_[a].transpose() * (A_ * f).matrix();
}

/// (d^2 M / dx_a dx_b) b.
template <int D>
Eigen::VectorXd ShapeFunctions<D>::second_of_moments(int a, int b) const {
  const int ab = pair(a, b);
  const Column f = p_ * b_, fa = dp_[a] * b_, fb = dp_[b] * b_, fab = ddp_[ab] * b_;
  return p_.transpose() * (ddA_[ab] * f + dA_[a] * fb + dA_[b] * fa + A_ * fab).matrix() +
         dp_[a].transpose() * (dA_[b] * f + A_ * fb).matrix() +
         dp_[b].transpose() * (dA_[a] * f + A_ * fa).matrix() +
         ddp_[ab].transpose() * (A_ * f).matrix();
}

template <int D>
Eigen::ArrayXd ShapeFunctions<D>::first(int a) const {
  const Column f = p_ * b_, fa = dp_[a] * b_ + p_ * db_[a];
  return (dA_[a] * f + A_ * fa).head(A_.size() - 1);
}

template <int D>
Eigen::ArrayXd ShapeFunctions<D>::second(int a, int b) const {
  const int ab = pair(a, b);
  const Eigen::VectorXd ddb =
      solve(second_of_moments(a, b) + first_of_moments(a, db_[b]) + first_of_moments(b, db_[a]));
  const Column f = p_ * b_, fa = dp_[a] * b_ + p_ * db_[a], fb = dp_[b] * b_ + p_ * db_[b],
               fab = ddp_[ab] * b_ + dp_[a] * db_[b] + dp_[b] * db_[a] + p_ * ddb;
  return (ddA_[ab] * f + dA_[a] * fb + dA_[b] * fa + A_ * fab).head(A_.size() - 1);
}

template <int D>
Eigen::ArrayXd ShapeFunctions<D>::with_moments(const Eigen::VectorXd& moments) const {
  const Column f = p_ * (inverse_.rightCols(moments.size()) * moments);
  return (A_ * f).head(A_.size() - 1);
}

template class ShapeFunctions<1>;
template class ShapeFunctions<2>;
template class ShapeFunctions<3>;

}  // namespace gradpsi
