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

template <int D>
Certificate<D>::Certificate(const Target& target, const Cloud& cloud)
    : target_(target), cloud_(cloud), defects_(highest + 1), largest_(highest + 1) {
  const Directions& some = directions(D);
  monomials_.push_back({{0, 0, 1, std::vector<int>(D, 0)}});
  at_directions_.push_back(Eigen::MatrixXd::Ones(some.axes.rows(), 1));
  std::vector<int> begin(D, 0);  // those of the degree before whose factors are s_a or later ones
  for (int m = 1; m <= highest; ++m) {
    const auto before = static_cast<int>(monomials_.back().size());
    std::vector<Monomial> of_degree;
    for (int a = 0; a < D; ++a) {
      const int first = begin[a];
      begin[a] = static_cast<int>(of_degree.size());
      for (int rest = first; rest < before; ++rest) {
        Monomial next = monomials_.back()[rest];
        next.factor = a;
        next.rest = rest;
        next.factorial *= ++next.powers[a];
        of_degree.push_back(next);
      }
    }
    Eigen::MatrixXd at(some.axes.rows(), std::ssize(of_degree));
    for (Eigen::Index c = 0; c < at.cols(); ++c)
      at.col(c) = at_directions_.back()
                      .col(of_degree[c].rest)
                      .cwiseProduct(some.axes.col(of_degree[c].factor));
    monomials_.push_back(std::move(of_degree));
    at_directions_.push_back(std::move(at));
  }
}

template <int D>
void Certificate<D>::gather(const Operator& op, int k, double wavenumber) {
  const SparseMatrix& pattern = op.axes.front();
  const int begin = pattern.outerIndexPtr()[k], count = pattern.outerIndexPtr()[k + 1] - begin;
  const int i = op.point(k);
  offsets_.resize(count, D);
  for (int e = 0; e < count; ++e) {
    const int j = pattern.innerIndexPtr()[begin + e];
    if (j == i)
      offsets_.row(e).setZero();
    else
      offsets_.row(e) = wavenumber * displacement<D>(cloud_, i, j).transpose();
  }
  weights_.resize(count, std::ssize(op.axes));
  const double unit = std::pow(wavenumber, -target_.order);
  for (Eigen::Index o = 0; o < weights_.cols(); ++o)
    weights_.col(o) =
        unit * Eigen::Map<const Eigen::VectorXd>(op.axes[o].valuePtr() + begin, count);
  lengths_ = offsets_.rowwise().norm();
  sizes_.setOnes(count);
  products_.setOnes(count, 1);
  rounding_ = 0;
}

/// The moments of degree m less what the target makes of them, and what the degrees beyond can add.
template <int D>
void Certificate<D>::next_degree(int m) {
  const std::vector<Monomial>& monomials = monomials_[m];
  if (m > 0) {
    last_.swap(products_);
    products_.resize(last_.rows(), std::ssize(monomials));
    for (Eigen::Index c = 0; c < products_.cols(); ++c)
      products_.col(c) =
          last_.col(monomials[c].rest).cwiseProduct(offsets_.col(monomials[c].factor));
  }
  Eigen::MatrixXd& defects = defects_[m];
  defects.resize(products_.cols(), weights_.cols());
  double squares = 0, factorial = std::tgamma(m + 1.0);
  for (Eigen::Index c = 0; c < defects.rows(); ++c)
    for (Eigen::Index o = 0; o < defects.cols(); ++o) {
      const double of = target_.of(static_cast<int>(o), monomials[c].powers);
      const double off = (products_.col(c).dot(weights_.col(o)) - of) / monomials[c].factorial;
      defects(c, o) = off;
      squares += off * off * monomials[c].factorial / factorial;
    }
  largest_[m] = std::sqrt(squares);  // the Frobenius norm of the tensor
  const double eps = std::numeric_limits<double>::epsilon();
  rounding_ += static_cast<double>(offsets_.rows() + m + 4) * eps *
               (weights_.cwiseAbs().transpose() * sizes_).norm();
  sizes_ = sizes_.cwiseProduct(lengths_) / (m + 1);
  beyond_ = (weights_.cwiseAbs().transpose() * sizes_).norm();
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
  const double found =
      std::sqrt((at_directions_[m] * defects_[m]).rowwise().squaredNorm().maxCoeff());
  return std::min(largest_[m], found / std::cos(angle));
}

template <int D>
double Certificate<D>::operator()(const Operator& op, int k, double wavenumber) {
  constexpr double small = 0.02;
  gather(op, k, wavenumber);
  int m = 0;
  next_degree(m);
  while (m < highest && (m <= target_.order || beyond_ > small * series(m))) next_degree(++m);
  const double all = series(m);
  for (int degree = 1; degree <= m; ++degree)
    if (largest_[degree] > small * all) largest_[degree] = worst_direction(degree);
  return series(m) + beyond_ + rounding_;
}

template class Certificate<1>;
template class Certificate<2>;
template class Certificate<3>;

namespace {

void check(const Target& target, const Cloud& cloud, const Operator& op,
           const VectorView& wavelengths) {
  const int n = cloud.size(), outputs = target.outputs(cloud.dimension());
  if (std::ssize(op.axes) != outputs || op.matrix().cols() != n || op.normals.size() > 0)
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

DenseVector certified_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                             const VectorView& wavelengths, int threads) {
  checked_threads(threads);
  const Target& target = gradpsi::target(derivative);
  check(target, cloud, op, wavelengths);
  const auto rows = static_cast<int>(op.matrix().rows());
  DenseVector errors(rows);
  dispatch(cloud.dimension(), [&](auto d) {
    parallel_chunks(rows, 64, threads,
                    [&, bound = Certificate<d>(target, cloud)](int begin, int end) mutable {
                      for (int k = begin; k < end; ++k) {
                        const double L = wavelengths[wavelengths.size() == 1 ? 0 : op.point(k)];
                        errors[k] = op.rows.degree[k] < 0 && op.rows.outcome[k] == RowOutcome::Zero
                                        ? std::numeric_limits<double>::infinity()
                                        : bound(op, k, 2 * std::numbers::pi / L);
                      }
                    });
  });
  return errors;
}

}  // namespace gradpsi
