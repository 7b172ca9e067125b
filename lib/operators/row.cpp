#include "operators/row.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/resize.hpp"
#include "cloud/points.hpp"
#include "gradpsi/operator.hpp"
#include "operators/moments.hpp"

namespace gradpsi {
namespace {

double value(const Phi& c, const Profile& p, double q) {
  double sum = c.w * p.w + c.dw_over_q * p.dw_over_q + c.d2w * p.d2w;
  if (c.w_over_q != 0) sum += c.w_over_q * (p.w / q);
  if (c.w_over_q2 != 0) sum += c.w_over_q2 * (p.w / (q * q));
  return sum;
}

}  // namespace

template <int D>
void Row<D>::gather(const Cloud& cloud, std::span<const int> neighbours, double support,
                    const DenseVector& volumes, int i) {
  n_ = static_cast<int>(neighbours.size());
  h_ = support;
  const double per_h = 1 / h_;
  Columns s = this->s(), volume = this->volume();
  for (int k = 0; k < n_; ++k) {
    s.row(k) = displacement<D>(cloud, i, neighbours[k]) * per_h;
    volume(k) = volumes[neighbours[k]];
  }
  prepare();
}

template <int D>
void Row<D>::gather(double support, const Columns& s, const Columns& volumes) {
  n_ = static_cast<int>(s.rows());
  h_ = support;
  Columns own_s = this->s(), own_volumes = volume();
  own_s = s;
  own_volumes = volumes;
  prepare();
}

/// The distances, and the volumes in units of the support.
template <int D>
void Row<D>::prepare() {
  const double per_h = 1 / h_;
  Columns s = this->s(), q = this->q(), volume = this->volume();
  q = s.square().rowwise().sum().sqrt().min(1);  // rounding can lift a neighbour past the support
  // One h at a time: 1 / h^d may be beyond a double where omega / h^d is not.
  for (int a = 0; a < D; ++a) volume *= per_h;
  volume *= kernel_.normalisation[D - 1];
}

template <int D>
Solution Row<D>::solve(const Equations& equations) {
  outputs_ = equations.outputs;
  resize(sums_, outputs_);
  sums_.setZero();
  weights().setZero();
  if (n_ == 0) return {};
  if (equations.how != How::Programme) weigh(equations);
  Solution solution;
  switch (equations.how) {
    case How::Given: solution = given(equations); break;
    case How::Moments: solution = moments(equations); break;
    case How::LeastSquares: solution = least_squares(equations); break;
    case How::Programme: solution = positive(); break;
  }
  for (int o = 0; o < outputs_; ++o) sums_[o] = weights().col(o).sum();
  solution.solved = solution.solved && sums_.isFinite().all() &&
                    (solution.reciprocal_condition > checked_below || keeps_promises(equations));
  if (!solution.solved) {
    weights().setZero();
    sums_.setZero();
  }
  return solution;
}

template <int D>
void Row<D>::weigh(const Equations& equations) {
  Columns weight = this->weight(), q = this->q();
  for (int k = 0; k < n_; ++k) weight(k) = value(equations.phi, kernel_.profile(q(k)), q(k));
  if (equations.how == How::LeastSquares) weight = weight.abs();
  weight *= volume();
}

/// What the moments are to be, unknowns x outputs, in units of h.
template <int D>
Eigen::MatrixXd Row<D>::targets(const Equations& equations) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(equations.unknowns, equations.outputs);
  const double unit = equations.order == 1 ? h_ : h_ * h_;
  for (const Term& term : equations.terms) result(term.monomial, term.output) = term.value / unit;
  return result;
}

/// Whether the weights meet the conditions up to `missed_above`, and the rounding of what they are applied to
/// is below it as well.
template <int D>
bool Row<D>::keeps_promises(const Equations& equations) {
  constexpr double rounding = std::numeric_limits<double>::epsilon() / 2;
  const Columns p = test_.columns(n_, equations.unknowns);
  fill_monomials<D>(s(), p);
  const Eigen::MatrixXd wanted = targets(equations);
  const Eigen::MatrixXd missed = p.matrix().transpose().lazyProduct(weights().matrix()) - wanted;
  const double noise = rounding * weights().abs().colwise().sum().maxCoeff();
  return std::max(missed.cwiseAbs().maxCoeff(), noise) <=
         missed_above * wanted.cwiseAbs().maxCoeff();
}

