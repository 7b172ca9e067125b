#include "gradpsi/system.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "diffusion/conditions.hpp"
#include "gradpsi/error.hpp"
#include "matrix/csr.hpp"

namespace gradpsi {
namespace {

/// Some of a row-wise matrix's columns.
struct Part {
  SparseMatrix& matrix;            // where they are to be
  const std::vector<int>& places;  // of columns there; negative: this is none of them
  int columns;
};

/// Parts a matrix in two, whose rows `for_each_entry` tells.
template <class Rows>
void part_columns(const std::array<Part, 2>& parts, int row_count, int threads,
                  const Rows& for_each_entry) {
  constexpr int rows_per_chunk = 2048;
  for (const Part& part : parts) part.matrix.resize(row_count, part.columns);
  parallel_chunks(row_count, rows_per_chunk, threads, [&](int begin, int end) {
    for (int u = begin; u < end; ++u) {
      std::array<int, 2> count = {};
      for_each_entry(u, [&](int j, double) {
        for (int p = 0; p < 2; ++p) count[p] += parts[p].places[j] >= 0;
      });
      for (int p = 0; p < 2; ++p) parts[p].matrix.outerIndexPtr()[u + 1] = count[p];
    }
  });
  for (const Part& part : parts) {
    int* const outer = part.matrix.outerIndexPtr();
    for (int u = 0; u < row_count; ++u) outer[u + 1] += outer[u];
    resize_in_large_pages(part.matrix, outer[row_count]);
  }
  parallel_chunks(row_count, rows_per_chunk, threads, [&](int begin, int end) {
    for (int u = begin; u < end; ++u) {
      std::array<int, 2> at = {parts[0].matrix.outerIndexPtr()[u],
                               parts[1].matrix.outerIndexPtr()[u]};
      for_each_entry(u, [&](int j, double value) {
        for (int p = 0; p < 2; ++p) {
          if (parts[p].places[j] < 0) continue;
          parts[p].matrix.innerIndexPtr()[at[p]] = parts[p].places[j];
          parts[p].matrix.valuePtr()[at[p]++] = value;
        }
      });
    }
  });
}

/// 1/dt
double rate_of(double time_step) { return std::isinf(time_step) ? 0 : 1 / time_step; }

/// The place of each of n points among some of them; -1: none.
std::vector<int> places(const std::vector<int>& points, int n) {
  std::vector<int> place(n, -1);
  for (std::size_t k = 0; k < points.size(); ++k) place[points[k]] = static_cast<int>(k);
  return place;
}

void check_size(const char* name, std::span<const double> values, std::ptrdiff_t wanted) {
  if (std::ssize(values) != wanted)
    throw InvalidInput(std::string(name) + " has " + std::to_string(values.size()) +
                       " entries, not " + std::to_string(wanted));
}

/// Refuses other numbers of values than `wanted` or none, and those that are not finite.
template <class PointOf>
void check_values(const char* name, const VectorView& values, std::ptrdiff_t wanted,
                  const PointOf& point) {
  if (values.size() == 0) return;
  check_size(name, std::span(values.data(), static_cast<std::size_t>(values.size())), wanted);
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (!std::isfinite(values[k]))
      throw InvalidInput(std::string(name) + ": not finite at point " + std::to_string(point(k)));
}

SystemPoints system_points(const Cloud& cloud, const Operator& laplacian,
                           const std::vector<int>& rows) {
  const VectorView& volumes = laplacian.volumes.size() > 0 ? laplacian.volumes : cloud.volumes();
  CloudOptions options{.box = cloud.box()};
  if (volumes.size() > 0) options.volumes = volumes(rows);
  for (const int i : rows) options.numbers.push_back(cloud.number(i));
  return {Cloud(cloud.positions()(rows, Eigen::all), std::move(options)), {}};
}

}  // namespace

/// Where the rows of a system come from.
struct DiffusionSystem::Sources {
  const SparseMatrix& psi;
  const SparseMatrix& walls;      // wall_rows()
  double coefficient;             // theta nu
  std::vector<int> psi_row;       // of each row
  std::vector<int> wall_of = {};  // of each row; -1: none

