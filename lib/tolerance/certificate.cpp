#include "tolerance/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/tolerance.hpp"
#include "tolerance/directions.hpp"

namespace gradpsi {

namespace {

/// Those of degree m, after those of the degree before.
/// @param begin  of the degree before, those whose factors are s_a or later ones
template <int D>
Degree<D> next_after(const std::vector<Degree<D>>& before, std::array<std::size_t, D>& begin) {
  if (before.empty())
    return {{{0, 0, 1, {}}}, Eigen::MatrixXd::Ones(directions(D).axes.rows(), 1), 1};
  const auto& last = before.back();
  Degree<D> result{{}, {}, static_cast<double>(before.size()) * last.factorial};
  for (int a = 0; a < D; ++a) {
    const std::size_t first = begin[a];
    begin[a] = result.monomials.size();
    for (std::size_t rest = first; rest < last.monomials.size(); ++rest) {
      auto monomial = last.monomials[rest];
      monomial.factor = a;
      monomial.rest = static_cast<int>(rest);
      monomial.factorial *= ++monomial.powers[a];
      result.monomials.push_back(monomial);
    }
  }
  result.at_directions.resize(last.at_directions.rows(), std::ssize(result.monomials));
  for (Eigen::Index c = 0; c < result.at_directions.cols(); ++c)
    result.at_directions.col(c) =
        last.at_directions.col(result.monomials[c].rest)
            .cwiseProduct(directions(D).axes.col(result.monomials[c].factor));
  return result;
}

/// Up to that of the longest series.
template <int D>
const std::vector<Degree<D>>& degrees(int highest) {
  static const std::vector<Degree<D>> all = [highest] {
    std::vector<Degree<D>> result;
    std::array<std::size_t, D> begin{};
    for (int m = 0; m <= highest; ++m) result.push_back(next_after<D>(result, begin));
    return result;
  }();
  return all;
}

}  // namespace

template <int D>
Certificate<D>::Certificate(const Target& target, const Cloud& cloud)
    : target_(target), cloud_(cloud), degrees_(degrees<D>(highest)) {
  for (const Degree<D>& degree : degrees_) {
    Eigen::MatrixXd asked(std::ssize(degree.monomials), target.outputs(D));
    for (Eigen::Index c = 0; c < asked.rows(); ++c)
      for (Eigen::Index o = 0; o < asked.cols(); ++o)
        asked(c, o) = target.of(static_cast<int>(o), degree.monomials[c].powers);
    defects_.push_back(asked);
    asked_.push_back(std::move(asked));
  }
}

template <int D>
void Certificate<D>::gather(const Operator& op, int k, double wavenumber) {
  const SparseMatrix& pattern = op.axes.front();
  const int begin = pattern.outerIndexPtr()[k], i = op.point(k);
  count_ = pattern.outerIndexPtr()[k + 1] - begin;
  if (count_ > offsets_.rows()) {
    const auto room = 2 * count_, most = std::ssize(degrees_.back().monomials);
    offsets_.resize(room, D);
    weights_.resize(room, std::ssize(op.axes));
    magnitudes_.resize(room, std::ssize(op.axes));
    products_.resize(room, most);
    last_.resize(room, most);
    lengths_.resize(room);
    sizes_.resize(room);
  }
  for (Eigen::Index e = 0; e < count_; ++e) {
    const int j = pattern.innerIndexPtr()[begin + e];
    Vector<D> s = Vector<D>::Zero();
    if (j != i) s = wavenumber * displacement<D>(cloud_, i, j);
    offsets_.row(e) = s.array().transpose();
    lengths_[e] = s.norm();
  }
  double unit = 1;
  for (int q = 0; q < target_.order; ++q) unit /= wavenumber;
  for (Eigen::Index o = 0; o < weights_.cols(); ++o) {
    weights_.col(o).head(count_) =
        unit * Eigen::Map<const Eigen::ArrayXd>(op.axes[o].valuePtr() + begin, count_);
    magnitudes_.col(o).head(count_) = weights_.col(o).head(count_).abs();
  }
  sizes_.head(count_).setOnes();
  beyond_ = all_sizes();
  rounding_ = 0;
}

/// sum_j |a_ij| |s|^m / m!, of all outputs.
template <int D>
double Certificate<D>::all_sizes() const {
  double all = 0;  // squares may be beyond a double
  for (Eigen::Index o = 0; o < magnitudes_.cols(); ++o)
    all = std::hypot(all, (magnitudes_.col(o).head(count_) * sizes_.head(count_)).sum());
  return all;
}

/// The moments of degree m less what the target makes of them, and what the degrees beyond can add.
template <int D>
void Certificate<D>::next_degree(int m) {
  const Degree<D>& degree = degrees_[m];
  if (m > 0) last_.swap(products_);
  Eigen::MatrixXd& defects = defects_[m];
  double squares = 0;
  for (Eigen::Index c = 0; c < defects.rows(); ++c) {
    const auto& monomial = degree.monomials[c];
    auto product = products_.col(c).head(count_);
    if (m == 0)
      product.setOnes();
    else
      product = last_.col(monomial.rest).head(count_) * offsets_.col(monomial.factor).head(count_);
    for (Eigen::Index o = 0; o < defects.cols(); ++o) {
      const double moment = (product * weights_.col(o).head(count_)).sum();
      const double off = (moment - asked_[m](c, o)) / monomial.factorial;
      defects(c, o) = off;
      squares += off * off * monomial.factorial;
    }
  }
  largest_[m] = std::sqrt(squares / degree.factorial);  // the Frobenius norm of the tensor
  constexpr double eps = std::numeric_limits<double>::epsilon();
  rounding_ += static_cast<double>(count_ + m + 4) * eps * beyond_;
  sizes_.head(count_) *= lengths_.head(count_) / (m + 1);
  beyond_ = all_sizes();
}

/// Of the degrees 0 to `degrees`, real and imaginary parts.
template <int D>
double Certificate<D>::series(int degrees) const {
  double parts[2] = {};
  for (int m = 0; m <= degrees; ++m) parts[m % 2] += largest_[m];
  return std::hypot(parts[0], parts[1]);
}

template <int D>
double Certificate<D>::worst_direction(int m) const {
  const double angle = m * directions(D).apart;
  if (angle > std::numbers::pi / 3) return largest_[m];
  const double found = (degrees_[m].at_directions * defects_[m]).rowwise().squaredNorm().maxCoeff();
  return std::min(largest_[m], std::sqrt(found) / std::cos(angle));
}

template <int D>
double Certificate<D>::operator()(const Operator& op, int k, double wavenumber, double tolerance) {
  constexpr double small = 0.02, beyond_doubt = 4;
  const auto misses = [&](double bound) {
    return tolerance > 0 && bound > beyond_doubt * tolerance;
  };
  gather(op, k, wavenumber);
  const double entries = beyond_;
  int m = 0;
  next_degree(m);
  while (m < highest && !(m > target_.order && misses(series(m))) &&
         (m <= target_.order || beyond_ > small * series(m)))
    next_degree(++m);
  const double all = series(m), others = beyond_ + rounding_;
  // No wave makes more of a row than its entries add up to, nor of the derivative than 1.
  const double most = entries + 1;
  const auto least = [&](double bound) { return bound < most ? bound : most; };
  if (all + others <= tolerance || misses(all + others)) return least(all + others);
  for (int degree = 1; degree <= m; ++degree)
    if (largest_[degree] > small * all) largest_[degree] = worst_direction(degree);
  return least(series(m) + others);
}

template class Certificate<1>;
template class Certificate<2>;
template class Certificate<3>;

namespace {

void check(const Target& target, const Cloud& cloud, const Operator& op,
           const VectorView& wavelengths) {
  const int n = cloud.size(), outputs = target.outputs(cloud.dimension());
  if (std::ssize(op.axes) != outputs || op.matrix().cols() != n || op.normals.size() > 0 ||
      op.matrix().rows() != (op.points.empty() ? n : std::ssize(op.points)))
    throw InvalidInput("the operator is not a " + std::string(target.name) + " of these " +
                       std::to_string(n) + " points");
  check_wavelengths(target.order, n, wavelengths);
}

}  // namespace

void check_wavelengths(int order, int n, const VectorView& wavelengths) {
  if (wavelengths.size() != 1 && wavelengths.size() != n)
    throw InvalidInput(std::to_string(wavelengths.size()) + " wavelengths for " +
                       std::to_string(n) + " points: give one, or one a point");
  for (const double L : wavelengths)
    if (!(L > 0 && std::isfinite(L)) || !std::isnormal(std::pow(L, order)) ||
        !std::isnormal(std::pow(1 / L, order)))
      throw InvalidInput("wavelengths must be > 0 and finite, and so their powers, not " +
                         shortest(L));
}

DenseVector bounded_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                           const VectorView& wavelengths, double tolerance, int threads) {
  const Target& target = gradpsi::target(derivative);
  const auto rows = static_cast<int>(op.matrix().rows());
  DenseVector errors(rows);
  dispatch(cloud.dimension(), [&](auto d) {
    parallel_chunks(rows, 256, threads,
                    [&, bound = Certificate<d>(target, cloud)](int begin, int end) mutable {
                      for (int k = begin; k < end; ++k) {
                        const double L = wavelengths[wavelengths.size() == 1 ? 0 : op.point(k)];
                        errors[k] = op.rows.outcome[k] == RowOutcome::Zero
                                        ? std::numeric_limits<double>::infinity()
                                        : bound(op, k, 2 * std::numbers::pi / L, tolerance);
                      }
                    });
  });
  return errors;
}

DenseVector certified_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                             const VectorView& wavelengths, int threads) {
  checked_threads(threads);
  check(gradpsi::target(derivative), cloud, op, wavelengths);
  return bounded_errors(derivative, cloud, op, wavelengths, 0, threads);
}

}  // namespace gradpsi