template <int D>
Solution Row<D>::given(const Equations& equations) {
  const Columns t = trial_.columns(n_, equations.unknowns);
  fill_trial<D>(equations.form, s(), q(), t);
  double factor = 1;
  for (int n = 0; n > equations.given_power; --n) factor /= h_;
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(equations.unknowns, equations.outputs);
  for (const Term& term : equations.terms) C(term.monomial, term.output) = factor * term.value;
  combine(t, C);
  return {1, true};
}

/// Solves (sum w p t^T) C = targets and sets the weights w_j C^T t_j.
template <int D>
Solution Row<D>::moments(const Equations& equations) {
  const int m = equations.unknowns;
  if (n_ < m) return {};
  const bool definite = equations.form == Form::Monomials;  // p = t, and all w_j > 0
  const Columns t = trial_.columns(n_, m);
  fill_trial<D>(equations.form, s(), q(), t);
  const Columns p = definite ? t : test_.columns(n_, m);
  if (!definite) fill_monomials<D>(s(), p);
  const Eigen::MatrixXd M = gradpsi::moments(weight(), p, t, weighted_.columns(n_, m));
  const Inverse inverse = definite ? invert_definite(M) : invert_general(M);
  if (inverse.reciprocal_condition < singular_below) return {inverse.reciprocal_condition, false};
  combine(t, inverse.matrix.lazyProduct(targets(equations)));
  return {inverse.reciprocal_condition, true};
}

/// The weights w_j C^T p_j, p the monomials to the degree, that reproduce these: of all such weights those
/// with the least sum a^2 / w. The normal equations with their diagonal scaled to 1 determine C; their
/// rounding, up to 1e-16 times the condition, goes into a second and third round, for what the weights'
/// own moments still lack. That leaves the error of an orthogonal factorisation.
template <int D>
Solution Row<D>::least_squares(const Equations& equations) {
  const int m = equations.unknowns;
  if (n_ < m) return {};
  const Columns p = trial_.columns(n_, m);
  fill_monomials<D>(s(), p);
  const Eigen::MatrixXd M = gradpsi::moments(weight(), p, p, weighted_.columns(n_, m));
  const Eigen::VectorXd scale = M.diagonal().cwiseSqrt().cwiseInverse();
  Inverse inverse = invert_definite(scale.asDiagonal() * M * scale.asDiagonal());
  const double scaled_reciprocal = inverse.reciprocal_condition;
  if (scaled_reciprocal == 0) return {};
  inverse.matrix = scale.asDiagonal() * inverse.matrix * scale.asDiagonal();

  const Eigen::MatrixXd wanted = targets(equations);
  combine(p, inverse.matrix.lazyProduct(wanted));
  const int refinements =
      (scaled_reciprocal <= refined_below) + (scaled_reciprocal <= refined_twice_below);
  for (int n = 0; n < refinements; ++n) {
    const Eigen::MatrixXd own = p.matrix().transpose().lazyProduct(weights().matrix());
    combine(p, inverse.matrix.lazyProduct(wanted - own));
  }
  return {1 / (one_norm(M) * one_norm(inverse.matrix)), scaled_reciprocal >= singular_below};
}

template <int D>
Solution Row<D>::positive() {
  Columns psi = weights();
  const double reciprocal_condition = stencil_.solve(s(), q(), psi);
  psi /= h_ * h_;
  return {reciprocal_condition, reciprocal_condition > 0};
}

/// Adds w_j C^T t_j to the weights.
template <int D>
void Row<D>::combine(const Columns& t, const Eigen::MatrixXd& C) {
  Columns a = weights(), sum = sum_.columns(n_, 1);
  for (Eigen::Index c = 0; c < C.cols(); ++c) {
    sum = C(0, c) * t.col(0);
    for (Eigen::Index l = 1; l < C.rows(); ++l) sum += C(l, c) * t.col(l);
    a.col(c) += sum.col(0) * weight().col(0);
  }
}

template <int D>
void Row<D>::write(std::span<const int> neighbours, int i, int output, double* entry) {
  const auto before = std::ranges::lower_bound(neighbours, i) - neighbours.begin();
  const double* const a = weights().col(output).data();
  entry = std::copy_n(a, before, entry);
  *entry++ = 0 - sums_[output];  // 0, not -0, in a row left zero
  std::copy(a + before, a + neighbours.size(), entry);
}

template class Row<1>;
template class Row<2>;
template class Row<3>;

}  // namespace gradpsi
