#include "diffusion/conditions.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/text.hpp"
#include "gradpsi/error.hpp"

namespace gradpsi {

std::string at_point(const Cloud& cloud, int i) {
  return " at point " + std::to_string(cloud.number(i));
}

namespace {

/// Throws unless `values` has one finite number for each of `count` points, or none at all.
void check_values(const VectorView& values, std::size_t count, const std::string& what) {
  if (values.size() == 0) return;
  if (static_cast<std::size_t>(values.size()) != count)
    throw InvalidInput(what + " has " + std::to_string(values.size()) + " entries for " +
                       std::to_string(count) + " points");
  for (Eigen::Index k = 0; k < values.size(); ++k)
    if (!std::isfinite(values[k]))
      throw InvalidInput("entry " + std::to_string(k) + " of " + what + " is not finite");
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

void check(const WallConditions& walls, const Cloud& cloud) {
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

}  // namespace

void check_time_step(double time_step, double theta) {
  if (!(time_step > 0))
    throw InvalidInput("time_step must be > 0 (infinity: steady), not " + shortest(time_step));
  if (std::isinf(time_step) && theta != 1)
    throw InvalidInput("the steady problem needs theta = 1, not " + shortest(theta));
}

void check_damping(double theta) {
  if (theta != 0.5)
    throw InvalidInput(
        "a damped step is half a step by backward Euler, twice, with the matrix of " +
        std::string("Crank-Nicolson: theta must be 0.5, not ") + shortest(theta));
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

void check(const BoundaryConditions& conditions, const Cloud& cloud) {
  std::vector<char> taken(cloud.size(), false);
  claim(cloud, conditions.fixed.points, taken);
  claim(cloud, conditions.walls.points, taken);
  check_values(conditions.fixed.values, conditions.fixed.points.size(), "fixed.values");
  check(conditions.walls, cloud);
}

SolveReport both(const SolveReport& first, const SolveReport& second) {
  return {std::max(first.residual, second.residual), first.iterations + second.iterations,
          first.seconds + second.seconds};
}

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

}  // namespace gradpsi
