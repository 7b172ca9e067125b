#include <Spectra/GenEigsSolver.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "base/dispatch.hpp"
#include "base/median.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/rows.hpp"
#include "gradpsi/spectrum.hpp"
#include "matrix/checks.hpp"
#include "operators/basis.hpp"

namespace gradpsi {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double rounding = std::numeric_limits<double>::epsilon() / 2;

int derivative_order(const Scheme& scheme) {
  return scheme.derivative == Derivative::Gradient ? 1 : 2;
}

double factorial(int k) { return k < 2 ? 1 : k * factorial(k - 1); }

/// Of a monomial of degree k in D dimensions: its factors, and what its moment is to be.
template <int D>
struct Monomial {
  int degree;
  double count;  // of the tensor's entries that are this one, k! / alpha!
  std::array<int, D> alpha;
  /// What the derivative along `axis`, or the Laplacian, makes of it at 0.
  double target(const Scheme& scheme, int axis) const {
    if (degree != derivative_order(scheme)) return 0;
    if (scheme.derivative == Derivative::Gradient) return alpha[axis];
    return 2 * (std::ranges::max(alpha) == 2);
  }
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

template <int D>
RowDiagnosis diagnose(const Scheme& scheme, const Cloud& cloud, const Operator& op) {
  const int n = cloud.size(), q = derivative_order(scheme), K = std::max(degree(scheme), q) + 2;
  RowDiagnosis rows{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n),
                    Eigen::MatrixXd::Zero(n, K + 1), Eigen::MatrixXd::Zero(n, K + 2)};
  const auto basis = monomials<D>(K);
  parallel_chunks(n, 512, 0, [&](int begin, int end) {
    std::vector<double> moments(basis.size());
    std::vector<std::array<double, D>> powers(K + 1);
    for (int i = begin; i < end; ++i) {
      const double dx = std::pow(op.volumes[i], 1.0 / D);
      int negative = 0, weights = 0;
      for (std::size_t axis = 0; axis < op.axes.size(); ++axis) {
        std::ranges::fill(moments, 0);
        double sum = 0, diagonal = 0;
        Eigen::RowVectorXd sizes = Eigen::RowVectorXd::Zero(K + 2);
        int entries = 0;
        for (SparseMatrix::InnerIterator entry(op.axes[axis], i); entry; ++entry, ++entries) {
          const double a = entry.value();
          sum += a;
          if (entry.col() == i) {
            diagonal = std::abs(a);
            continue;
          }
          const Vector<D> r = displacement<D>(cloud, i, static_cast<int>(entry.col()));
          double size = std::abs(a);
          for (int k = 0; k <= K + 1; ++k) sizes[k] += size, size *= r.norm() / (k + 1);
          negative += a < 0;
          ++weights;
          powers[0].fill(1);
          for (int k = 1; k <= K; ++k)
            for (int b = 0; b < D; ++b) powers[k][b] = powers[k - 1][b] * r[b];
          for (std::size_t m = 0; m < basis.size(); ++m) {
            double product = a;
            for (int b = 0; b < D; ++b) product *= powers[basis[m].alpha[b]][b];
            moments[m] += product;
          }
        }
        Eigen::VectorXd residual = Eigen::VectorXd::Zero(K + 1);
        residual[0] = std::abs(sum) + (entries + 1) * rounding * (sizes[0] + diagonal);
        for (std::size_t m = 0; m < basis.size(); ++m) {
          const double off = moments[m] - basis[m].target(scheme, static_cast<int>(axis));
          residual[basis[m].degree] += basis[m].count * off * off;
        }
        for (int k = 1; k <= K; ++k) residual[k] = std::sqrt(residual[k]) / factorial(k);
        rows.residuals.row(i) = rows.residuals.row(i).cwiseMax(residual.transpose());
        rows.remainders.row(i) = rows.remainders.row(i).cwiseMax(sizes);
        rows.amplification[i] = std::max(rows.amplification[i], std::pow(dx, q) * sizes[0]);
      }
      rows.negative_share[i] = weights == 0 ? 0 : negative / static_cast<double>(weights);
    }
  });
  return rows;
}

/// diag(v)^(1/2) A diag(v)^(-1/2), which has the eigenvalues of A.
Eigen::MatrixXd symmetrised(const SparseMatrix& A, const Eigen::VectorXd& volumes) {
  const Eigen::VectorXd root = volumes.cwiseSqrt();
  return root.asDiagonal() * Eigen::MatrixXd(A) * root.cwiseInverse().asDiagonal();
}

/// Of the rows that are not zero.
double median_diagonal(const SparseMatrix& A) {
  Eigen::VectorXd sizes = A.diagonal().cwiseAbs();
  const auto end = std::remove(sizes.begin(), sizes.end(), 0.0);
  if (end == sizes.begin()) return 0;
  return median(sizes.head(end - sizes.begin()));
}

/// Row i and, of those it is connected with over a few steps, the nearest ones, `count` in all.
std::vector<int> nearest_in_matrix(const Cloud& cloud, const SparseMatrix& A,
                                   const std::vector<int>& points, int i, int count) {
  std::vector<int> found = {i};
  std::set<int> seen = {i};
  for (std::size_t k = 0; k < found.size() && std::ssize(found) < 3 * count; ++k)
    for (SparseMatrix::InnerIterator a(A, found[k]); a; ++a)
      if (seen.insert(static_cast<int>(a.col())).second) found.push_back(static_cast<int>(a.col()));
  const auto distance = [&](int j) {
    return dispatch(cloud.dimension(), [&](auto d) {
      return displacement<decltype(d)::value>(cloud, points[i], points[j]).norm();
    });
  };
  std::ranges::stable_sort(found, {}, distance);
  found.resize(std::min<std::size_t>(found.size(), count));
  std::ranges::sort(found);
  return found;
}

/// x -> A x - shift x, as Spectra calls it.
struct Shifted {
  using Scalar = double;
  Eigen::Index rows() const { return A.rows(); }
  Eigen::Index cols() const { return A.cols(); }
  void perform_op(const double* x, double* y) const {
    const Eigen::Map<const Eigen::VectorXd> in(x, A.cols());
    Eigen::Map<Eigen::VectorXd> out(y, A.rows());
    out.noalias() = A * in;
    out -= shift * in;
  }
  const SparseMatrix& A;
  double shift;
};

/// An outermost eigenvalue. Convergence is judged relative to the eigenvalue, so the origin is shifted to the
/// other end of the spectrum: one near zero need not have as many digits as the matrix is large.
std::complex<double> outermost(const SparseMatrix& A, Spectra::SortRule rule, double shift) {
  constexpr int wanted = 1, subspace = 60, restarts = 1000;
  constexpr double tolerance = 1e-7;
  Shifted shifted{A, shift};
  Spectra::GenEigsSolver<Shifted> solver(shifted, wanted, subspace);
  solver.init();
  solver.compute(rule, restarts, tolerance);
  if (solver.info() != Spectra::CompInfo::Successful)
    throw SolverError("the outermost eigenvalues did not converge in " + std::to_string(restarts) +
                      " restarts of the Arnoldi iteration");
  return solver.eigenvalues()[0] + shift;
}

}  // namespace

