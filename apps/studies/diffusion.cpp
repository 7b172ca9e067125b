#include "studies/diffusion.hpp"

#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numbers>

#include "common/fit.hpp"

namespace gradpsi::apps::diffusion {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double usual_support_ratio = 3;

/// Points of the unit interval, square or cube: on the walls and, jittered by up to `jitter` spacings,
/// between them.
Cloud points_and_walls(int dimension, int intervals, double jitter) {
  // The lattice's cells are centred on what are the points here.
  const double dx = 1.0 / intervals;
  const Lattice lattice{.dimension = dimension,
                        .points_per_side = intervals + 1,
                        .lower = -dx / 2,
                        .upper = 1 + dx / 2,
                        .jitter = jitter};
  Lattice regular = lattice;
  regular.jitter = 0;
  Positions x = make_cloud(lattice).positions();
  const Positions on_lattice = make_cloud(regular).positions();
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    for (Eigen::Index a = 0; a < x.cols(); ++a)
      for (const double wall : {0.0, 1.0})
        if (std::abs(on_lattice(i, a) - wall) < dx / 4) x(i, a) = wall;
  return Cloud(x, {.volumes = Eigen::VectorXd::Constant(x.rows(), std::pow(dx, dimension))});
}

/// The outward normal of a point on the walls, not of unit length at edges and corners; 0 between walls.
Eigen::RowVectorXd normal(const Cloud& cloud, int i) {
  const auto x = cloud.positions().row(i).array();
  return (x == 1).cast<double>() - (x == 0).cast<double>();
}

std::vector<int> points_on_walls(const Cloud& cloud) {
  std::vector<int> on_walls;
  for (int i = 0; i < cloud.size(); ++i)
    if (normal(cloud, i).any()) on_walls.push_back(i);
  return on_walls;
}

WallConditions no_flux(const Cloud& cloud, const Neighbours& near) {
  WallConditions walls;
  walls.points = points_on_walls(cloud);
  walls.normals.resize(std::ssize(walls.points), cloud.dimension());
  for (std::size_t k = 0; k < walls.points.size(); ++k)
    walls.normals.row(static_cast<Eigen::Index>(k)) = normal(cloud, walls.points[k]);
  walls.gradient = assemble("gradient-direct-soc", cloud, near, {.rows = walls.points}).axes;
  return walls;
}

/// A field that decays without changing its shape.
struct Mode {
  Cloud cloud;
  double spacing;
  Neighbours near;
  Eigen::VectorXd u;
  BoundaryConditions conditions;

  double rate() const { return pi * pi * cloud.dimension(); }
};

Mode make_mode(int dimension, int intervals, double jitter, Walls walls) {
  const double dx = 1.0 / intervals;
  Mode mode{points_and_walls(dimension, intervals, jitter), dx, {}, {}, {}};
  mode.near = find_neighbours(mode.cloud, usual_support_ratio * dx);
  const Eigen::ArrayXXd x = pi * mode.cloud.positions().array();
  if (walls == Walls::NoFlux) {
    mode.u = x.cos().rowwise().prod();
    mode.conditions.walls = no_flux(mode.cloud, mode.near);
  } else {
    mode.u = x.sin().rowwise().prod();
    mode.conditions.fixed.points = points_on_walls(mode.cloud);
    mode.u(mode.conditions.fixed.points).setZero();
  }
  return mode;
}

/// The mode after `steps` steps up to `time`, from a field that meets the walls' conditions as the
/// matrix has them: a step of no length sees to that. From any other Crank-Nicolson is of order 1.
Eigen::VectorXd after(const Mode& mode, const Operator& laplacian, double time, int steps,
                      double theta) {
  Eigen::VectorXd u = mode.u;
  ImplicitDiffusion heat(mode.cloud, laplacian, mode.conditions,
                         {.time_step = 1e-9 * time, .theta = theta});
  heat.step(u);
  heat.set_time_step(time / steps);
  for (int n = 0; n < steps; ++n) heat.step(u);
  return u;
}

/// Points that are not within a spacing of the unit square's edge; those that are, are fixed.
std::vector<int> fix_edge(const Cloud& cloud, BoundaryConditions& conditions) {
  std::vector<int> inside;
  const double dx = cloud.spacing();
  for (int i = 0; i < cloud.size(); ++i) {
    const auto x = cloud.positions().row(i);
    const bool at_edge = x.minCoeff() < dx || x.maxCoeff() > 1 - dx;
    (at_edge ? conditions.fixed.points : inside).push_back(i);
  }
  return inside;
}

double rms(const Eigen::VectorXd& error) {
  return std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
}

/// Adds a result of the same kind with its order.
void add(std::vector<Result>& results, Result next) {
  if (!results.empty()) {
    const Result& before = results.back();
    next.order = order_between(before.step, before.error, next.step, next.error);
  }
  results.push_back(next);
}

}  // namespace