  /// Calls f(point, value) for the entries of a row, `scale` being what a wall's is multiplied by.
  template <class F>
  void for_each_entry(int row, double scale, const F& f) const {
    const int k = wall_of[row];
    const double factor = k >= 0 ? scale : -coefficient;
    for (SparseMatrix::InnerIterator a(k >= 0 ? walls : psi, k >= 0 ? k : psi_row[row]); a; ++a)
      f(static_cast<int>(a.col()), factor * a.value());
  }
};

DiffusionSystem::DiffusionSystem(const Cloud& cloud, const Operator& laplacian,
                                 const BoundaryConditions& conditions,
                                 const DiffusionOptions& options)
    : fixed_(conditions.fixed),
      time_step_(options.time_step),
      theta_(options.theta),
      point_count_(cloud.size()),
      threads_(options.solver.threads) {
  check(cloud, laplacian);
  check(options, cloud.size());
  check(conditions, cloud);
  const std::vector<int> fixed_place = places(fixed_.points, point_count_);
  const SparseMatrix wall_matrix = wall_rows(conditions.walls, point_count_);
  Sources sources{.psi = laplacian.matrix(),
                  .walls = wall_matrix,
                  .coefficient = options.theta * options.diffusivity,
                  .psi_row = choose_rows(laplacian, fixed_place)};
  const auto count = static_cast<Eigen::Index>(rows_.size());
  evolves_ = DenseVector::Ones(count);
  constant_ = DenseVector::Zero(count);
  if (options.source.size() > 0) constant_ = options.source(rows_);
  known_.resize(static_cast<Eigen::Index>(fixed_.points.size()));
  add_walls(cloud, conditions.walls, sources);
  check_rows(cloud, laplacian, sources);
  fill(sources, fixed_place);
  add_rate(cloud);
  points_ = system_points(cloud, laplacian, rows_);
  for (const WallRow& wall : walls_) points_.walls.push_back(wall.row);
}

/// Sets the points of rows and columns; gives the Laplacian's row of each row.
std::vector<int> DiffusionSystem::choose_rows(const Operator& laplacian,
                                              const std::vector<int>& fixed_place) {
  std::vector<int> psi_row;
  for (int k = 0; k < laplacian.matrix().rows(); ++k) {
    const int i = laplacian.point(k);
    if (fixed_place[i] >= 0) continue;
    rows_.push_back(i);
    psi_row.push_back(k);
  }
  for (int i = 0; i < static_cast<int>(fixed_place.size()); ++i)
    if (fixed_place[i] < 0) columns_.push_back(i);
  return psi_row;
}

/// Says which rows hold a wall condition, and sets their part of the right-hand side.
void DiffusionSystem::add_walls(const Cloud& cloud, const WallConditions& walls, Sources& sources) {
  const std::vector<int> row_place = places(rows_, point_count_);
  sources.wall_of.assign(rows_.size(), -1);
  for (int k = 0; k < sources.walls.rows(); ++k) {
    const int i = walls.points[k], row = row_place[i];
    if (row < 0)
      throw InvalidInput("the Laplacian has no row for the wall condition" + at_point(cloud, i));
    sources.wall_of[row] = k;
    WallRow wall{row, size_of_row(sources.walls, k, cloud, i),
                 std::abs(sources.coefficient * sources.psi.coeff(sources.psi_row[row], i)), 1};
    wall.scale = row_scale(wall, rate_of(time_step_));
    walls_.push_back(wall);
    evolves_[row] = 0;
    constant_[row] = walls.flux.size() > 0 ? wall.scale * walls.flux[k] : 0;
  }
}

/// Refuses rows of the equation that the Laplacian could not compute: their points would keep what they have.
void DiffusionSystem::check_rows(const Cloud& cloud, const Operator& laplacian,
                                 const Sources& sources) const {
  if (laplacian.rows.outcome.empty()) return;
  int zero = 0, first = 0;
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    if (sources.wall_of[row] >= 0 ||
        laplacian.rows.outcome[sources.psi_row[row]] != RowOutcome::Zero)
      continue;
    if (zero++ == 0) first = rows_[row];
  }
  if (zero > 0)
    throw InvalidInput("the Laplacian could not be computed" + at_point(cloud, first) +
                       ", which has no condition either, and whose row is zero (" +
                       std::to_string(zero) + " such points): it would keep its value for ever");
}

/// Fills the matrix, but for 1/dt, and the coupling.
void DiffusionSystem::fill(const Sources& sources, const std::vector<int>& fixed_place) {
  const std::vector<int> column_place = places(columns_, point_count_);
  for (const int i : rows_) diagonal_places_.push_back(column_place[i]);
  // A list's skin holds zeros, which are left out.
  const auto for_each_entry = [&](int row, const auto& f) {
    const int k = sources.wall_of[row], own = rows_[row];
    sources.for_each_entry(row, k >= 0 ? walls_[k].scale : 1, [&](int j, double value) {
      if (value != 0 || j == own) f(j, value);
    });
  };
  part_columns({{{matrix_, column_place, static_cast<int>(columns_.size())},
                 {coupling_, fixed_place, static_cast<int>(fixed_.points.size())}}},
               static_cast<int>(rows_.size()), threads_, for_each_entry);
  coupling_ *= -1;
}

/// Keeps the diagonal where rows evolve, and adds 1/dt to it.
void DiffusionSystem::add_rate(const Cloud& cloud) {
  diagonal_ = DenseVector::Zero(matrix_.rows());
  for (int row = 0; row < matrix_.rows(); ++row) {
    if (evolves_[row] == 0) continue;
    double* const entry = diagonal(matrix_, row);
    if (!entry)
      throw InvalidInput("the Laplacian stores no diagonal" + at_point(cloud, rows_[row]));
    diagonal_[row] = *entry;
    *entry += rate_of(time_step_);
  }
}

