#include "gradpsi/walls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/geometry.hpp"
#include "gradpsi/error.hpp"
#include "operators/positive.hpp"
#include "search/check.hpp"
#include "search/within.hpp"

namespace gradpsi {
namespace {

/// A wall's row of the Laplacian: weights of the neighbours and of the slope.
struct WallStencil {
  std::vector<int> neighbours;  // that have a weight, ascending
  std::vector<double> weights;  // theirs, 1/length^2
  double slope = 0;             // of n . grad u, n as given; 1/length
  RowOutcome outcome = RowOutcome::Zero;
  double reciprocal_condition = 0;
};

/// On a surface: the part of a normal within it below which the point is no edge of it.
constexpr double least_within = 0.1;

/// Solves the rows of a thread's points.
template <class Geometry>
class WallSolver {
  static constexpr int D = Geometry::dimension;

 public:
  WallSolver(const Geometry& geometry, const Cloud& cloud, const Neighbours& near)
      : geometry_(geometry), cloud_(cloud), near_(near) {}

  WallStencil operator()(int i, const Eigen::VectorXd& given) {
    geometry_.stand_at(i);
    const Vector<D> normal = geometry_.within(given);
    if (normal.norm() < least_within * given.norm()) return {};
    const auto neighbours = within_support(cloud_, near_, i, within_);
    const double h = near_.support(i);
    n_ = static_cast<int>(neighbours.size());
    Columns s = s_.columns(n_, D), q = q_.columns(n_, 1), psi = psi_.columns(n_, 1);
    for (int k = 0; k < n_; ++k) s.row(k) = geometry_.offset(i, neighbours[k]) / h;
    q = s.square().rowwise().sum().sqrt();
    WallStencil result;
    for (const bool trace_only : {false, true}) {
      Wall<D> wall{normal.normalized(), trace_only};
      const double reciprocal = stencil_.solve(s, q, psi, wall);
      if (!trace_only) result.reciprocal_condition = reciprocal;
      if (reciprocal == 0) continue;
      result.outcome = trace_only ? RowOutcome::Lowered : RowOutcome::AsAsked;
      for (int k = 0; k < n_; ++k) {
        if (psi(k) == 0) continue;
        result.neighbours.push_back(neighbours[k]);
        result.weights.push_back(psi(k) / (h * h));
      }
      result.slope = wall.slope / h / normal.norm();
      break;
    }
    return result;
  }

