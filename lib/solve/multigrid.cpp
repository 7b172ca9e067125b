#include "solve/multigrid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "matrix/csr.hpp"
#include "solve/smoother.hpp"

namespace gradpsi {
namespace {

constexpr int chunk = 4096;

template <class F>
void for_each(int n, int threads, const F& f) {
  parallel_chunks(n, chunk, threads, [&f](int begin, int end) {
    for (int i = begin; i < end; ++i) f(i);
  });
}

CycleOptions cycle_options(const LinearSystem& system) {
  return {system.floats, system.options.memory, system.options.threads};
}

std::vector<char> marks(int n, const std::vector<int>& rows) {
  std::vector<char> result(n, false);
  for (const int i : rows) result[i] = true;
  return result;
}

}  // namespace

void Multigrid::prepare(const LinearSystem& system, bool weak_rows) {
  const SystemPoints& points = system.points;
  threads_ = system.options.threads;
  walls_.prepare(system, points.walls);
  Medium medium = medium_of(system.A, points.cloud.volumes(), system.diffusivities,
                            marks(system.size(), points.walls), {}, threads_);
  const double unit = prepare_smoother(system);
  is_kept_ = keep_levels(system, medium);
  if (!is_kept_) {
    unit_ = unit;
    coarse_.clear();
    coarse_.make(
        coarser_levels(points.cloud, medium, marks(system.size(), points.walls), unit_, threads_),
        cycle_options(system));
    without_ = points.walls;
    medium_ = std::move(medium);
  }
  weight_ = unit_ * system.scale;
  if (weak_rows) prepare_weak_rows(system);
}

/// Whether the levels there are serve this medium, too; then they do.
bool Multigrid::keep_levels(const LinearSystem& system, const Medium& medium) {
  if (coarse_.empty() || medium_.masses.size() != system.size() || without_ != system.points.walls)
    return false;
  const Cloud& points = system.points.cloud;
  const std::optional<MediumChange> by = change(medium_, medium, points);
  if (!by) return false;
  coarse_.renew(*by, unit_, cycle_options(system));
  medium_.diffusivities *= by->diffusivity;
  change_masses(*by, points.volumes(), medium_.masses);
  return true;
}

/// Returns the unit in which the mean of volumes times diagonals is 1.
double Multigrid::prepare_smoother(const LinearSystem& system) {
  Smoother rows = smoother(system.A, system.diagonal(), threads_);
  step_ = std::move(rows.step);
  is_weak_ = std::move(rows.is_weak);
  r_.resize(system.size());
  if (walls_)
    for (const int i : system.points.walls) step_[i] = 0;
  const double mean = system.scale.cwiseProduct(rows.diagonal.cwiseAbs()).mean();
  return mean > 0 ? 1 / mean : 1;
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
  if (count > most_weak_rows(system.size())) throw NoHierarchy(words_of_weak_rows(system));
  std::vector<int> rows;
  if (weak_count_ > 0)
    for (const int i : system.points.walls) among[i] = true;
  for (int i = 0; i < system.size(); ++i)
    if (among[i]) rows.push_back(i);
  weak_.prepare(system, std::move(rows));
}

void Multigrid::apply(const LinearSystem& system, const double* r, double* z) {
  const int n = system.size();
  const double *const step = step_.data(), *const weight = weight_.data();
  double* const left = r_.data();
  for_each(n, threads_, [=](int i) { z[i] = step[i] * r[i]; });
  walls_.correct(system, r, z);
  if (!coarse_.empty()) {
    double* const coarse = coarse_.right_hand_side().data();
    for_each_product(system.A, z, threads_,
                     [=](int i, double product) { left[i] = weight[i] * (r[i] - product); });
    for_each_product(coarse_.first().restriction, left, threads_,
                     [=](int i, double sum) { coarse[i] = sum; });
    for_each_product(coarse_.first().interpolation, coarse_.solve().data(), threads_,
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
  std::string result = "multigrid on " + std::to_string(coarse_.size() + 1) + " levels of points";
  if (weak_)
    result +=
        ", " + std::to_string(weak_count_) + " rows of weak diagonals corrected by themselves";
  return result;
}

FactorReport Multigrid::report() const {
  return {.description = description(),
          .entries = coarse_.entries(),
          .bytes = coarse_.bytes() + walls_.bytes() + weak_.bytes() +
                   8.0 * 5 * static_cast<double>(r_.size())};
}

}  // namespace gradpsi