RowDiagnosis diagnose(const Scheme& scheme, const Cloud& cloud, const Operator& op) {
  const int n = cloud.size();
  if (op.axes.empty() || op.matrix().rows() != n || op.matrix().cols() != n ||
      op.volumes.size() != n)
    throw InvalidInput("the operator is not one of all " + std::to_string(n) + " points");
  return dispatch(cloud.dimension(),
                  [&](auto d) { return diagnose<decltype(d)::value>(scheme, cloud, op); });
}

Eigen::VectorXd error_bound(const RowDiagnosis& rows, const Eigen::MatrixXd& derivatives) {
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

MatrixSummary summarise(const SparseMatrix& laplacian, const Eigen::VectorXd& volumes) {
  const int n = static_cast<int>(laplacian.rows());
  if (laplacian.cols() != n || volumes.size() != n)
    throw InvalidInput("a matrix of " + std::to_string(n) + " rows, " +
                       std::to_string(laplacian.cols()) + " columns and " +
                       std::to_string(volumes.size()) + " volumes");
  MatrixSummary result{.symmetric = is_symmetric(laplacian, volumes),
                       .dominant = is_dominant(-laplacian)};
  bool negative = false;
  for (int i = 0; i < n; ++i) {
    double diagonal = 0, radius = 0;
    for (SparseMatrix::InnerIterator a(laplacian, i); a; ++a) {
      const int j = static_cast<int>(a.col());
      result.bandwidth = std::max(result.bandwidth, std::abs(i - j));
      if (i == j) {
        diagonal = a.value();
      } else {
        radius += std::abs(a.value());
        negative |= a.value() < 0;
      }
    }
    result.leftmost = std::min(result.leftmost, diagonal - radius);
    result.rightmost = std::max(result.rightmost, diagonal + radius);
  }
  result.m_matrix = result.dominant && !negative;
  if (result.m_matrix) result.rightmost = 0;  // but for rounding
  return result;
}

SparseMatrix principal_part(const SparseMatrix& A, const std::vector<int>& points) {
  std::vector<int> place(A.cols(), -1);
  for (int k = 0; k < static_cast<int>(points.size()); ++k) {
    if (points[k] < 0 || points[k] >= std::min(A.rows(), A.cols()) ||
        (k > 0 && points[k] <= points[k - 1]))
      throw InvalidInput("point " + std::to_string(points[k]) + " is not one of " +
                         std::to_string(A.rows()) + ", or not above the one before it");
    place[points[k]] = k;
  }
  const auto m = std::ssize(points);
  SparseMatrix part(m, m);
  for (int k = 0; k < m; ++k) {
    part.startVec(k);
    for (SparseMatrix::InnerIterator a(A, points[k]); a; ++a)
      if (place[a.col()] >= 0) part.insertBack(k, place[a.col()]) = a.value();
  }
  part.finalize();
  return part;
}

Forecast forecast(const Cloud& cloud, const SparseMatrix& laplacian, const std::vector<int>& points,
                  const Eigen::VectorXd& volumes) {
  if (laplacian.rows() != cloud.size() || laplacian.cols() != cloud.size() ||
      volumes.size() != cloud.size())
    throw InvalidInput("the matrix is not one of all " + std::to_string(cloud.size()) + " points");
  const SparseMatrix A = principal_part(laplacian, points);
  if (is_dominant(-A)) return {.certain = true};

  constexpr int looked_at = 9, block = 30;
  const int n = static_cast<int>(A.rows());
  std::vector<std::pair<double, int>> discs(n);  // minus the right end, row
  for (int i = 0; i < n; ++i) {
    discs[i] = {0, i};
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      discs[i].first -= a.col() == i ? a.value() : std::abs(a.value());
  }
  const auto rows = std::min(n, looked_at);
  std::partial_sort(discs.begin(), discs.begin() + rows, discs.end());
  Forecast result;
  for (int k = 0; k < rows; ++k) {
    const int i = discs[k].second;
    const auto near = nearest_in_matrix(cloud, A, points, i, block);
    const double rate =
        Eigen::EigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd(principal_part(A, near)), false)
            .eigenvalues()
            .real()
            .maxCoeff();
    if (k == 0 || rate > result.rate) result.rate = rate, result.point = points[i];
  }
  result.grows = result.rate > slow_growth * median_diagonal(A);
  result.certain = result.grows && is_symmetric(A, volumes(points));
  if (!result.grows) result.point = -1;
  return result;
}

