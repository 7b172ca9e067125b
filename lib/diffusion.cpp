#include "gradpsi/diffusion.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "csr.hpp"
#include "gradpsi/error.hpp"
#include "parallel.hpp"
#include "resize.hpp"
#include "text.hpp"

namespace gradpsi {

/// The equations of the unknowns; members as in ImplicitDiffusion.
struct DiffusionSystem {
  int points = 0;
  std::vector<int> unknowns;
  FixedValues fixed;
  std::vector<WallRow> walls;
  Eigen::VectorXd evolves, diagonal, constant;
  SparseMatrix matrix, coupling;
  SystemPoints system_points;
};

namespace {

std::string at_point(int i) { return " at point " + std::to_string(i); }

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
  if (psi.rows() != cloud.size() || psi.cols() != cloud.size())
    throw InvalidInput("the Laplacian is " + std::to_string(psi.rows()) + " x " +
                       std::to_string(psi.cols()) + " for " + std::to_string(cloud.size()) +
                       " points");
  if (laplacian.volumes.size() != 0 && laplacian.volumes.size() != cloud.size())
    throw InvalidInput("the Laplacian has " + std::to_string(laplacian.volumes.size()) +
                       " volumes for " + std::to_string(cloud.size()) + " points");
}

/// Throws unless these are points of the cloud that have no condition yet; marks them.
void claim(const std::vector<int>& points, std::vector<char>& taken) {
  for (const int i : points) {
    if (i < 0 || i >= static_cast<int>(taken.size()))
      throw InvalidInput("there is no point " + std::to_string(i) + " among " +
                         std::to_string(taken.size()) + " to have a condition");
    if (std::exchange(taken[i], true))
      throw InvalidInput("point " + std::to_string(i) + " has two conditions");
  }
}

void check(const BoundaryConditions& conditions, const Cloud& cloud) {
  std::vector<char> taken(cloud.size(), false);
  claim(conditions.fixed.points, taken);
  claim(conditions.walls.points, taken);
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
      throw InvalidInput("the normal" + at_point(walls.points[k]) + " is zero or not finite");
    if (walls.transfer.size() > 0 && walls.transfer[k] < 0)
      throw InvalidInput("the transfer coefficient" + at_point(walls.points[k]) +
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
SparseMatrix columns(int row_count, int column_count, const std::vector<int>& places,
                     const Rows& for_each_entry) {
  SparseMatrix matrix(row_count, column_count);
  int* const outer = matrix.outerIndexPtr();
  for (int u = 0; u < row_count; ++u) {
    outer[u + 1] = outer[u];
    for_each_entry(u, [&](int j, double) { outer[u + 1] += places[j] >= 0; });
  }
  matrix.resizeNonZeros(outer[row_count]);
  for (int u = 0; u < row_count; ++u) {
    int at = outer[u];
    for_each_entry(u, [&](int j, double value) {
      if (places[j] < 0) return;
      matrix.innerIndexPtr()[at] = places[j];
      matrix.valuePtr()[at++] = value;
    });
  }
  return matrix;
}

/// The largest entry of a wall's row, with the sign of its diagonal.
double size_of_row(const SparseMatrix& rows, int k, int point) {
  double largest = 0, diagonal = 0;
  for (SparseMatrix::InnerIterator a(rows, k); a; ++a) {
    largest = std::max(largest, std::abs(a.value()));
    if (a.col() == point) diagonal = a.value();
  }
  if (!(largest > 0 && std::isfinite(largest)))
    throw InvalidInput("the wall condition" + at_point(point) +
                       " has a gradient row that is zero or not finite");
  return diagonal < 0 ? -largest : largest;
}

/// What a wall's row is multiplied by to be as large as its neighbours', so that residuals and
/// preconditioners see all rows alike; it makes the diagonal positive. A power of 2: nothing is rounded.
double row_scale(const WallRow& wall, double rate) {
  const double wanted = wall.diffusion + rate;
  const double scale =
      std::exp2(std::round(std::log2((wanted > 0 ? wanted : 1) / std::abs(wall.size))));
  return wall.size < 0 ? -scale : scale;
}

/// 1/dt
double rate_of(double time_step) { return std::isinf(time_step) ? 0 : 1 / time_step; }

/// Keeps the diagonal where unknowns evolve, and adds 1/dt to it.
void add_rate(DiffusionSystem& system, double rate) {
  const auto unknowns = static_cast<int>(system.unknowns.size());
  system.diagonal.resize(unknowns);
  for (int u = 0; u < unknowns; ++u) {
    if (system.evolves[u] == 0) continue;
    double* diagonal = nullptr;
    for (SparseMatrix::InnerIterator a(system.matrix, u); a; ++a)
      if (a.col() == u) diagonal = &a.valueRef();
    if (!diagonal)
      throw InvalidInput("the Laplacian stores no diagonal" + at_point(system.unknowns[u]));
    system.diagonal[u] = *diagonal;
    *diagonal += rate;
  }
}

SystemPoints unknown_points(const Cloud& cloud, const Operator& laplacian,
                            const std::vector<int>& unknowns) {
  const Eigen::VectorXd& volumes =
      laplacian.volumes.size() > 0 ? laplacian.volumes : cloud.volumes();
  CloudOptions options{.box = cloud.box()};
  if (volumes.size() > 0) options.volumes = volumes(unknowns);
  return {Cloud(cloud.positions()(unknowns, Eigen::all), options), unknowns, {}};
}

DiffusionSystem make_system(const Cloud& cloud, const Operator& laplacian,
                            const BoundaryConditions& conditions, const DiffusionOptions& options) {
  check(cloud, laplacian);
  check(options, cloud.size());
  check(conditions, cloud);
  const SparseMatrix& psi = laplacian.matrix();
  const double coefficient = options.theta * options.diffusivity;
  const int n = cloud.size();
  const auto& fixed = conditions.fixed.points;
  const auto& walls = conditions.walls;

  DiffusionSystem system;
  system.points = n;
  system.fixed = conditions.fixed;
  std::vector<int> unknown_place(n, -1), fixed_place(n, -1);
  for (std::size_t k = 0; k < fixed.size(); ++k) fixed_place[fixed[k]] = static_cast<int>(k);
  for (int i = 0; i < n; ++i) {
    if (fixed_place[i] >= 0) continue;
    unknown_place[i] = static_cast<int>(system.unknowns.size());
    system.unknowns.push_back(i);
  }
  const int unknowns = static_cast<int>(system.unknowns.size());
  system.evolves = Eigen::VectorXd::Ones(unknowns);
  system.constant = Eigen::VectorXd::Zero(unknowns);
  if (options.source.size() > 0) system.constant = options.source(system.unknowns);

  const SparseMatrix wall_matrix = wall_rows(walls, n);
  std::vector<int> wall_of(unknowns, -1);
  for (int k = 0; k < wall_matrix.rows(); ++k) {
    const int i = walls.points[k], u = unknown_place[i];
    wall_of[u] = k;
    WallRow wall{u, size_of_row(wall_matrix, k, i), std::abs(coefficient * psi.coeff(i, i)), 1};
    wall.scale = row_scale(wall, rate_of(options.time_step));
    system.walls.push_back(wall);
    system.evolves[u] = 0;
    system.constant[u] = walls.flux.size() > 0 ? wall.scale * walls.flux[k] : 0;
  }

  const auto for_each_entry = [&](int u, const auto& f) {
    const int k = wall_of[u];
    const double factor = k >= 0 ? system.walls[k].scale : -coefficient;
    const SparseMatrix& source = k >= 0 ? wall_matrix : psi;
    for (SparseMatrix::InnerIterator a(source, k >= 0 ? k : system.unknowns[u]); a; ++a)
      f(static_cast<int>(a.col()), factor * a.value());
  };
  system.matrix = columns(unknowns, unknowns, unknown_place, for_each_entry);
  system.coupling = columns(unknowns, static_cast<int>(fixed.size()), fixed_place, for_each_entry);
  system.coupling *= -1;
  add_rate(system, rate_of(options.time_step));
  system.system_points = unknown_points(cloud, laplacian, system.unknowns);
  for (const WallRow& wall : system.walls) system.system_points.walls.push_back(wall.unknown);
  return system;
}

}  // namespace

Operator with_conductivity(Operator laplacian, const Eigen::VectorXd& conductivity, Mean mean) {
  if (laplacian.axes.size() != 1)
    throw InvalidInput("a conductivity goes with a Laplacian, one matrix, not " +
                       std::to_string(laplacian.axes.size()));
  SparseMatrix& psi = laplacian.axes.front();
  if (conductivity.size() != psi.rows() || psi.rows() != psi.cols())
    throw InvalidInput("there are " + std::to_string(conductivity.size()) +
                       " conductivities for a Laplacian of " + std::to_string(psi.rows()) + " x " +
                       std::to_string(psi.cols()));
  for (Eigen::Index i = 0; i < conductivity.size(); ++i)
    if (!(conductivity[i] > 0 && std::isfinite(conductivity[i])))
      throw InvalidInput("the conductivity" + at_point(static_cast<int>(i)) +
                         " must be > 0 and finite, not " + shortest(conductivity[i]));
  for (int i = 0; i < psi.rows(); ++i) {
    double sum = 0;
    double* diagonal = nullptr;
    for (SparseMatrix::InnerIterator a(psi, i); a; ++a) {
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

ImplicitDiffusion::ImplicitDiffusion(const Cloud& cloud, const Operator& laplacian,
                                     const BoundaryConditions& conditions,
                                     const DiffusionOptions& options)
    : ImplicitDiffusion(make_system(cloud, laplacian, conditions, options), options) {}

ImplicitDiffusion::ImplicitDiffusion(DiffusionSystem&& system, const DiffusionOptions& options)
    : points_(system.points),
      unknowns_(std::move(system.unknowns)),
      fixed_(std::move(system.fixed)),
      walls_(std::move(system.walls)),
      evolves_(std::move(system.evolves)),
      diagonal_(std::move(system.diagonal)),
      coupling_(std::move(system.coupling)),
      constant_(std::move(system.constant)),
      time_step_(options.time_step),
      theta_(options.theta),
      threads_(options.solver.threads),
      solver_(std::move(system.matrix), options.solver, std::move(system.system_points)),
      known_(static_cast<Eigen::Index>(fixed_.points.size())) {}

void ImplicitDiffusion::set_time_step(double time_step) {
  check_time_step(time_step, theta_);
  SparseMatrix matrix = solver_.matrix();
  const double rate = rate_of(time_step);
  for (int u = 0; u < matrix.rows(); ++u)
    if (evolves_[u] > 0) matrix.coeffRef(u, u) = diagonal_[u] + rate;
  for (WallRow& wall : walls_) {
    const double scale = row_scale(wall, rate), change = scale / wall.scale;
    for (SparseMatrix::InnerIterator a(matrix, wall.unknown); a; ++a) a.valueRef() *= change;
    for (SparseMatrix::InnerIterator a(coupling_, wall.unknown); a; ++a) a.valueRef() *= change;
    constant_[wall.unknown] *= change;
    wall.scale = scale;
  }
  time_step_ = time_step;
  solver_.refactor(std::move(matrix));
}

SolveReport ImplicitDiffusion::step(Eigen::Ref<Eigen::MatrixXd> u) {
  if (u.rows() != points_)
    throw InvalidInput("the field has " + std::to_string(u.rows()) + " rows for " +
                       std::to_string(points_) + " points");
  const double rate = rate_of(time_step_);
  resize(rhs_, static_cast<Eigen::Index>(unknowns_.size()), u.cols());
  resize(solution_, rhs_.rows(), rhs_.cols());
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (int i = 0; i < points_; ++i)
      if (!std::isfinite(u(i, c))) throw InvalidInput("the field is not finite" + at_point(i));
    for (Eigen::Index k = 0; k < known_.size(); ++k)
      known_[k] = fixed_.values.size() > 0 ? fixed_.values[k] : u(fixed_.points[k], c);
    double* const b = rhs_.col(c).data();
    double* const now = solution_.col(c).data();
    for (Eigen::Index k = 0; k < rhs_.rows(); ++k) now[k] = u(unknowns_[k], c);
    for_each_product(coupling_, known_.data(), threads_, [&](int k, double from_known) {
      b[k] = from_known + constant_[k] + rate * evolves_[k] * now[k];
    });
    if (theta_ == 1) continue;
    // What theta nu Psi u is at this time, seen from the unknowns' matrix; b has the known part.
    for_each_product(solver_.matrix(), now, threads_, [&](int k, double from_unknown) {
      if (evolves_[k] == 0) return;
      const double implicit = b[k] - constant_[k] - from_unknown;
      b[k] += (1 - theta_) / theta_ * implicit;
    });
  }
  const SolveReport report = solver_.solve(rhs_, solution_);
  for (Eigen::Index c = 0; c < u.cols(); ++c) {
    for (Eigen::Index k = 0; k < rhs_.rows(); ++k) u(unknowns_[k], c) = solution_(k, c);
    if (fixed_.values.size() > 0)
      for (Eigen::Index k = 0; k < known_.size(); ++k) u(fixed_.points[k], c) = fixed_.values[k];
  }
  return report;
}

}  // namespace gradpsi
