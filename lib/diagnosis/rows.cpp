#include "gradpsi/rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "cloud/geometry.hpp"
#include "gradpsi/error.hpp"
#include "schemes/targets.hpp"

namespace gradpsi {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double rounding = std::numeric_limits<double>::epsilon() / 2;

double factorial(int k) { return k < 2 ? 1 : k * factorial(k - 1); }

/// A monomial in D dimensions.
template <int D>
struct Monomial {
  int degree;
  double count;  // of the tensor's entries that are this one, k! / alpha!
  std::array<int, D> alpha;
};

template <int D>
std::vector<Monomial<D>> monomials(int most) {
  std::vector<Monomial<D>> all;
  Monomial<D> next{};
  const auto extend = [&](auto&& self, int axis) -> void {
    if (axis == D) {
      next.degree = std::accumulate(next.alpha.begin(), next.alpha.end(), 0);
      next.count = factorial(next.degree);
      for (const int k : next.alpha) next.count /= factorial(k);
      if (next.degree > 0 && next.degree <= most) all.push_back(next);
      return;
    }
    for (next.alpha[axis] = 0; next.alpha[axis] <= most; ++next.alpha[axis]) self(self, axis + 1);
  };
  extend(extend, 0);
  return all;
}

/// Sums over the entries of a row: moments of degree 1 to K and magnitudes up to degree K + 1.
template <class Geometry>
class RowSums {
  static constexpr int D = Geometry::dimension;

 public:
  RowSums(const Geometry& geometry, int K)
      : geometry_(geometry),
        basis_(monomials<D>(K)),
        moments_(basis_.size()),
        powers_(K + 1),
        sizes_(K + 2) {}

  void add_up(const SparseMatrix& A, int i) {
    std::ranges::fill(moments_, 0);
    sizes_.setZero();
    sum_ = diagonal_ = 0;
    entries_ = weights_ = negative_ = 0;
    geometry_.stand_at(i);
    for (SparseMatrix::InnerIterator entry(A, i); entry; ++entry, ++entries_) {
      sum_ += entry.value();
      if (entry.col() == i)
        diagonal_ = std::abs(entry.value());
      else
        add(entry.value(), geometry_.offset(i, static_cast<int>(entry.col())));
    }
  }

  /// By degree, 0 to K, for the output `axis` of a target.
  Eigen::RowVectorXd residuals(const Target& target, int axis) const {
    const auto K = sizes_.size() - 2;
    Eigen::RowVectorXd residuals = Eigen::RowVectorXd::Zero(K + 1);
    residuals[0] = std::abs(sum_ - target.of(axis, std::array<int, D>{})) +
                   (entries_ + 1) * rounding * (sizes_[0] + diagonal_);
    for (std::size_t m = 0; m < basis_.size(); ++m) {
      const double off = moments_[m] - wanted(target, axis, basis_[m].alpha);
      residuals[basis_[m].degree] += basis_[m].count * off * off;
    }
    for (int k = 1; k <= K; ++k) residuals[k] = std::sqrt(residuals[k]) / factorial(k);
    return residuals;
  }
  /// sum_j |a_ij| r_ij^k / k!, k = 0 to K + 1.
  const Eigen::RowVectorXd& sizes() const { return sizes_; }
  int weights() const { return weights_; }
  int negative() const { return negative_; }

 private:
  void add(double a, const Vector<D>& r) {
    const int K = static_cast<int>(powers_.size()) - 1;
    double size = std::abs(a);
    for (int k = 0; k <= K + 1; ++k) sizes_[k] += size, size *= r.norm() / (k + 1);
    negative_ += a < 0;
    ++weights_;
    powers_[0].fill(1);
    for (int k = 1; k <= K; ++k)
      for (int b = 0; b < D; ++b) powers_[k][b] = powers_[k - 1][b] * r[b];
    for (std::size_t m = 0; m < basis_.size(); ++m) {
      double product = a;
      for (int b = 0; b < D; ++b) product *= powers_[basis_[m].alpha[b]][b];
      moments_[m] += product;
    }
  }