/// What a wall's row is multiplied by to be as large as its neighbours', so that residuals and
/// preconditioners see all rows alike; it makes the diagonal positive. A power of 2: nothing is rounded.
double DiffusionSystem::row_scale(const WallRow& wall, double rate) {
  const double wanted = wall.diffusion + rate;
  const double scale =
      std::exp2(std::round(std::log2((wanted > 0 ? wanted : 1) / std::abs(wall.size))));
  return wall.size < 0 ? -scale : scale;
}

/// Null if it is not stored.
double* DiffusionSystem::diagonal(SparseMatrix& matrix, int row) const {
  const int* const begin = matrix.innerIndexPtr() + matrix.outerIndexPtr()[row];
  const int* const end = matrix.innerIndexPtr() + matrix.outerIndexPtr()[row + 1];
  const int* const found = std::lower_bound(begin, end, diagonal_places_[row]);
  if (found == end || *found != diagonal_places_[row]) return nullptr;
  return matrix.valuePtr() + (found - matrix.innerIndexPtr());
}

SparseMatrix DiffusionSystem::take_matrix() {
  SparseMatrix taken;
  taken.swap(matrix_);  // Eigen 3.4 would copy
  return taken;
}

SystemPoints DiffusionSystem::take_points() { return std::exchange(points_, {}); }

/// Calls f(row, b without source or flux).
template <class F>
void DiffusionSystem::for_each_row(std::span<const double> u, std::span<double> b, const F& f) {
  check_size("u", u, point_count_);
  check_size("b", b, std::ssize(rows_));
  const double rate = rate_of(time_step_);
  for (Eigen::Index k = 0; k < known_.size(); ++k)
    known_[k] = fixed_.values.size() > 0 ? fixed_.values[k] : u[fixed_.points[k]];
  for_each_product(coupling_, known_.data(), threads_, [&](int k, double from_known) {
    f(k, from_known + rate * evolves_[k] * u[rows_[k]]);
  });
}

void DiffusionSystem::right_hand_side(std::span<const double> u, std::span<const double> product,
                                      std::span<double> b) {
  if (needs_product()) check_size("the product", product, std::ssize(rows_));
  for_each_row(u, b, [&](int k, double without_source) {
    b[k] = without_source + constant_[k];
    // What theta nu Psi u is at this time, seen from the unknowns' matrix; b has the known part.
    if (theta_ < 1 && evolves_[k] != 0)
      b[k] += (1 - theta_) / theta_ * (without_source - product[k]);
  });
}

void DiffusionSystem::damped_right_hand_side(std::span<const double> u, std::span<double> b) {
  // (I/(theta dt) - nu Psi) v = u/(theta dt) + f, times theta; conditions at walls are as ever.
  for_each_row(u, b, [&](int k, double without_source) {
    b[k] = without_source + (evolves_[k] != 0 ? theta_ : 1) * constant_[k];
  });
}

void DiffusionSystem::set_fixed(std::span<double> u) const {
  check_size("u", u, point_count_);
  for (Eigen::Index k = 0; k < fixed_.values.size(); ++k) u[fixed_.points[k]] = fixed_.values[k];
}

void DiffusionSystem::set_source(const VectorView& source) {
  check_values("source", source, point_count_, [](Eigen::Index i) { return i; });
  for (std::size_t row = 0; row < rows_.size(); ++row)
    if (evolves_[row] != 0) constant_[row] = source.size() > 0 ? source[rows_[row]] : 0;
}

void DiffusionSystem::set_fixed_values(DenseVector values) {
  check_values("fixed values", values, std::ssize(fixed_.points),
               [&](Eigen::Index k) { return fixed_.points[k]; });
  fixed_.values = std::move(values);
}

void DiffusionSystem::set_flux(const VectorView& flux) {
  check_values("flux", flux, std::ssize(walls_),
               [&](Eigen::Index k) { return rows_[walls_[k].row]; });
  for (std::size_t k = 0; k < walls_.size(); ++k)
    constant_[walls_[k].row] = flux.size() > 0 ? walls_[k].scale * flux[k] : 0;
}

void DiffusionSystem::set_time_step(double time_step, SparseMatrix& matrix) {
  check_time_step(time_step, theta_);
  bool ours = matrix.rows() == std::ssize(rows_) && matrix.cols() == std::ssize(columns_);
  for (int row = 0; ours && row < matrix.rows(); ++row)
    ours = evolves_[row] == 0 || diagonal(matrix, row);
  if (!ours) throw InvalidInput("the matrix is not one of this system");
  const double rate = rate_of(time_step);
  for (int row = 0; row < matrix.rows(); ++row)
    if (evolves_[row] > 0) *diagonal(matrix, row) = diagonal_[row] + rate;
  for (WallRow& wall : walls_) {
    const double scale = row_scale(wall, rate), change = scale / wall.scale;
    for (SparseMatrix::InnerIterator a(matrix, wall.row); a; ++a) a.valueRef() *= change;
    for (SparseMatrix::InnerIterator a(coupling_, wall.row); a; ++a) a.valueRef() *= change;
    constant_[wall.row] *= change;
    wall.scale = scale;
  }
  time_step_ = time_step;
}

}  // namespace gradpsi
