#include "common/diffusion.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <optional>
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

/// Fixed points, and those with a normal that are not fixed, by their places in the table; gradients are
/// still empty.
BoundaryConditions boundary(const DiffuseOptions& options, const Table& table, const Cloud& cloud,
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
  if (!options.flux.empty()) walls.flux = finite_column(table, cloud, options.flux)(walls.points);
  return conditions;
}

/// The equation and how it is solved.
DiffusionOptions equation(const DiffuseOptions& options, const Table& table, const Cloud& cloud) {
  DiffusionOptions result{
      .diffusivity = options.diffusivity,
      .time_step = options.steady ? std::numeric_limits<double>::infinity() : *options.time_step,
      .theta = options.steady ? 1 : options.theta,
      .solver = {.method = method(options.method),
                 .memory = options.memory * 1e9,
                 .threads = options.threads}};
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

/// The Laplacian. Rows of `unused` points may be degenerate, even where that is an error.
Operator laplacian(const DiffuseOptions& options, Machine& machine, const std::vector<int>& unused,
                   Report& report) {
  Stopwatch watch;
  Operator op;
  const AssemblyOptions assembly = assembly_options(options, machine.table());
  try {
    op = with_needed_rows(options.scheme, machine, assembly, unused);
  } catch (const StencilError& error) {
    throw std::runtime_error(words(error, report) + machine.remedy(options.scheme, assembly));
  }
  report.seconds.weights = watch.lap();
  return op;
}

/// What the walls get that positive rows cannot take up: of first order, and without growth.
const std::string remaining_walls = "gradient-direct-foc";

/// n . grad u = flux: the gradients at the walls' points.
void add_gradient(const DiffuseOptions& options, const std::string& scheme, Machine& machine,
                  WallConditions& walls, Report& report) {
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
  if (degenerate > 0 && machine.is_first())
    std::cout << scheme << ": " << degenerate << " of " << count
              << " rows of wall points are degenerate and lowered, widened or zero\n";
  walls.gradient = std::move(gradient.axes);
}

/// n . grad u = flux by the Laplacian's rows at the walls, which are then no conditions any more, but for those
/// that remain.
/// @return  what the flux adds to lap u
Eigen::VectorXd take_up_walls(const DiffuseOptions& options, Machine& machine,
                              WallConditions& walls, Operator& laplacian) {
  const std::int64_t count = machine.sum(std::ssize(walls.points));
  if (count == 0) return Eigen::VectorXd::Zero(machine.cloud().size());
  WithWalls result = machine.with_walls(std::move(laplacian),
                                        {walls.points, walls.normals, walls.flux}, options.threads);
  laplacian = std::move(result.laplacian);
  walls = {.points = result.remaining.points,
           .normals = result.remaining.normals,
           .flux = result.remaining.flux};
  const std::int64_t remaining = machine.sum(std::ssize(walls.points));
  if (remaining > 0 && machine.is_first())
    std::cout << remaining << " of " << count
              << " walls have their neighbours to one side of the normal: " << remaining_walls
              << " is taken there\n";
  return result.source;
}

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

}  // namespace

Diffusion diffusion(const DiffuseOptions& options, Machine& machine, Report& report) {
  BoundaryConditions conditions;
  machine.together(
      [&] { conditions = boundary(options, machine.table(), machine.cloud(), machine.axes()); });
  machine.find_neighbours(options, report);
  conditions.fixed.points = machine.places(std::move(conditions.fixed.points));
  conditions.walls.points = machine.places(std::move(conditions.walls.points));
  // Rows that conditions take the place of need not be there.
  std::vector<int> unused = conditions.fixed.points;
  unused.insert(unused.end(), conditions.walls.points.begin(), conditions.walls.points.end());
  Operator op = laplacian(options, machine, unused, report);
  Eigen::VectorXd from_walls = Eigen::VectorXd::Zero(machine.cloud().size());
  if (options.gradient == positive_walls)
    from_walls = take_up_walls(options, machine, conditions.walls, op);
  machine.describe(op, report);
  add_gradient(options, options.gradient == positive_walls ? remaining_walls : options.gradient,
               machine, conditions.walls, report);
  if (!options.conductivity.empty()) {
    const Eigen::VectorXd kappa = column(machine, options.conductivity);
    op = machine.with_conductivity(std::move(op), kappa,
                                   options.mean == "harmonic" ? Mean::Harmonic : Mean::Arithmetic);
    from_walls.array() *= kappa.array();
  }
  DiffusionOptions how;
  machine.together([&] { how = equation(options, machine.table(), machine.cloud()); });
  if (!from_walls.isZero(0)) {
    if (how.source.size() == 0) how.source = DenseVector::Zero(from_walls.size());
    how.source += how.diffusivity * from_walls;
  }
  const double steepest = how.theta < 1 ? steepest_row(machine, op, conditions.fixed.points) : 0;
  Diffusion result = machine.diffusion(std::move(op), conditions, how);
  result.gentle_step = 1 / ((1 - how.theta) * how.diffusivity * steepest);
  return result;
}

