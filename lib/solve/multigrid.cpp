#include "solve/multigrid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "matrix/csr.hpp"

namespace gradpsi {
namespace {

constexpr double damping = 0.9;   // of Jacobi's method on the finest level
constexpr double weakest = 0.45;  // of a row's magnitudes, that its diagonal counts as at least
constexpr double weak = 0.3;  // of them, less than which makes a row one that cannot be smoothed
constexpr int most_together = 2'000;  // rows that a factor may have, or a tenth of all
constexpr int power_steps = 6;
constexpr int chunk = 4096;

template <class F>
void for_each(int n, int threads, const F& f) {
  parallel_chunks(n, chunk, threads, [&f](int begin, int end) {
    for (int i = begin; i < end; ++i) f(i);
  });
}

std::vector<char> marks(int n, const std::vector<int>& rows) {
  std::vector<char> result(n, false);
  for (const int i : rows) result[i] = true;
  return result;
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

void Multigrid::prepare(const LinearSystem& system, bool weak_rows) {
  const SystemPoints& points = system.points;
  threads_ = system.options.threads;
  floats_ = system.floats;
  walls_.prepare(system, points.walls);
  Medium medium = medium_of(system.A, points.cloud, system.diffusivities,
                            marks(system.size(), points.walls), threads_);
  const double unit = prepare_smoother(system);
  is_kept_ = keep_levels(system, medium);
  if (!is_kept_) {
    unit_ = unit;
    make_levels(system, medium);
    medium_ = std::move(medium);
  }
  weight_ = unit_ * system.scale;
  factorise_bottom(system);
  if (weak_rows) prepare_weak_rows(system);
}

void Multigrid::make_levels(const LinearSystem& system, const Medium& medium) {
  const SystemPoints& points = system.points;
  levels_.clear();
  for (CoarseLevel& level :
       coarser_levels(points.cloud, medium, marks(system.size(), points.walls), unit_, threads_))
    levels_.push_back({std::move(level)});
  without_ = points.walls;
  for (Level& level : levels_) {
    const auto n = level.matrix.rows();
    for (DenseVector* vector : {&level.b, &level.x, &level.r}) vector->setZero(n);
    level.damping = 1;
    set_steps(level);
    level.damping =
        4 / (3 * std::max(largest_eigenvalue(level.matrix, level.step, threads_), 1e-6));
    level.step *= level.damping;
  }
}

/// Whether the levels there are serve this medium, too; then they do.
bool Multigrid::keep_levels(const LinearSystem& system, const Medium& medium) {
  if (levels_.empty() || medium_.masses.size() != system.size() || without_ != system.points.walls)
    return false;
  const Cloud& points = system.points.cloud;
  const std::optional<MediumChange> by = change(medium_, medium, points);
  if (!by) return false;
  for (Level& level : levels_) {
    renew(level, *by, unit_);
    set_steps(level);
  }
  medium_.diffusivities *= by->diffusivity;
  change_masses(*by, points.volumes(), medium_.masses);
  return true;
}

/// Returns the unit in which the mean of volumes times diagonals is 1.
double Multigrid::prepare_smoother(const LinearSystem& system) {
  const int n = system.size();
  for (DenseVector* vector : {&step_, &weight_, &r_}) vector->resize(n);
  is_weak_.assign(n, false);
  for_each(n, threads_, [&](int i) {
    double diagonal = 0, size = 0;
    for (SparseMatrix::InnerIterator a(system.A, i); a; ++a) {
      size += std::abs(a.value());
      if (a.col() == i) diagonal = a.value();
    }
    is_weak_[i] = diagonal < weak * size;
    weight_[i] = system.scale[i] * std::abs(diagonal);
    step_[i] = damping / (std::abs(diagonal) < weakest * size ? weakest * size : diagonal);
  });
  if (walls_)
    for (const int i : system.points.walls) step_[i] = 0;
  const double mean = weight_.mean();
  return mean > 0 ? 1 / mean : 1;
}

void Multigrid::set_steps(Level& level) {
  const SingleSparseMatrix& S = level.matrix;
  level.step.resize(S.rows());
  for (int i = 0; i < S.rows(); ++i) {
    double diagonal = 0;
    for (SingleSparseMatrix::InnerIterator a(S, i); a; ++a)
      if (a.col() == i) diagonal = a.value();
    level.step[i] = diagonal > 0 ? level.damping / diagonal : 0;
  }
}

void Multigrid::factorise_bottom(const LinearSystem& system) {
  if (!is_kept_) bottom_.reset();
  if (levels_.empty()) return;
  constexpr double little =
      1e-7;  // on the diagonal, so that constants in the null space are no obstacle
  const SparseMatrix S = sorted(levels_.back().matrix, little);
  if (!(S.diagonal().minCoeff() > 0)) return bottom_.reset();
  try {
    if (!bottom_)
      bottom_.emplace(S, DenseVector::Ones(S.rows()), Elimination{}, system.options.memory,
                      threads_);
    if (!bottom_->factorise(S)) bottom_.reset();
  } catch (const FactorTooLarge&) {
    bottom_.reset();
  }
}

/// "the diagonals of .. rows are weak .., those of point .. "
std::string Multigrid::words_of_weak_rows(const LinearSystem& system) const {
  constexpr int told = 3;
  std::string which;
  int tells = 0;
  for (int i = 0; i < system.size() && tells < told; ++i)
    if (is_weak_[i]) which += (tells++ == 0 ? " " : ", ") + system.row(i);
  return "the diagonals of " + std::to_string(weak_count_) + " of " +
         std::to_string(system.size()) + " rows are weak, a_ii < 0.3 sum |a_ij|, those of" + which +
         (weak_count_ > tells ? ", .." : "") + ": the support is too small there";
}

void Multigrid::prepare_weak_rows(const LinearSystem& system) {
  weak_count_ = static_cast<int>(std::ranges::count(is_weak_, true));
  std::vector<char> among = is_weak_;
  for (int i = 0; i < system.size(); ++i)
    if (is_weak_[i])
      for (SparseMatrix::InnerIterator a(system.A, i); a; ++a) among[a.col()] = true;
  const auto count = std::ranges::count(among, true);
  if (count > std::max<std::int64_t>(most_together, system.size() / 10))
    throw NoHierarchy(words_of_weak_rows(system));
  std::vector<int> rows;
  if (weak_count_ > 0)
    for (const int i : system.points.walls) among[i] = true;
  for (int i = 0; i < system.size(); ++i)
    if (among[i]) rows.push_back(i);
  weak_.prepare(system, std::move(rows));
}

/// x = about S^-1 b on level l.
void Multigrid::solve_level(std::size_t l, bool start_at_zero) {
  Level& level = levels_[l];
  double *const b = level.b.data(), *const x = level.x.data(), *const r = level.r.data();
  const double* const step = level.step.data();
  const int n = static_cast<int>(level.b.size());
  if (l + 1 == levels_.size() && bottom_) {
    if (floats_) level.b.array() -= level.b.mean();
    return bottom_->solve(b, x, 1);
  }
  const auto smooth = [=](int i, double product) { r[i] = x[i] + step[i] * (b[i] - product); };
  if (start_at_zero) {
    for_each(n, threads_, [=](int i) { x[i] = step[i] * b[i]; });
  } else {
    for_each_product(level.matrix, x, threads_, smooth);
    level.x = level.r;
  }
  if (l + 1 < levels_.size()) {
    Level& below = levels_[l + 1];
    double* const coarse = below.b.data();
    for_each_product(level.matrix, x, threads_,
                     [=](int i, double product) { r[i] = b[i] - product; });
    for_each_product(below.restriction, r, threads_, [=](int i, double sum) { coarse[i] = sum; });
    solve_level(l + 1, true);
    if (l + 2 < levels_.size()) solve_level(l + 1, false);
    for_each_product(below.interpolation, below.x.data(), threads_,
                     [=](int i, double value) { x[i] += value; });
  }
  for_each_product(level.matrix, x, threads_, smooth);
  level.x.swap(level.r);
}

void Multigrid::apply(const LinearSystem& system, const double* r, double* z) {
  const int n = system.size();
  const double *const step = step_.data(), *const weight = weight_.data();
  double* const left = r_.data();
  for_each(n, threads_, [=](int i) { z[i] = step[i] * r[i]; });
  walls_.correct(system, r, z);
  if (!levels_.empty()) {
    Level& below = levels_.front();
    double* const coarse = below.b.data();
    for_each_product(system.A, z, threads_,
                     [=](int i, double product) { left[i] = weight[i] * (r[i] - product); });
    for_each_product(below.restriction, left, threads_,
                     [=](int i, double sum) { coarse[i] = sum; });
    solve_level(0, true);
    if (levels_.size() > 1) solve_level(0, false);
    for_each_product(below.interpolation, below.x.data(), threads_,
                     [=](int i, double value) { z[i] += value; });
    walls_.correct(system, r, z);
  }
  for_each_product(system.A, z, threads_,
                   [=](int i, double product) { left[i] = step[i] * (r[i] - product); });
  for_each(n, threads_, [=](int i) { z[i] += left[i]; });
  walls_.correct(system, r, z);
  weak_.correct(system, r, z);
}

std::string Multigrid::description() const {
  std::string result = "multigrid on " + std::to_string(levels_.size() + 1) + " levels of points";
  if (weak_)
    result +=
        ", " + std::to_string(weak_count_) + " rows of weak diagonals corrected by themselves";
  return result;
}

FactorReport Multigrid::report() const {
  FactorReport result{.description = description()};
  result.bytes = walls_.bytes() + weak_.bytes() + (bottom_ ? bottom_->report().bytes : 0) +
                 8.0 * 5 * static_cast<double>(r_.size());
  for (const Level& level : levels_) {
    result.entries += static_cast<double>(level.matrix.nonZeros());
    result.bytes += bytes_of(level.interpolation) + bytes_of(level.restriction) +
                    bytes_of(level.matrix) + 8.0 * 6 * static_cast<double>(level.b.size());
  }
  return result;
}

}  // namespace gradpsi
