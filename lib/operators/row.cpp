#include "operators/row.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/resize.hpp"
#include "cloud/points.hpp"
#include "gradpsi/operator.hpp"
#include "operators/moments.hpp"
#include "operators/shape_functions.hpp"

namespace gradpsi {
namespace {

double value(const Phi& c, const Profile& p, double q) {
  double sum = c.w * p.w + c.dw_over_q * p.dw_over_q + c.d2w * p.d2w + c.constant;
  if (c.w_over_q != 0) sum += c.w_over_q * (p.w / q);
  if (c.w_over_q2 != 0) sum += c.w_over_q2 * (p.w / (q * q));
  return c.damping == 0 ? sum : sum * (q * q / (q * q + c.damping));
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
  own_volume_ = volumes[i];
  prepare();
}

template <int D>
void Row<D>::gather(double support, const Columns& s, const Columns& volumes, double own_volume) {
  n_ = static_cast<int>(s.rows());
  h_ = support;
  Columns own_s = this->s(), own_volumes = volume();
  own_s = s;
  own_volumes = volumes;
  own_volume_ = own_volume;
  prepare();
}

/// The distances, and the volumes in units of the support.
template <int D>
void Row<D>::prepare() {
  const double per_h = 1 / h_;
  Columns s = this->s(), q = this->q(), volume = this->volume();
  q = s.square().rowwise().sum().sqrt().min(1);  // rounding can lift a neighbour past the support
  // One h at a time: 1 / h^d may be beyond a double where omega / h^d is not.
  for (int a = 0; a < D; ++a) volume *= per_h, own_volume_ *= per_h;
  volume *= kernel_.normalisation[D - 1];
  own_volume_ *= kernel_.normalisation[D - 1];
}

template <int D>
Solution Row<D>::solve(const Equations& equations) {
  Solution gradient{1, true};
  if (!equations.after.empty()) {
    gradient = solve(equations.after.front());
    gradient_.columns(n_, D) = weights();
  }
  outputs_ = equations.outputs;
  diagonal_ = equations.diagonal;
  constant_ = 0;
  resize(sums_, outputs_);
  sums_.setZero();
  weights().setZero();
  if (n_ == 0 || !gradient.solved) return {};
  Solution solution = own(equations);
  if (!equations.after.empty()) {
    take_first_moments_away(gradient_.columns(n_, D));
    solution.reciprocal_condition =
        std::min(solution.reciprocal_condition, gradient.reciprocal_condition);
  }
  for (int o = 0; o < outputs_; ++o) sums_[o] = weights().col(o).sum();
  solution.solved =
      solution.solved && sums_.isFinite().all() &&
      ((solution.reciprocal_condition > checked_below && equations.how != How::ShapeFunctions) ||
       keeps_promises(equations));
  if (solution.solved) {
    constant_ = equations.constant;
  } else {
    weights().setZero();
    sums_.setZero();
  }
  return solution;
}

/// By the equations themselves, without what comes after.
template <int D>
Solution Row<D>::own(const Equations& equations) {
  if (equations.how == How::Programme) return positive();
  weigh(equations);
  switch (equations.how) {
    case How::Moments: return moments(equations);
    case How::Normalized: return normalized(equations);
    case How::LeastSquares: return least_squares(equations);
    case How::ShapeFunctions: return shape_functions(equations);
    default: return given(equations);
  }
}

template <int D>
void Row<D>::weigh(const Equations& equations) {
  Columns weight = this->weight(), q = this->q(), profile = this->profile();
  for (int k = 0; k < n_; ++k) {
    const Profile p = kernel_.profile(q(k));
    profile.row(k) << p.w, p.dw_over_q, p.d2w;
    weight(k) = value(equations.phi, p, q(k));
  }
  if (equations.how == How::LeastSquares) weight = weight.abs();
  weight *= volume();
  if (equations.how == How::Shepard) weight /= (volume().col(0) * profile.col(0)).sum();
}

/// h to the order of the derivative.
template <int D>
double Row<D>::unit(const Equations& equations) const {
  double unit = 1;
  for (int n = 0; n < equations.order; ++n) unit *= h_;
  return unit;
}

/// What the moments are to be, unknowns x outputs, in units of h.
template <int D>
Eigen::MatrixXd Row<D>::targets(const Equations& equations) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(equations.unknowns, equations.outputs);
  const double unit = this->unit(equations);
  for (const Term& term : equations.terms)
    if (term.monomial >= equations.skipped)
      result(term.monomial - equations.skipped, term.output) = term.value / unit;
  return result;
}

/// The form's functions at the neighbours, n x unknowns.
template <int D>
void Row<D>::fill(const Equations& equations, Columns t) {
  if (equations.form == Form::KernelDerivatives)
    fill_kernel_derivatives<D>(s(), q(), profile(), equations.skipped > 0, t);
  else
    fill_trial<D>(equations.form, s(), q(), t);
  if (equations.fitted) centre(equations, t);
}

/// Takes away what the functions' weighted mean is times W, the point's own value among it: then u_i is fitted
/// like the others' values.
template <int D>
void Row<D>::centre(const Equations& equations, Columns t) {
  const Profile own = kernel_.profile(0);
  const bool monomials = equations.form == Form::Monomials;  // weighed by W
  const double sum = (volume().col(0) * profile().col(0)).sum() + own_volume_ * own.w;
  for (Eigen::Index l = 0; l < t.cols(); ++l) {
    double mean = (weight().col(0) * t.col(l)).sum();
    const int monomial = static_cast<int>(l) + equations.skipped;
    if (!monomials && monomial >= D && is_square<D>(monomial)) mean += own_volume_ * own.d2w;
    mean /= sum;
    if (monomials)
      t.col(l) -= mean;
    else
      t.col(l) -= mean * profile().col(0);
  }
}

/// What the moments with the monomials p lack of those of a degree, which p has all of.
template <int D>
Eigen::MatrixXd Row<D>::lacking(const Equations& equations, const Columns& p) {
  Eigen::MatrixXd result = -(p.matrix().transpose().lazyProduct(weights().matrix()));
  for (const Term& term : equations.terms)
    if (term.monomial < p.cols())
      result(term.monomial, term.output) += term.value / unit(equations);
  return result;
}

/// Whether the weights meet the conditions of the degree that is promised up to `missed_above`, and the
/// rounding of what they are applied to is below it as well.
template <int D>
bool Row<D>::keeps_promises(const Equations& equations) {
  constexpr double rounding = std::numeric_limits<double>::epsilon() / 2;
  const int m = monomials_to(D, std::max(0, equations.exact));
  const double size = equations.order < 2 ? 1 / unit(equations) : 2 / unit(equations);
  const Columns p = test_.columns(n_, m);
  if (m > 0) fill_monomials<D>(s(), p);
  const double noise = rounding * weights().abs().colwise().sum().maxCoeff();
  const double sums =
      is_alone(equations) ? (weights().colwise().sum() - equations.constant).abs().maxCoeff() : 0;
  const double missed = m == 0 ? 0 : lacking(equations, p).cwiseAbs().maxCoeff();
  return std::max({missed, noise, sums}) <= missed_above * size;
}

template <int D>
Solution Row<D>::given(const Equations& equations) {
  const Columns t = trial_.columns(n_, equations.unknowns);
  fill(equations, t);
  double factor = 1;
  for (int n = 0; n > equations.given_power; --n) factor /= h_;
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(equations.unknowns, equations.outputs);
  for (const Term& term : equations.terms) C(term.monomial, term.output) += factor * term.value;
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
  fill(equations, t);
  const Columns p = definite ? t : test_.columns(n_, m);
  if (equations.skipped > 0)
    fill_quadratic_monomials<D>(s(), p);
  else if (!definite)
    fill_monomials<D>(s(), p);
  const Eigen::MatrixXd M = gradpsi::moments(weight(), p, t, weighted_.columns(n_, m));
  const Inverse inverse = definite ? invert_definite(M) : invert_general(M);
  if (inverse.reciprocal_condition < singular_below) return {inverse.reciprocal_condition, false};
  combine(t, inverse.matrix.lazyProduct(targets(equations)));
  return {inverse.reciprocal_condition, true};
}

/// As above, but of the matrix the diagonal alone: each component by itself.
template <int D>
Solution Row<D>::normalized(const Equations& equations) {
  const Columns t = trial_.columns(n_, D);
  fill(equations, t);
  const Eigen::VectorXd M = t.square().matrix().transpose() * weight().matrix();
  const double reciprocal_condition = M.minCoeff() / M.maxCoeff();
  if (!(reciprocal_condition >= singular_below)) return {0, false};
  combine(t, M.cwiseInverse().asDiagonal() * targets(equations));
  return {reciprocal_condition, true};
}

/// The weights w_j C^T t_j, t the monomials p to the degree, centred if u_i is fitted, that reproduce these: of
/// all such weights those with the least sum a^2 / w. The normal equations with their diagonal scaled to 1
/// determine C; their rounding, up to 1e-16 times the condition, goes into a second and third round, for what
/// the weights' own moments still lack. That leaves the error of an orthogonal factorisation. Weights of
/// values begin with the mean. Without a point of its own a row must sum up to what it should by itself.
template <int D>
Solution Row<D>::least_squares(const Equations& equations) {
  const int m = equations.unknowns;
  if (n_ < m) return {};
  const auto add_mean = [&](int output, double sum) {
    weights().col(output) +=
        weight().col(0) * (sum / (weight().sum() + own_volume_ * kernel_.profile(0).w));
  };
  if (equations.constant != 0) add_mean(0, equations.constant);
  if (m == 0) return {1, true};
  const Columns t = trial_.columns(n_, m);
  fill(equations, t);
  const Columns p = equations.fitted ? test_.columns(n_, m) : t;
  if (equations.fitted) fill_monomials<D>(s(), p);
  const Eigen::MatrixXd M = gradpsi::moments(weight(), p, t, weighted_.columns(n_, m));
  const Eigen::VectorXd scale = M.diagonal().cwiseSqrt().cwiseInverse();
  Inverse inverse = invert_definite(scale.asDiagonal() * M * scale.asDiagonal());
  const double scaled_reciprocal = inverse.reciprocal_condition;
  if (scaled_reciprocal == 0) return {};
  inverse.matrix = scale.asDiagonal() * inverse.matrix * scale.asDiagonal();

  const Eigen::MatrixXd wanted = targets(equations);
  const int refinements =
      (scaled_reciprocal <= refined_below) + (scaled_reciprocal <= refined_twice_below);
  Eigen::MatrixXd lacking = wanted;
  for (int n = 0; n <= refinements; ++n) {
    for (int o = 0; n > 0 && is_alone(equations) && o < outputs_; ++o)
      add_mean(o, equations.constant - weights().col(o).sum());
    if (n > 0 || equations.constant != 0)
      lacking = wanted - p.matrix().transpose().lazyProduct(weights().matrix());
    combine(t, inverse.matrix.lazyProduct(lacking));
  }
  return {1 / (one_norm(M) * one_norm(inverse.matrix)), scaled_reciprocal >= singular_below};
}

/// By the product rule, then with the rounding of second derivatives, which goes with the cube of the condition,
/// taken out of what the conditions are about.
template <int D>
Solution Row<D>::shape_functions(const Equations& equations) {
  if (n_ < equations.unknowns) return {};
  const ShapeFunctions<D> shape(equations.degree, s(), profile(), volume(), kernel_.profile(0),
                                own_volume_);
  if (shape.reciprocal_condition() < singular_below) return {shape.reciprocal_condition(), false};
  Columns a = weights();
  const double unit = this->unit(equations);
  for (const Term& term : equations.terms) {
    auto output = a.col(term.output);
    if (equations.order == 1) {
      output += term.value / unit * shape.first(term.monomial);
    } else {  // s_a s_b, of which d^2/dx_a dx_b makes 1, or 2
      const int x = monomial_table<D, 2>.factor[term.monomial],
                y = monomial_table<D, 2>.rest[term.monomial];
      output += term.value / (x == y ? 2 : 1) / unit * shape.second(x, y);
    }
  }
  const Columns p = test_.columns(n_, equations.unknowns);
  fill_monomials<D>(s(), p);
  for (int n = 0; n < 2; ++n) {
    const Eigen::MatrixXd lacking = this->lacking(equations, p);
    for (int o = 0; o < outputs_; ++o) a.col(o) += shape.with_moments(lacking.col(o));
  }
  return {shape.reciprocal_condition(), true};
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

/// Takes the gradient (n x D) times the weights' first moments away from them: then linear functions have none.
template <int D>
void Row<D>::take_first_moments_away(const Columns& gradient) {
  const Eigen::MatrixXd first = h_ * s().matrix().transpose().lazyProduct(weights().matrix());
  weights().matrix() -= gradient.matrix().lazyProduct(first);
}

template <int D>
void Row<D>::write(std::span<const int> neighbours, int i, int output, double* entry) {
  const auto before = std::ranges::lower_bound(neighbours, i) - neighbours.begin();
  const double* const a = weights().col(output).data();
  entry = std::copy_n(a, before, entry);
  *entry++ = constant_ + diagonal_ * sums_[output];  // 0, not -0, in a row left zero
  std::copy(a + before, a + neighbours.size(), entry);
}

template class Row<1>;
template class Row<2>;
template class Row<3>;

}  // namespace gradpsi