 private:
  Geometry geometry_;
  const Cloud& cloud_;
  const Neighbours& near_;
  int n_ = 0;
  std::vector<int> within_;
  Buffer s_, q_, psi_;
  PositiveStencil<D> stencil_;
};

/// Those of all walls.
template <class Geometry>
std::vector<WallStencil> wall_stencils(const Geometry& geometry, const Cloud& cloud,
                                       const Neighbours& near, const FluxWalls& walls,
                                       int threads) {
  std::vector<WallStencil> result(walls.points.size());
  parallel_chunks(static_cast<int>(result.size()), 64, threads,
                  [&, solver = WallSolver(geometry, cloud, near)](int begin, int end) mutable {
                    for (int k = begin; k < end; ++k)
                      result[k] = solver(walls.points[k], walls.normals.row(k).transpose());
                  });
  return result;
}

/// The normals of the surface that the points lie on, n x 3, 0 where none is known.
Positions surface_normals(const Operator& op, int points) {
  if (op.points.empty()) return op.normals;
  Positions result = Positions::Zero(points, 3);
  result(op.points, Eigen::all) = op.normals;
  return result;
}

std::vector<WallStencil> wall_stencils(const Operator& laplacian, const Cloud& cloud,
                                       const Neighbours& near, const FluxWalls& walls,
                                       int threads) {
  if (laplacian.normals.size() > 0) {
    const Positions normals = surface_normals(laplacian, cloud.size());
    return wall_stencils(TangentPlanes(cloud, normals), cloud, near, walls, threads);
  }
  return dispatch(cloud.dimension(), [&](auto d) {
    return wall_stencils(Space<decltype(d)::value>(cloud), cloud, near, walls, threads);
  });
}

/// Appends a wall's row, the neighbours that count and the diagonal.
/// @param lost  what the point loses through the wall, per u
void append(const WallStencil& wall, double lost, int i, SparseMatrix& matrix, int row) {
  double sum = lost;
  for (const double a : wall.weights) sum += a;
  bool diagonal = false;
  const auto append_diagonal = [&] {
    if (!std::exchange(diagonal, true)) matrix.insertBack(row, i) = -sum;
  };
  for (std::size_t k = 0; k < wall.neighbours.size(); ++k) {
    if (wall.neighbours[k] > i) append_diagonal();
    matrix.insertBack(row, wall.neighbours[k]) = wall.weights[k];
  }
  append_diagonal();
}

/// Those of these numbers.
FluxWalls some_of(const FluxWalls& walls, const std::vector<int>& numbers) {
  FluxWalls result;
  for (const int k : numbers) result.points.push_back(walls.points[k]);
  result.normals = walls.normals(numbers, Eigen::all);
  if (walls.flux.size() > 0) result.flux = walls.flux(numbers);
  if (walls.transfer.size() > 0) result.transfer = walls.transfer(numbers);
  return result;
}

std::string number(const Cloud& cloud, int i) { return std::to_string(cloud.number(i)); }

void check(const Operator& laplacian, const Cloud& cloud) {
  if (laplacian.axes.size() != 1 || laplacian.matrix().cols() != cloud.size() ||
      (laplacian.points.empty() && laplacian.matrix().rows() != cloud.size()))
    throw InvalidInput("walls need the Laplacian of the " + std::to_string(cloud.size()) +
                       " points, one matrix");
}

void check(const FluxWalls& walls, const Cloud& cloud) {
  const auto count = std::ssize(walls.points);
  for (const auto& [name, values] :
       {std::pair{"flux", &walls.flux}, std::pair{"transfer", &walls.transfer}})
    if (values->size() != 0 && values->size() != count)
      throw InvalidInput(name + (" has " + std::to_string(values->size())) + " entries for " +
                         std::to_string(count) + " walls");
  if (count > 0 && (walls.normals.rows() != count || walls.normals.cols() != cloud.dimension()))
    throw InvalidInput("normals is " + std::to_string(walls.normals.rows()) + " x " +
                       std::to_string(walls.normals.cols()) + " for " + std::to_string(count) +
                       " walls in " + std::to_string(cloud.dimension()) + " dimensions");
  std::vector<char> taken(cloud.size(), false);
  for (int k = 0; k < count; ++k) {
    const int i = walls.points[k];
    if (i < 0 || i >= cloud.size())
      throw InvalidInput("there is no point " + std::to_string(i) + " among " +
                         std::to_string(cloud.size()) + " to be a wall");
    if (std::exchange(taken[i], true))
      throw InvalidInput("point " + number(cloud, i) + " is a wall twice");
    if (!walls.normals.row(k).allFinite() || walls.normals.row(k).isZero(0))
      throw InvalidInput("the normal at point " + number(cloud, i) + " is zero or not finite");
    if (walls.flux.size() > 0 && !std::isfinite(walls.flux[k]))
      throw InvalidInput("the flux at point " + number(cloud, i) + " is not finite");
    if (walls.transfer.size() > 0 && !(walls.transfer[k] >= 0 && std::isfinite(walls.transfer[k])))
      throw InvalidInput("the transfer coefficient at point " + number(cloud, i) +
                         " must be >= 0 and finite, not " + shortest(walls.transfer[k]));
  }
}

}  // namespace

WithWalls with_walls(Operator laplacian, const Cloud& cloud, const Neighbours& near,
                     const FluxWalls& walls, int threads) {
  checked_threads(threads);
  check_match(cloud, near, threads);
  check(laplacian, cloud);
  check(walls, cloud);
  const auto stencils = wall_stencils(laplacian, cloud, near, walls, threads);
  std::vector<int> place(cloud.size(), -1), left;
  for (int k = 0; k < std::ssize(stencils); ++k)
    if (stencils[k].outcome == RowOutcome::Zero)
      left.push_back(k);
    else
      place[walls.points[k]] = k;
  WithWalls result{std::move(laplacian), DenseVector::Zero(cloud.size()), some_of(walls, left)};
  Operator& op = result.laplacian;
  SparseMatrix all;
  SparseMatrix& matrix = op.axes[0];
  all.swap(matrix);  // Eigen 3.4 would copy
  matrix.resize(all.rows(), all.cols());
  matrix.reserve(all.nonZeros());
  for (int row = 0; row < all.rows(); ++row) {
    const int i = op.point(row);
    matrix.startVec(row);
    if (place[i] < 0) {
      for (SparseMatrix::InnerIterator a(all, row); a; ++a)
        matrix.insertBack(row, a.col()) = a.value();
      continue;
    }
    const int k = place[i];
    const WallStencil& wall = stencils[k];
    append(wall, walls.transfer.size() > 0 ? wall.slope * walls.transfer[k] : 0, i, matrix, row);
    if (walls.flux.size() > 0) result.source[i] = wall.slope * walls.flux[k];
    if (op.rows.outcome.empty()) continue;
    op.rows.outcome[row] = wall.outcome;
    op.rows.reciprocal_condition[row] = wall.reciprocal_condition;
    op.rows.degree[row] = wall.outcome == RowOutcome::AsAsked ? 2 : 1;
    if (!op.rows.schemes.empty()) op.rows.schemes[row].reset();
    if (op.rows.errors.size() > 0) op.rows.errors[row] = std::numeric_limits<double>::quiet_NaN();
  }
  matrix.finalize();
  return result;
}

}  // namespace gradpsi