Steps make_steps(const DiffuseOptions& options, const Machine& machine, const Diffusion& heat,
                 Eigen::VectorXd& u, const std::function<void(int)>& done) {
  Steps steps{options.steady ? 1 : *options.steps};
  std::optional<Progress> progress;
  if (machine.is_first()) progress.emplace("steps");
  const auto size = [&](const Eigen::VectorXd& field) {
    return machine.largest(field.size() > 0 ? field.cwiseAbs().maxCoeff() : 0);
  };
  const double initially = size(u);
  for (int step = 1; step <= steps.count; ++step) {
    try {
      const SolveReport report = heat.step(u);
      steps.total.residual = std::max(steps.total.residual, report.residual);
      steps.total.iterations += report.iterations;
      steps.total.seconds += report.seconds;
    } catch (const SolverError& error) {
      if (options.steady) throw;
      std::string message = "step " + std::to_string(step) + ": " + error.what();
      if (const double now = size(u); initially > 0 && now > 1e10 * initially)
        message += "; the field had grown from " + text(initially) + " to " + text(now) +
                   ": this scheme is unstable on these points";
      throw std::runtime_error(message);
    }
    done(step);
    if (progress) progress->show(step, steps.count);
  }
  return steps;
}

Range range(const Machine& machine, const Eigen::VectorXd& u) {
  if (machine.sum(u.size()) == 0) return {0, 0};
  constexpr double none = std::numeric_limits<double>::max();
  return {machine.least(u.size() > 0 ? u.minCoeff() : none),
          machine.largest(u.size() > 0 ? u.maxCoeff() : -none)};
}

namespace {

std::ostream& operator<<(std::ostream& out, const Range& range) {
  return out << '[' << range.least << ", " << range.most << ']';
}

/// Whether the field has left its range by more than rounding.
bool left(const Range& before, const Range& after) {
  const double margin = 0.01 * (before.most - before.least) +
                        1e-9 * std::max(std::abs(before.least), std::abs(before.most));
  return after.least < before.least - margin || after.most > before.most + margin;
}

}  // namespace

void print_solution(const DiffuseOptions& options, const SolverReport& solver, const Steps& steps,
                    const Range& before, const Range& after, double gentle_step) {
  std::cout << "solved by " << solver.description << ":\n  " << solver.reason << '\n'
            << (options.steady ? "steady" : "steps: " + std::to_string(steps.count)) << ", "
            << (solver.method == Method::Krylov ? "iterations: " : "refinements: ")
            << steps.total.iterations << ", largest relative residual "
            << text(steps.total.residual) << '\n'
            << options.field << " was in " << before << ", is in " << after << '\n';
  if (!options.source.empty() || !options.flux.empty() || !left(before, after)) return;
  if (!options.steady && options.theta < 1)
    std::cout << "  diffusion alone never leaves the range it started from: Crank-Nicolson "
                 "overshoots from "
                 "jumps at this\n  step; --theta 1 does not, nor do steps up to "
              << text(gentle_step) << " where no weight is negative\n";
  else
    std::cout
        << "  diffusion alone never leaves the range it started from: on these points the scheme, "
           "or that of\n  the walls' gradient, does not approximate it\n";
}

}  // namespace gradpsi::apps
