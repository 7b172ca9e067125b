#include "solve/coarse_cycle.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/parallel.hpp"
#include "matrix/csr.hpp"

namespace gradpsi {
namespace {

constexpr int power_steps = 6;
constexpr int chunk = 4096;

template <class F>
void for_each(int n, int threads, const F& f) {
  parallel_chunks(n, chunk, threads, [&f](int begin, int end) {
    for (int i = begin; i < end; ++i) f(i);
  });
}

/// The largest eigenvalue of the matrix over its diagonal, by steps of the power method.
double largest_eigenvalue(const SingleSparseMatrix& S, const DenseVector& inverse, int threads) {
  const int n = static_cast<int>(S.rows());
  DenseVector x(n), y(n);
  for (int i = 0; i < n; ++i) x[i] = std::sin(1.0 + 12.9898 * i);  // rough, and always the same
  double largest = 0;
  for (int step = 0; step < power_steps; ++step) {
    x.normalize();
    for_each_product(S, x.data(), threads,
                     [&](int i, double product) { y[i] = inverse[i] * product; });
    largest = y.norm();
    x.swap(y);
  }
  return largest;
}

/// In double precision, columns ascending.
SparseMatrix sorted(const SingleSparseMatrix& S, double more_diagonal) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < S.rows(); ++i)
    for (SingleSparseMatrix::InnerIterator a(S, i); a; ++a)
      entries.emplace_back(i, a.col(), a.col() == i ? a.value() * (1 + more_diagonal) : a.value());
  SparseMatrix result(S.rows(), S.cols());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

double bytes_of(const SingleSparseMatrix& A) { return 8.0 * A.nonZeros() + 4.0 * A.outerSize(); }

}  // namespace

// Here, where what they need of a factor is to be seen.
CoarseCycle::CoarseCycle() = default;
CoarseCycle::~CoarseCycle() = default;

void CoarseCycle::make(std::vector<CoarseLevel> levels, const CycleOptions& options) {
  options_ = options;
  levels_.clear();
  for (CoarseLevel& level : levels) levels_.push_back({std::move(level)});
  for (Level& level : levels_) {
    const auto n = level.matrix.rows();
    for (DenseVector* vector : {&level.b, &level.x, &level.r}) vector->setZero(n);
    level.damping = 1;
    set_steps(level);
    level.damping =
        4 / (3 * std::max(largest_eigenvalue(level.matrix, level.step, options.threads), 1e-6));
    level.step *= level.damping;
  }
  bottom_.reset();
  factorise_bottom();
}

void CoarseCycle::renew(const MediumChange& change, double scale, const CycleOptions& options) {
  options_ = options;
  for (Level& level : levels_) {
    gradpsi::renew(level, change, scale);
    set_steps(level);
  }
  factorise_bottom();
}

void CoarseCycle::set_steps(Level& level) {
  const SingleSparseMatrix& S = level.matrix;
  level.step.resize(S.rows());
  for (int i = 0; i < S.rows(); ++i) {
    double diagonal = 0;
    for (SingleSparseMatrix::InnerIterator a(S, i); a; ++a)
      if (a.col() == i) diagonal = a.value();
    level.step[i] = diagonal > 0 ? level.damping / diagonal : 0;
  }
}

void CoarseCycle::factorise_bottom() {
  if (levels_.empty()) return;
  constexpr double little =
      1e-7;  // on the diagonal, so that constants in the null space are no obstacle
  const SparseMatrix S = sorted(levels_.back().matrix, little);
  if (!(S.diagonal().minCoeff() > 0)) return bottom_.reset();
  try {
    if (!bottom_)
      bottom_.emplace(S, DenseVector::Ones(S.rows()), Elimination{}, options_.memory,
                      options_.threads);
    if (!bottom_->factorise(S)) bottom_.reset();
  } catch (const FactorTooLarge&) {
    bottom_.reset();
  }
}

/// x = about S^-1 b on level l.
void CoarseCycle::solve_level(std::size_t l, bool start_at_zero) {
  Level& level = levels_[l];
  double *const b = level.b.data(), *const x = level.x.data(), *const r = level.r.data();
  const double* const step = level.step.data();
  const int n = static_cast<int>(level.b.size());
  if (l + 1 == levels_.size() && bottom_) {
    if (options_.floats) level.b.array() -= level.b.mean();
    return bottom_->solve(b, x, 1);
  }
  const auto smooth = [=](int i, double product) { r[i] = x[i] + step[i] * (b[i] - product); };
  if (start_at_zero) {
    for_each(n, options_.threads, [=](int i) { x[i] = step[i] * b[i]; });
  } else {
    for_each_product(level.matrix, x, options_.threads, smooth);
    level.x = level.r;
  }
  if (l + 1 < levels_.size()) {
    Level& below = levels_[l + 1];
    double* const coarse = below.b.data();
    for_each_product(level.matrix, x, options_.threads,
                     [=](int i, double product) { r[i] = b[i] - product; });
    for_each_product(below.restriction, r, options_.threads,
                     [=](int i, double sum) { coarse[i] = sum; });
    solve_level(l + 1, true);
    if (l + 2 < levels_.size()) solve_level(l + 1, false);
    for_each_product(below.interpolation, below.x.data(), options_.threads,
                     [=](int i, double value) { x[i] += value; });
  }
  for_each_product(level.matrix, x, options_.threads, smooth);
  level.x.swap(level.r);
}

const DenseVector& CoarseCycle::solve() {
  solve_level(0, true);
  if (levels_.size() > 1) solve_level(0, false);
  return levels_.front().x;
}

double CoarseCycle::entries() const {
  double sum = 0;
  for (const Level& level : levels_) sum += static_cast<double>(level.matrix.nonZeros());
  return sum;
}

double CoarseCycle::bytes() const {
  double sum = bottom_ ? bottom_->report().bytes : 0;
  for (const Level& level : levels_)
    sum += bytes_of(level.interpolation) + bytes_of(level.restriction) + bytes_of(level.matrix) +
           8.0 * 6 * static_cast<double>(level.b.size());
  return sum;
}

}  // namespace gradpsi
