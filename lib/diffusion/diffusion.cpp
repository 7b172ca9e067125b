#include "gradpsi/diffusion.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "base/resize.hpp"
#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "matrix/csr.hpp"

namespace gradpsi {

namespace {

std::string at_point(const Cloud& cloud, int i) {
  return " at point " + std::to_string(cloud.number(i));
}

/// Throws unless `values` has one finite number for each of `count` points, or none at all.
void check_values(const Eigen::VectorXd& values, std::size_t count, const std::string& what) {
  if (values.size() == 0) return;
  if (static_cast<std::size_t>(values.size()) != count)
    throw InvalidInput(what + " has " + std::to_string(values.size()) + " entries for " +
                       std::to_string(count) + " points");
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (!std::isfinite(values[k]))
      throw InvalidInput("entry " + std::to_string(k) + " of " + what + " is not finite");
}

void check_time_step(double time_step, double theta) {
  if (!(time_step > 0))
    throw InvalidInput("time_step must be > 0 (infinity: steady), not " + shortest(time_step));
  if (std::isinf(time_step) && theta != 1)
    throw InvalidInput("the steady problem needs theta = 1, not " + shortest(theta));
}

void check(const DiffusionOptions& options, int points) {
  if (!(options.diffusivity >= 0 && std::isfinite(options.diffusivity)))
    throw InvalidInput("diffusivity must be >= 0 and finite, not " + shortest(options.diffusivity));
  if (!(options.theta >= 0.5 && options.theta <= 1))
    throw InvalidInput("theta must be 0.5 to 1, not " + shortest(options.theta));
  check_time_step(options.time_step, options.theta);
  check_values(options.source, points, "the source");
}

void check(const Cloud& cloud, const Operator& laplacian) {
  if (laplacian.axes.size() != 1)
    throw InvalidInput("diffusion needs a Laplacian, one matrix, not " +
                       std::to_string(laplacian.axes.size()));
  const SparseMatrix& psi = laplacian.matrix();
  const std::vector<int>& points = laplacian.points;
  if (psi.rows() != (points.empty() ? cloud.size() : std::ssize(points)) ||
      psi.cols() != cloud.size())
    throw InvalidInput("the Laplacian is " + std::to_string(psi.rows()) + " x " +
                       std::to_string(psi.cols()) + " for " + std::to_string(cloud.size()) +
                       " points");
  if (laplacian.volumes.size() != 0 && laplacian.volumes.size() != cloud.size())
    throw InvalidInput("the Laplacian has " + std::to_string(laplacian.volumes.size()) +
                       " volumes for " + std::to_string(cloud.size()) + " points");
}

/// Throws unless these are points of the cloud that have no condition yet; marks them.
void claim(const Cloud& cloud, const std::vector<int>& points, std::vector<char>& taken) {
  for (const int i : points) {
    if (i < 0 || i >= static_cast<int>(taken.size()))
      throw InvalidInput("there is no point " + std::to_string(i) + " among " +
                         std::to_string(taken.size()) + " to have a condition");
    if (std::exchange(taken[i], true))
      throw InvalidInput("point " + std::to_string(cloud.number(i)) + " has two conditions");
  }
}

void check(const BoundaryConditions& conditions, const Cloud& cloud) {
  std::vector<char> taken(cloud.size(), false);
  claim(cloud, conditions.fixed.points, taken);
  claim(cloud, conditions.walls.points, taken);
  check_values(conditions.fixed.values, conditions.fixed.points.size(), "fixed.values");

  const WallConditions& walls = conditions.walls;
  const auto count = static_cast<Eigen::Index>(walls.points.size());
  check_values(walls.flux, walls.points.size(), "walls.flux");
  check_values(walls.transfer, walls.points.size(), "walls.transfer");
  if (count == 0) return;
  if (walls.normals.rows() != count || walls.normals.cols() != cloud.dimension())
    throw InvalidInput("walls.normals is " + std::to_string(walls.normals.rows()) + " x " +
                       std::to_string(walls.normals.cols()) + " for " + std::to_string(count) +
                       " points in " + std::to_string(cloud.dimension()) + " dimensions");
  if (static_cast<int>(walls.gradient.size()) != cloud.dimension())
    throw InvalidInput("walls.gradient has " + std::to_string(walls.gradient.size()) +
                       " matrices in " + std::to_string(cloud.dimension()) + " dimensions");
  for (const SparseMatrix& G : walls.gradient)
    if (G.rows() != count || G.cols() != cloud.size())
      throw InvalidInput("walls.gradient is " + std::to_string(G.rows()) + " x " +
                         std::to_string(G.cols()) + " for " + std::to_string(count) + " of " +
                         std::to_string(cloud.size()) + " points");
  for (Eigen::Index k = 0; k < count; ++k) {
    if (!walls.normals.row(k).allFinite() || walls.normals.row(k).isZero(0))
      throw InvalidInput("the normal" + at_point(cloud, walls.points[k]) +
                         " is zero or not finite");
    if (walls.transfer.size() > 0 && walls.transfer[k] < 0)
      throw InvalidInput("the transfer coefficient" + at_point(cloud, walls.points[k]) +
                         " must be >= 0, not " + shortest(walls.transfer[k]));
  }
}

/// Rows transfer u + n . grad u of the wall points: as many x n.
SparseMatrix wall_rows(const WallConditions& walls, int points) {
  const auto count = static_cast<Eigen::Index>(walls.points.size());
  SparseMatrix rows(count, points);
  for (std::size_t a = 0; a < walls.gradient.size() && count > 0; ++a)
    rows += walls.normals.col(static_cast<Eigen::Index>(a)).asDiagonal() * walls.gradient[a];
  if (walls.transfer.size() > 0) {
    SparseMatrix transfer(count, points);
    for (Eigen::Index k = 0; k < count; ++k)
      transfer.insert(k, walls.points[k]) = walls.transfer[k];
    rows += transfer;
  }
  return rows;
}

/// Those of a row-wise matrix's columns whose place is not negative, at their place.
template <class Rows>
void choose_columns(SparseMatrix& matrix, int row_count, int column_count,
                    const std::vector<int>& places, const Rows& for_each_entry) {
  matrix.resize(row_count, column_count);
  int* const outer = matrix.outerIndexPtr();
  for (int u = 0; u < row_count; ++u) {
    outer[u + 1] = outer[u];
    for_each_entry(u, [&](int j, double) { outer[u + 1] += places[j] >= 0; });
  }
  resize_in_large_pages(matrix, outer[row_count]);
  for (int u = 0; u < row_count; ++u) {
    int at = outer[u];
    for_each_entry(u, [&](int j, double value) {
      if (places[j] < 0) return;
      matrix.innerIndexPtr()[at] = places[j];
      matrix.valuePtr()[at++] = value;
    });
  }
}

/// The largest entry of a wall's row, with the sign of its diagonal.
double size_of_row(const SparseMatrix& rows, int k, const Cloud& cloud, int point) {
  double largest = 0, diagonal = 0;
  for (SparseMatrix::InnerIterator a(rows, k); a; ++a) {
    largest = std::max(largest, std::abs(a.value()));
    if (a.col() == point) diagonal = a.value();
  }
  if (!(largest > 0 && std::isfinite(largest)))
    throw InvalidInput("the wall condition" + at_point(cloud, point) +
                       " has a gradient row that is zero or not finite");
  return diagonal < 0 ? -largest : largest;
}

/// 1/dt
double rate_of(double time_step) { return std::isinf(time_step) ? 0 : 1 / time_step; }

/// The place of each of n points among some of them; -1: none.
std::vector<int> places(const std::vector<int>& points, int n) {
  std::vector<int> place(n, -1);
  for (std::size_t k = 0; k < points.size(); ++k) place[points[k]] = static_cast<int>(k);
  return place;
}

SystemPoints system_points(const Cloud& cloud, const Operator& laplacian,
                           const std::vector<int>& rows) {
  const Eigen::VectorXd& volumes =
      laplacian.volumes.size() > 0 ? laplacian.volumes : cloud.volumes();
  CloudOptions options{.box = cloud.box()};
  if (volumes.size() > 0) options.volumes = volumes(rows);
  for (const int i : rows) options.numbers.push_back(cloud.number(i));
  return {Cloud(cloud.positions()(rows, Eigen::all), std::move(options)), {}};
}

}  // namespace

Operator with_conductivity(Operator laplacian, const Eigen::VectorXd& conductivity, Mean mean) {
  if (laplacian.axes.size() != 1)
    throw InvalidInput("a conductivity goes with a Laplacian, one matrix, not " +
                       std::to_string(laplacian.axes.size()));
  SparseMatrix& psi = laplacian.axes.front();
  if (conductivity.size() != psi.cols() || (laplacian.points.empty() && psi.rows() != psi.cols()))
    throw InvalidInput("there are " + std::to_string(conductivity.size()) +
                       " conductivities for a Laplacian of " + std::to_string(psi.rows()) + " x " +
                       std::to_string(psi.cols()));
  for (Eigen::Index i = 0; i < conductivity.size(); ++i)
    if (!(conductivity[i] > 0 && std::isfinite(conductivity[i])))
      throw InvalidInput("the conductivity at point " + std::to_string(i) +
                         " must be > 0 and finite, not " + shortest(conductivity[i]));
  for (int k = 0; k < psi.rows(); ++k) {
    const int i = laplacian.points.empty() ? k : laplacian.points[k];
    double sum = 0;
    double* diagonal = nullptr;
    for (SparseMatrix::InnerIterator a(psi, k); a; ++a) {
      const double here = conductivity[i], there = conductivity[a.col()];
      if (a.col() == i) {
        diagonal = &a.valueRef();
      } else {
        a.valueRef() *= mean == Mean::Arithmetic ? (here + there) / 2 : 2 / (1 / here + 1 / there);
        sum += a.value();
      }
    }
    if (diagonal) *diagonal = 0 - sum;
  }
  return laplacian;
}

DiffusionSystem::DiffusionSystem(const Cloud& cloud, const Operator& laplacian,
                                 const BoundaryConditions& conditions,
                                 const DiffusionOptions& options)
    : fixed_(conditions.fixed),
      time_step_(options.time_step),
      theta_(options.theta),
      threads_(options.solver.threads) {
  check(cloud, laplacian);
  check(options, cloud.size());
  check(conditions, cloud);
  const double coefficient = options.theta * options.diffusivity;
  const int n = cloud.size();
  const SparseMatrix& psi = laplacian.matrix();
  const std::vector<int> fixed_place = places(fixed_.points, n);
  const std::vector<int> psi_row = choose_rows(laplacian, fixed_place);
  const std::vector<int> column_place = places(columns_, n), row_place = places(rows_, n);
  for (const int i : rows_) diagonal_places_.push_back(column_place[i]);

  const int count = static_cast<int>(rows_.size());
  evolves_ = Eigen::VectorXd::Ones(count);
  constant_ = Eigen::VectorXd::Zero(count);
  if (options.source.size() > 0) constant_ = options.source(rows_);
  known_.resize(static_cast<Eigen::Index>(fixed_.points.size()));

  const WallConditions& walls = conditions.walls;
  const SparseMatrix wall_matrix = wall_rows(walls, n);
  std::vector<int> wall_of(count, -1);
  for (int k = 0; k < wall_matrix.rows(); ++k) {
    const int i = walls.points[k], row = row_place[i];
    if (row < 0)
      throw InvalidInput("the Laplacian has no row for the wall condition" + at_point(cloud, i));
    wall_of[row] = k;
    WallRow wall{row, size_of_row(wall_matrix, k, cloud, i),
                 std::abs(coefficient * psi.coeff(psi_row[row], i)), 1};
    wall.scale = row_scale(wall, rate_of(time_step_));
    walls_.push_back(wall);
    evolves_[row] = 0;
    constant_[row] = walls.flux.size() > 0 ? wall.scale * walls.flux[k] : 0;
  }

  const auto for_each_entry = [&](int row, const auto& f) {
    const int k = wall_of[row];
    const double factor = k >= 0 ? walls_[k].scale : -coefficient;
    const SparseMatrix& source = k >= 0 ? wall_matrix : psi;
    for (SparseMatrix::InnerIterator a(source, k >= 0 ? k : psi_row[row]); a; ++a)
      f(static_cast<int>(a.col()), factor * a.value());
  };
  choose_columns(matrix, count, static_cast<int>(columns_.size()), column_place, for_each_entry);
  choose_columns(coupling_, count, static_cast<int>(fixed_.points.size()), fixed_place,
                 for_each_entry);
  coupling_ *= -1;

  add_rate(cloud);
  points = system_points(cloud, laplacian, rows_);
  for (const WallRow& wall : walls_) points.walls.push_back(wall.row);
}

/// Sets the points of rows and columns; gives the Laplacian's row of each row.
std::vector<int> DiffusionSystem::choose_rows(const Operator& laplacian,
                                              const std::vector<int>& fixed_place) {
  std::vector<int> psi_row;
  for (int k = 0; k < laplacian.matrix().rows(); ++k) {
    const int i = laplacian.points.empty() ? k : laplacian.points[k];
    if (fixed_place[i] >= 0) continue;
    rows_.push_back(i);
    psi_row.push_back(k);
  }
  for (int i = 0; i < static_cast<int>(fixed_place.size()); ++i)
    if (fixed_place[i] < 0) columns_.push_back(i);
  return psi_row;
}

/// Keeps the diagonal where rows evolve, and adds 1/dt to it.
void DiffusionSystem::add_rate(const Cloud& cloud) {
  diagonal_ = Eigen::VectorXd::Zero(matrix.rows());
  for (int row = 0; row < matrix.rows(); ++row) {
    if (evolves_[row] == 0) continue;
    double* const entry = diagonal(matrix, row);
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

void DiffusionSystem::right_hand_side(const double* u, const double* product, double* b) {
  const double rate = rate_of(time_step_);
  for (Eigen::Index k = 0; k < known_.size(); ++k)
    known_[k] = fixed_.values.size() > 0 ? fixed_.values[k] : u[fixed_.points[k]];
  for_each_product(coupling_, known_.data(), threads_, [&](int k, double from_known) {
    const double constant = constant_[k];
    b[k] = from_known + constant + rate * evolves_[k] * u[rows_[k]];
    // What theta nu Psi u is at this time, seen from the unknowns' matrix; b has the known part.
    if (theta_ < 1 && evolves_[k] != 0)
      b[k] += (1 - theta_) / theta_ * (b[k] - constant - product[k]);
  });
}

void DiffusionSystem::set_fixed(double* u) const {
  for (Eigen::Index k = 0; k < fixed_.values.size(); ++k) u[fixed_.points[k]] = fixed_.values[k];
}

void DiffusionSystem::set_time_step(double time_step, SparseMatrix& matrix) {
  check_time_step(time_step, theta_);
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

namespace {

const Operator& with_all_rows(const Operator& laplacian) {
  if (!laplacian.points.empty())
    throw InvalidInput("the Laplacian has " + std::to_string(laplacian.points.size()) +
                       " rows that were asked for; implicit diffusion needs all");
  return laplacian;
}

}  // namespace

ImplicitDiffusion::ImplicitDiffusion(const Cloud& cloud, const Operator& laplacian,
                                     const BoundaryConditions& conditions,
                                     const DiffusionOptions& options)
    : points_(cloud.size()),
      system_(cloud, with_all_rows(laplacian), conditions, options),
      // Eigen 3.4 copies what is moved, unless told that it may take it.
      solver_(system_.matrix.markAsRValue(), options.solver, std::move(system_.points)),
      threads_(options.solver.threads) {}

void ImplicitDiffusion::set_time_step(double time_step) {
  SparseMatrix matrix = solver_.matrix();
  system_.set_time_step(time_step, matrix);
  solver_.refactor(matrix.markAsRValue());
}

SolveReport ImplicitDiffusion::step(Eigen::Ref<Eigen::MatrixXd> u) {
  if (u.rows() != points_)
    throw InvalidInput("the field has " + std::to_string(u.rows()) + " rows for " +
                       std::to_string(points_) + " points");
  const std::vector<int>& unknowns = system_.rows();
  resize(rhs_, static_cast<Eigen::Index>(unknowns.size()), u.cols());
  resize(solution_, rhs_.rows(), rhs_.cols());
  if (system_.needs_product()) resize(product_, rhs_.rows());
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (int i = 0; i < points_; ++i)
      if (!std::isfinite(u(i, c)))
        throw InvalidInput("the field is not finite at point " + std::to_string(i));
    double* const now = solution_.col(c).data();
    for (Eigen::Index k = 0; k < rhs_.rows(); ++k) now[k] = u(unknowns[k], c);
    if (system_.needs_product())
      for_each_product(solver_.matrix(), now, threads_,
                       [&](int k, double product) { product_[k] = product; });
    system_.right_hand_side(u.col(c).data(), product_.data(), rhs_.col(c).data());
  }
  const SolveReport report = solver_.solve(rhs_, solution_);
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (Eigen::Index k = 0; k < rhs_.rows(); ++k) u(unknowns[k], c) = solution_(k, c);
    system_.set_fixed(u.col(c).data());
  }
  return report;
}

}  // namespace gradpsi
