#include "common/diffusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "common/progress.hpp"
#include "common/stopwatch.hpp"

namespace gradpsi::apps {

Eigen::VectorXd column(const Machine& machine, const std::string& name) {
  Eigen::VectorXd result;
  machine.together([&] { result = finite_column(machine.table(), machine.cloud(), name); });
  return result;
}

namespace {

/// Points where the column is not 0.
std::vector<int> marked(const Eigen::VectorXd& column) {
  std::vector<int> points;
  for (Eigen::Index i = 0; i < column.size(); ++i)
    if (column[i] != 0) points.push_back(static_cast<int>(i));
  return points;
}

BoundaryConditions boundary(const ConditionOptions& options, const Table& table, const Cloud& cloud,
                            const std::string& axes) {
  BoundaryConditions conditions;
  auto& walls = conditions.walls;
  Eigen::VectorXd fixed = Eigen::VectorXd::Zero(cloud.size());
  if (!options.fixed.empty()) fixed = finite_column(table, cloud, options.fixed);
  conditions.fixed.points = marked(fixed);
  if (options.normal.empty()) return conditions;
  const int dimension = cloud.dimension();
  Positions normals(cloud.size(), dimension);
  for (int a = 0; a < dimension; ++a)
    normals.col(a) = finite_column(table, cloud, options.normal + axes[a]);
  for (int i = 0; i < cloud.size(); ++i)
    if (fixed[i] == 0 && !normals.row(i).isZero(0)) walls.points.push_back(i);
  walls.normals = normals(walls.points, Eigen::all);
  const auto at_walls = [&](const std::string& name) -> DenseVector {
    if (name.empty()) return {};
    return finite_column(table, cloud, name)(walls.points);
  };
  walls.flux = at_walls(options.flux);
  walls.transfer = at_walls(options.transfer);
  return conditions;
}

}  // namespace

BoundaryConditions conditions_of(const ConditionOptions& options, const Machine& machine) {
  BoundaryConditions result;
  machine.together(
      [&] { result = boundary(options, machine.table(), machine.cloud(), machine.axes()); });
  return result;
}

namespace {

/// The equation and how it is solved.
DiffusionOptions equation(const DiffuseOptions& options, const Table& table, const Cloud& cloud) {
  DiffusionOptions result{
      .diffusivity = options.diffusivity,
      .time_step = options.steady ? std::numeric_limits<double>::infinity() : *options.time_step,
      .theta = options.steady ? 1 : options.theta,
      .solver = {.method = method(options.method),
                 .memory = options.memory * 1e9,
                 .threads = options.threads,
                 .solves = options.steady ? 1 : *options.steps}};
  if (!options.source.empty()) result.source = finite_column(table, cloud, options.source);
  return result;
}

/// Assembles, and fails for degenerate rows unless they are of points that are not used.
Operator with_needed_rows(const Scheme& scheme, Machine& machine, AssemblyOptions assembly,
                          const std::vector<int>& unused) {
  const bool all_needed = machine.sum(std::ssize(unused)) == 0;
  if (assembly.on_degenerate != OnDegenerate::Fail || all_needed)
    return machine.assemble(scheme, assembly);
  assembly.on_degenerate = OnDegenerate::Zero;
  Operator op = machine.assemble(scheme, assembly);
  machine.require(scheme, op, unused);
  return op;
}

}  // namespace

Operator laplacian(const ConditionOptions& options, Machine& machine,
                   const BoundaryConditions& conditions, bool stable, Report& report) {
  Stopwatch watch;
  std::vector<int> unused = conditions.fixed.points;
  unused.insert(unused.end(), conditions.walls.points.begin(), conditions.walls.points.end());
  Operator op;
  if (options.tolerance) {
    std::ranges::sort(unused);
    try {
      op = machine.choose_rows(options, unused, stable, report);
    } catch (const StencilError& error) {
      throw std::runtime_error(words(error, report));
    }
    report.seconds.weights = watch.lap();
    return op;
  }
  const AssemblyOptions assembly = assembly_options(options, machine.table());
  try {
    op = with_needed_rows(options.scheme, machine, assembly, unused);
  } catch (const StencilError& error) {
    throw std::runtime_error(words(error, report) + machine.remedy(options.scheme, assembly));
  }
  if (options.symmetric_support)
    op = with_symmetric_supports(options.scheme, std::move(op), options.threads);
  report.seconds.weights = watch.lap();
  return op;
}

namespace {

/// What the walls get that positive rows cannot take up: of first order, and without growth.
const std::string remaining_walls = "gradient-direct-foc";

/// n . grad u + c u = flux: the gradients at the walls' points.
void add_gradient(const ConditionOptions& options, const std::string& scheme, Machine& machine,
                  WallConditions& walls, Report& report, std::vector<std::string>& remarks) {
  const std::int64_t count = machine.sum(std::ssize(walls.points));
  if (count == 0) return;
  AssemblyOptions assembly = assembly_options(options, machine.table());
  assembly.rows = walls.points;
  Operator gradient;
  try {
    gradient = machine.assemble(scheme, assembly);
  } catch (const StencilError& error) {
    throw std::runtime_error(words(error, report) + machine.remedy(scheme, assembly));
  }
  const std::int64_t degenerate = machine.sum(gradient.rows.degenerate());
  report.degenerate_rows += degenerate;
  if (degenerate > 0)
    remarks.push_back(scheme + ": " + std::to_string(degenerate) + " of " + std::to_string(count) +
                      " rows of wall points are degenerate and lowered, widened or zero");
  walls.gradient = std::move(gradient.axes);
}

/// n . grad u + c u = flux by the Laplacian's rows at the walls, which are then no conditions any more, but for those
/// that remain.
/// @return  what the flux adds to lap u
Eigen::VectorXd take_up_walls(const ConditionOptions& options, Machine& machine,
                              WallConditions& walls, Operator& laplacian,
                              std::vector<std::string>& remarks) {
  const std::int64_t count = machine.sum(std::ssize(walls.points));
  if (count == 0) return Eigen::VectorXd::Zero(machine.cloud().size());
  WithWalls result = machine.with_walls(std::move(laplacian),
                                        {walls.points, walls.normals, walls.flux, walls.transfer},
                                        options.threads);
  laplacian = std::move(result.laplacian);
  walls = {.points = result.remaining.points,
           .normals = result.remaining.normals,
           .flux = result.remaining.flux,
           .transfer = result.remaining.transfer};
  const std::int64_t remaining = machine.sum(std::ssize(walls.points));
  if (remaining > 0)
    remarks.push_back(std::to_string(remaining) + " of " + std::to_string(count) +
                      " walls have their neighbours to one side of the normal: " + remaining_walls +
                      " is taken there");
  return result.source;
}

}  // namespace

Eigen::VectorXd set_walls(const ConditionOptions& options, Machine& machine,
                          BoundaryConditions& conditions, Operator& laplacian, Report& report,
                          std::vector<std::string>& remarks) {
  const bool positive = options.gradient == positive_walls;
  Eigen::VectorXd from_walls = Eigen::VectorXd::Zero(machine.cloud().size());
  if (positive) from_walls = take_up_walls(options, machine, conditions.walls, laplacian, remarks);
  machine.describe(laplacian, report);
  add_gradient(options, positive ? remaining_walls : options.gradient, machine, conditions.walls,
               report, remarks);
  return from_walls;
}

namespace {

/// The largest |a_ii| of points that are not fixed.
double steepest_row(const Machine& machine, const Operator& laplacian,
                    const std::vector<int>& fixed) {
  std::vector<char> is_fixed(laplacian.matrix().cols(), false);
  for (const int i : fixed) is_fixed[i] = true;
  double result = 0;
  for (int row = 0; row < laplacian.matrix().rows(); ++row)
    if (const int i = laplacian.points.empty() ? row : laplacian.points[row]; !is_fixed[i])
      result = std::max(result, std::abs(laplacian.matrix().coeff(row, i)));
  return machine.largest(result);
}

double largest_size(const Machine& machine, const DenseVector& values) {
  return machine.largest(values.size() > 0 ? values.cwiseAbs().maxCoeff() : 0);
}

/// The time that a step takes, or in the steady state, about, what crosses the points.
double time_of(const DiffusionOptions& how, const Machine& machine, const Eigen::VectorXd& kappa) {
  if (std::isfinite(how.time_step)) return how.time_step;
  const Extent own = extent(machine.cloud());
  double squared = 0;
  for (int a = 0; a < machine.cloud().dimension(); ++a)
    squared += std::pow(machine.largest(own.most[a]) - machine.least(own.least[a]), 2);
  const double slowest = kappa.size() > 0 ? kappa.minCoeff() : std::numeric_limits<double>::max();
  return squared / (how.diffusivity * machine.least(slowest));
}

/// See Diffusion::surroundings.
Range surroundings(const Machine& machine, const WallConditions& walls) {
  Range result;
  for (Eigen::Index k = 0; k < walls.transfer.size(); ++k) {
    if (walls.transfer[k] == 0) continue;
    const double around = walls.flux.size() > 0 ? walls.flux[k] / walls.transfer[k] : 0;
    result = {std::min(result.least, around), std::max(result.most, around)};
  }
  return {machine.least(result.least), machine.largest(result.most)};
}

/// See Diffusion::drift. Rows without negative weights keep to it.
double drift(const DiffusionOptions& how, const Machine& machine, const WallConditions& walls,
             double time) {
  if (largest_size(machine, walls.flux) > 0) return std::numeric_limits<double>::infinity();
  const double source = largest_size(machine, how.source);
  return source > 0 ? source * time : 0;
}

/// The system, once neighbours are known.
Diffusion set_up(const DiffuseOptions& options, Machine& machine, BoundaryConditions conditions,
                 Report& report) {
  std::vector<std::string> remarks;
  const Range around = surroundings(machine, conditions.walls);
  conditions.fixed.points = machine.places(std::move(conditions.fixed.points));
  conditions.walls.points = machine.places(std::move(conditions.walls.points));
  Operator op = laplacian(options, machine, conditions, true, report);
  Eigen::VectorXd from_walls = set_walls(options, machine, conditions, op, report, remarks);
  Eigen::VectorXd kappa = Eigen::VectorXd::Ones(from_walls.size());
  if (!options.conductivity.empty()) {
    kappa = column(machine, options.conductivity);
    op = machine.with_conductivity(std::move(op), kappa,
                                   options.mean == "harmonic" ? Mean::Harmonic : Mean::Arithmetic);
    from_walls.array() *= kappa.array();
  }
  DiffusionOptions how;
  machine.together([&] { how = equation(options, machine.table(), machine.cloud()); });
  if (largest_size(machine, from_walls) > 0) {
    if (how.source.size() == 0) how.source = DenseVector::Zero(from_walls.size());
    how.source += how.diffusivity * from_walls;
  }
  const auto convergence = std::make_shared<std::vector<double>>();
  how.solver.progress = [convergence, show = Iterations()](int iteration, double residual) {
    if (iteration == 1) convergence->clear();
    convergence->push_back(residual);
    show(iteration, residual);
  };
  const double steepest = how.theta < 1 ? steepest_row(machine, op, conditions.fixed.points) : 0;
  Diffusion result = machine.diffusion(std::move(op), conditions, how);
  result.gentle_step = 1 / ((1 - how.theta) * how.diffusivity * steepest);
  result.drift = drift(how, machine, conditions.walls, time_of(how, machine, kappa));
  result.surroundings = around;
  result.convergence = convergence;
  result.remarks = std::move(remarks);
  return result;
}

}  // namespace

Diffusion diffusion(const DiffuseOptions& options, Machine& machine, Report& report) {
  BoundaryConditions conditions = conditions_of(options, machine);
  machine.find_neighbours(options, report);
  return set_up(options, machine, std::move(conditions), report);
}

Diffusion diffusion_again(const DiffuseOptions& options, Machine& machine, Report& report) {
  return set_up(options, machine, conditions_of(options, machine), report);
}

}  // namespace gradpsi::apps