  /// The moment that the output `axis` of a target is to have.
  double wanted(const Target& target, int axis, const std::array<int, D>& alpha) const {
    if (target.order != 1) return target.of(axis, alpha);
    double sum = 0;
    for (int b = 0; b < D; ++b) sum += geometry_.along(axis)[b] * target.of(b, alpha);
    return sum;
  }

  Geometry geometry_;
  std::vector<Monomial<D>> basis_;
  std::vector<double> moments_;
  std::vector<std::array<double, D>> powers_;
  Eigen::RowVectorXd sizes_;
  double sum_ = 0, diagonal_ = 0;
  int entries_ = 0, weights_ = 0, negative_ = 0;
};

/// The entries off the diagonal that can have a weight: points in a skin have none.
int most_weights(const Operator& op, int i) {
  return i < op.rows.neighbours.size() ? op.rows.neighbours[i] : std::numeric_limits<int>::max();
}

template <class Geometry>
RowDiagnosis diagnose(const Scheme& scheme, const Geometry& geometry, const Operator& op,
                      int threads) {
  constexpr int D = Geometry::dimension;
  const int n = static_cast<int>(op.volumes.size()), q = order(scheme.derivative),
            K = std::max(degree(scheme), q) + 2;
  RowDiagnosis rows{DenseVector::Zero(n), DenseVector::Zero(n), DenseMatrix::Zero(n, K + 1),
                    DenseMatrix::Zero(n, K + 2)};
  parallel_chunks(n, 512, threads, [&, row = RowSums(geometry, K)](int begin, int end) mutable {
    for (int i = begin; i < end; ++i) {
      const double dx = std::pow(op.volumes[i], 1.0 / D);
      int negative = 0, weights = 0;
      for (int axis = 0; axis < std::ssize(op.axes); ++axis) {
        row.add_up(op.axes[axis], i);
        rows.residuals.row(i) =
            rows.residuals.row(i).cwiseMax(row.residuals(target(scheme.derivative), axis));
        rows.remainders.row(i) = rows.remainders.row(i).cwiseMax(row.sizes());
        rows.amplification[i] = std::max(rows.amplification[i], std::pow(dx, q) * row.sizes()[0]);
        negative += row.negative();
        weights += std::min(row.weights(), most_weights(op, i));
      }
      rows.negative_share[i] = weights == 0 ? 0 : negative / static_cast<double>(weights);
    }
  });
  return rows;
}

}  // namespace

RowDiagnosis diagnose(const Scheme& scheme, const Cloud& cloud, const Operator& op, int threads) {
  const int n = cloud.size();
  checked_threads(threads);
  if (op.axes.empty() || op.matrix().rows() != n || op.matrix().cols() != n ||
      op.volumes.size() != n)
    throw InvalidInput("the operator is not one of all " + std::to_string(n) + " points");
  if (op.normals.size() > 0) return diagnose(scheme, TangentPlanes(cloud, op.normals), op, threads);
  return dispatch(cloud.dimension(), [&](auto d) {
    return diagnose(scheme, Space<decltype(d)::value>(cloud), op, threads);
  });
}

DenseVector error_bound(const RowDiagnosis& rows, const MatrixView& derivatives) {
  const auto n = rows.remainders.rows(), orders = rows.remainders.cols();
  if ((derivatives.rows() != 1 && derivatives.rows() != n) || derivatives.cols() != orders)
    throw InvalidInput("the bounds of derivatives are " + std::to_string(derivatives.rows()) +
                       " x " + std::to_string(derivatives.cols()) + " numbers for " +
                       std::to_string(n) + " points and orders 0 to " + std::to_string(orders - 1));
  const Eigen::ArrayXXd M = derivatives.array().replicate(derivatives.rows() == n ? 1 : n, 1);
  const Eigen::ArrayXXd kept = M.leftCols(orders - 1) * rows.residuals.array();
  const Eigen::ArrayXXd cut = M * rows.remainders.array();
  Eigen::ArrayXd least = Eigen::ArrayXd::Constant(n, infinity);
  for (auto l = orders - 3; l < orders; ++l)
    least = least.min(kept.leftCols(l).rowwise().sum() + cut.col(l));
  return least;
}

}  // namespace gradpsi