double Spectrum::rightmost() const { return values.size() > 0 ? values.real().maxCoeff() : 0; }
double Spectrum::leftmost() const { return values.size() > 0 ? values.real().minCoeff() : 0; }
double Spectrum::widest() const { return values.size() > 0 ? values.imag().maxCoeff() : 0; }

Spectrum spectrum(const SparseMatrix& A, const Eigen::VectorXd& volumes, int complete_below) {
  const int n = static_cast<int>(A.rows());
  if (A.cols() != n || (volumes.size() != 0 && volumes.size() != n))
    throw InvalidInput("a matrix of " + std::to_string(n) + " rows, " + std::to_string(A.cols()) +
                       " columns and " + std::to_string(volumes.size()) + " volumes");
  Spectrum result;
  if (n == 0) return result;
  result.zero = slow_growth * median_diagonal(A);
  if (n <= std::max(complete_below, 100)) {
    if (volumes.size() > 0 && is_symmetric(A, volumes)) {
      const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetrised(A, volumes),
                                                                  Eigen::EigenvaluesOnly);
      result.values = solver.eigenvalues().cast<std::complex<double>>();
    } else {
      const Eigen::EigenSolver<Eigen::MatrixXd> solver(Eigen::MatrixXd(A), false);
      if (solver.info() != Eigen::Success) throw SolverError("the eigenvalues did not converge");
      result.values = solver.eigenvalues();
    }
  } else {
    result.complete = false;
    const MatrixSummary bounds = summarise(A, Eigen::VectorXd::Ones(n));
    result.values.resize(2);
    result.values[0] = outermost(A, Spectra::SortRule::LargestReal, bounds.leftmost);
    result.values[1] = outermost(A, Spectra::SortRule::SmallestReal, bounds.rightmost);
  }
  return result;
}

double largest_stable_step(const Spectrum& spectrum, Stepper stepper) {
  const auto amplifies = [&](std::complex<double> z) {
    if (stepper == Stepper::Euler) return std::norm(1.0 + z) > 1;
    return std::norm(1.0 + z * (1.0 + z / 2.0 * (1.0 + z / 3.0 * (1.0 + z / 4.0)))) > 1 + 1e-13;
  };
  double step = infinity;
  for (const std::complex<double>& lambda : spectrum.values) {
    const double size = std::abs(lambda);
    if (size <= spectrum.zero) continue;
    if (lambda.real() > spectrum.zero) return 0;
    // Along the ray of lambda the region of stability ends before |z| = 3.
    const auto direction = lambda / size;
    constexpr int steps = 300;
    double inside = 0, outside = 3;
    for (int k = 1; k <= steps; ++k) {
      const double z = 3.0 * k / steps;
      if (amplifies(z * direction)) {
        outside = z;
        break;
      }
      inside = z;
    }
    for (int halvings = 0; halvings < 50; ++halvings) {
      const double middle = (inside + outside) / 2;
      (amplifies(middle * direction) ? outside : inside) = middle;
    }
    step = std::min(step, inside / size);
  }
  return step;
}

std::vector<double> singular_steps(const Spectrum& spectrum) {
  std::vector<double> steps;
  for (const std::complex<double>& lambda : spectrum.values)
    if (lambda.real() > spectrum.zero && std::abs(lambda.imag()) <= 1e-10 * std::abs(lambda))
      steps.push_back(1 / lambda.real());
  std::ranges::sort(steps);
  const auto same = [](double a, double b) { return b - a <= 1e-9 * b; };
  steps.erase(std::unique(steps.begin(), steps.end(), same), steps.end());
  return steps;
}

}  // namespace gradpsi