std::vector<Result> time_orders(int dimension, Walls walls, bool quick) {
  const Mode mode = make_mode(dimension, dimension == 3 ? 8 : quick ? 16 : 32, 0.2, walls);
  const Operator laplacian = assemble("laplacian-mixed-zoc", mode.cloud, mode.near);
  const double time = 1 / mode.rate();
  const Eigen::VectorXd limit = after(mode, laplacian, time, 1280, 0.5);
  std::vector<Result> all;
  for (const double theta : {1.0, 0.5}) {
    std::vector<Result> results;
    for (const int steps : {20, 40, 80})
      add(results, {"time", dimension, walls, 0.2, theta == 1 ? "backward-euler" : "crank-nicolson",
                    usual_support_ratio, time / steps,
                    rms(after(mode, laplacian, time, steps, theta) - limit)});
    all.insert(all.end(), results.begin(), results.end());
  }
  return all;
}

std::vector<Result> space_orders(int dimension, Walls walls, double jitter, const Scheme& scheme,
                                 bool quick) {
  std::vector<std::vector<int>> intervals = {
      {20, 40, 80, 160, 320}, {10, 20, 40, 80}, {6, 9, 13, 19}};
  if (quick) intervals = {{20, 40, 80}, {10, 20, 40}, {9, 13}};
  std::vector<Result> results;
  for (const int m : intervals[dimension - 1]) {
    const Mode mode = make_mode(dimension, m, jitter, walls);
    const Operator laplacian = assemble(scheme, mode.cloud, mode.near);
    const Eigen::VectorXd decayed = after(mode, laplacian, 1 / mode.rate(), 200, 0.5);
    add(results, {"space", dimension, walls, jitter, name(scheme), usual_support_ratio,
                  mode.spacing, rms(decayed - mode.u / std::numbers::e)});
  }
  return results;
}

Result poisson(const Scheme& scheme, double support_ratio) {
  constexpr int side = 40;
  double squared = 0, count = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Cloud cloud = make_cloud(Lattice{.points_per_side = side, .jitter = 0.2, .seed = seed});
    const Neighbours near = find_neighbours(cloud, support_ratio * cloud.spacing());
    BoundaryConditions conditions;
    const std::vector<int> inside = fix_edge(cloud, conditions);
    const auto x = cloud.positions().array();
    const Eigen::VectorXd exact = (2.5 * x.col(0)).sin() * (2.5 * x.col(1)).cos();
    Eigen::VectorXd u = exact;
    ImplicitDiffusion steady(cloud, assemble(scheme, cloud, near), conditions,
                             {.time_step = infinity, .source = 2 * 2.5 * 2.5 * exact});
    steady.step(u);
    squared += (u - exact).squaredNorm();
    count += static_cast<double>(inside.size());
  }
  return {"poisson",    2,
          Walls::Fixed, 0.2,
          name(scheme), support_ratio,
          1.0 / side,   std::sqrt(squared / count)};
}

Result slab(const Scheme& scheme, double jitter, Mean mean) {
  const Cloud cloud = make_cloud(Lattice{.points_per_side = 60, .jitter = jitter});
  const double dx = cloud.spacing();
  const Neighbours near = find_neighbours(cloud, usual_support_ratio * dx);
  const auto x = cloud.positions().col(0).array();
  const Eigen::VectorXd kappa = (x < 0.5).select(Eigen::ArrayXd::Ones(x.size()), 10.0);
  const Eigen::VectorXd exact = (x < 0.5).select(x * 20 / 11, 1 - (1 - x) * 2 / 11);
  BoundaryConditions conditions;
  fix_edge(cloud, conditions);
  Eigen::VectorXd u = exact;
  ImplicitDiffusion steady(cloud, with_conductivity(assemble(scheme, cloud, near), kappa, mean),
                           conditions, {.time_step = infinity});
  steady.step(u);
  double sum = 0;
  int count = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (x[i] < 0.5 && x[i] > 0.5 - dx) sum += u[i] - exact[i], ++count;
  return {mean == Mean::Harmonic ? "slab-harmonic" : "slab-arithmetic",
          2,
          Walls::Fixed,
          jitter,
          name(scheme),
          usual_support_ratio,
          dx,
          std::abs(sum / count) / (10.0 / 11)};
}

Columns<Result> columns() {
  return {{"of", &Result::of},
          {"dimension", &Result::dimension},
          {"walls", [](auto& r) { return r.walls == Walls::Fixed ? "fixed" : "no-flux"; }},
          {"jitter", &Result::jitter, {"%g"}},
          {"method", &Result::method},
          {"support_ratio", &Result::support_ratio, {"%g"}},
          {"step", &Result::step, {"%.6g"}},
          {"error", &Result::error, {"%.4g"}},
          {"order", &Result::order, {"%.2f"}}};
}

}  // namespace gradpsi::apps::diffusion
