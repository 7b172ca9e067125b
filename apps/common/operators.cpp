#include "common/operators.hpp"

#include <omp.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <gradpsi/neighbours.hpp>
#include <gradpsi/scheme.hpp>
#include <gradpsi/tolerance.hpp>
#include <iostream>
#include <utility>

#include "common/anisotropy.hpp"
#include "common/median.hpp"
#include "common/remedy.hpp"
#include "common/stopwatch.hpp"

namespace gradpsi::apps {

void OperatorOptions::declare(Options& options) {
  declare_points(options);
  const Option named =
      options.text("--scheme", scheme, "NAME", "One of those that `gradpsi schemes` lists");
  const Option absolute = options.number(
      "--support", support, "H", "Support radius h, a length: the kernel is 0 from r = h on");
  const Option relative = options.number(
      "--support-ratio", support_ratio, "K",
      "Support radius as a multiple of the spacing: (mean volume)^(1/d), or without\n"
      "volumes the median distance to the nearest point; where spacings vary by more than\n"
      "jitter explains, of that at each point. A column `support`, one h a point, goes\n"
      "before all of these; ls-P and positive can do without: P + 1/2, 5/2");
  Option(relative).excludes(absolute);
  options
      .count("--neighbours", neighbours, {1, 1'000'000}, "N",
             "Support radius such that each point has N neighbours")
      .excludes(absolute)
      .excludes(relative);
  const Option accurate = options.number(
      "--tolerance", tolerance, "E",
      "In place of a scheme and a support: each row is by the cheapest scheme and support that\n"
      "are good to E there, the largest error for waves of length L and longer, proved, over\n"
      "(2 pi / L)^order. Rows that none is good enough for fail; with --on-degenerate lower\n"
      "they are the best there are, with zero they are zero");
  const Option shortest = options.text(
      "--wavelength", wavelength, "L|COLUMN",
      "The length of the shortest waves that matter, or a column that has it for each\n"
      "point [the extent of the points]");
  Option(accurate).excludes(named).excludes(absolute).excludes(relative);
  Option(shortest).needs(accurate).check(not_empty);
  options.flag("--symmetric-support", symmetric_support,
               "Where supports differ, points count for one another if either is in the support\n"
               "of the other, with the mean of both kernels: zoc matrices stay symmetric");
  options.choice(
      "--on-degenerate", on_degenerate, {"fail", "lower", "widen", "zero"}, "POLICY",
      "Rows that cannot be solved: fail, lower their consistency, widen their support up\n"
      "to three times, or leave them zero [fail; widen where no support is given]");
  options.flag("--on-surface", on_surface,
               "The points lie on a surface in 3D: derivatives are those within it, the\n"
               "gradient along it and the Laplace-Beltrami operator; volumes are areas");
  options.file("--report", report, "FILE.json", "Write sizes, times and memory to this JSON file");
}

void OperatorOptions::settle(const std::string& derivative) {
  if (!scheme.empty()) return;
  if (!tolerance) throw BadUsage("--scheme", "is required, or --tolerance");
  for (const auto& [given, name] :
       {std::pair{neighbours.has_value(), "--neighbours"}, std::pair{on_surface, "--on-surface"},
        std::pair{symmetric_support, "--symmetric-support"}})
    if (given) throw BadUsage(name, "is for a scheme, not for rows that are chosen to a tolerance");
  if (on_degenerate == "widen")
    throw BadUsage("--on-degenerate", "rows that miss a tolerance fail, are lowered or zero");
  scheme = derivative + "-ls-6";
}

Option declare_derivative(Options& options, std::optional<std::string>& derivative) {
  return options.choice("--what", derivative, {"gradient", "laplacian", "hessian"}, "NAME",
                        "With --tolerance: what is assembled");
}

void settle(OperatorOptions& options, const std::optional<std::string>& derivative) {
  if (options.tolerance && !derivative)
    throw BadUsage("--what", "--tolerance needs it: gradient, laplacian or hessian");
  options.settle(derivative.value_or(""));
  const std::string of_scheme(name(Scheme(options.scheme).derivative));
  if (derivative && *derivative != of_scheme)
    throw BadUsage("--what", options.scheme + " is a " + of_scheme + ", not a " + *derivative);
}

bool has_support(const OperatorOptions& options, const Table& table) {
  return options.support || options.support_ratio || options.neighbours || table.has("support");
}

Eigen::VectorXd supports(const OperatorOptions& options, const Table& table, const Lie& lie) {
  if (table.has("support")) return table.column("support");
  if (options.support) return Eigen::VectorXd::Constant(1, *options.support);
  if (options.neighbours) {
    if (!lie.kth_nearest) throw BadUsage("--neighbours", "is for one process");
    return lie.kth_nearest(*options.neighbours) * (1 + 1e-9);
  }
  const auto ratio = options.support_ratio ? options.support_ratio : support_ratio(options.scheme);
  if (!ratio)
    throw InvalidInput(options.points.string() +
                       " has no column 'support': give --support, --support-ratio or --neighbours");
  if (!(*ratio > 0 && std::isfinite(*ratio)))
    throw InvalidInput("--support-ratio must be > 0 and finite, not " + text(*ratio));
  return *ratio * lie.spacing();
}

namespace {

OnDegenerate policy(const std::string& name) {
  return name == "fail"    ? OnDegenerate::Fail
         : name == "lower" ? OnDegenerate::Lower
         : name == "widen" ? OnDegenerate::Widen
                           : OnDegenerate::Zero;
}

}  // namespace

AssemblyOptions assembly_options(const OperatorOptions& options, const Table& table) {
  return {.kernel = kernel(options.kernel),
          .on_degenerate = policy(
              options.on_degenerate.value_or(has_support(options, table) ? "fail" : "widen")),
          .threads = options.threads,
          .on_surface = options.on_surface};
}

Problem read_problem(const PointOptions& options, Report& report) {
  Stopwatch watch;
  Problem problem{read_points(options)};
  report.points = problem.cloud.size();
  report.dropped_points = problem.dropped;
  report.threads = options.threads > 0 ? options.threads : omp_get_max_threads();
  warn(problem.notes, report);
  report.seconds.read = watch.lap();
  return problem;
}

void warn(const Notes& warnings, Report& report) {
  for (const std::string& warning : warnings) {
    std::cerr << "warning: " << warning << '\n';
    report.warnings.push_back(warning);
  }
}

Eigen::VectorXd supports(const OperatorOptions& options, const Problem& problem) {
  const bool empty = problem.cloud.size() == 0;  // no rows, no supports
  const Cloud& cloud = problem.cloud;
  const DenseVector one = DenseVector::Ones(1);
  const bool areas = options.on_surface && cloud.dimension() == 3 && cloud.has_volumes();
  const auto spacing = [&] {  // areas are no volumes
    return areas ? local_spacing(Cloud(cloud.positions(), {.box = cloud.box()}), options.threads)
                 : local_spacing(cloud, options.threads);
  };
  const Lie lie{
      .spacing = [&] { return empty ? one : spacing(); },
      .kth_nearest =
          [&](int k) { return empty ? one : kth_nearest_distances(cloud, k, options.threads); }};
  return supports(options, problem.table, lie);
}

void find_neighbours(const OperatorOptions& options, Problem& problem, Report& report) {
  if (options.tolerance) return;  // choose_rows()
  Stopwatch watch;
  const Eigen::VectorXd h = supports(options, problem);
  problem.near = gradpsi::find_neighbours(problem.cloud, h, options.threads);
  warn(warnings(problem.cloud, problem.near, options.threads), report);
  if (const auto found = anisotropy(problem.cloud, problem.near, options.threads))
    warn({words(*found, problem.axes)}, report);
  report.seconds.search = watch.lap();
}

namespace {

/// Of all points; without their lists, as for probes, of the rows.
NeighbourCounts neighbour_counts(const Neighbours& near, const RowReport& rows) {
  std::vector<double> counts;
  if (near.offsets.size() == 0) counts.assign(rows.neighbours.begin(), rows.neighbours.end());
  for (int i = 0; i < near.size(); ++i) counts.push_back(near.count(i));
  if (counts.empty()) return {};
  const auto [least, most] = std::ranges::minmax(counts);
  return {static_cast<int>(least), median(counts), static_cast<int>(most)};
}

}  // namespace

DegenerateRows degenerate_rows(const Operator& op, const Cloud& cloud) {
  const RowReport& rows = op.rows;
  DegenerateRows result;
  for (int k = 0; k < static_cast<int>(rows.outcome.size()); ++k) {
    const RowOutcome outcome = rows.outcome[k];
    if (outcome == RowOutcome::AsAsked) continue;
    ++(outcome == RowOutcome::Lowered   ? result.lowered
       : outcome == RowOutcome::Widened ? result.widened
                                        : result.zero);
    result.rows.push_back({cloud.number(op.points.empty() ? k : op.points[k]), outcome,
                           rows.degree[k], rows.neighbours[k], rows.supports[k],
                           rows.reciprocal_condition[k]});
  }
  return result;
}

void describe(const Operator& op, const Problem& problem, Report& report) {
  if (!op.points.empty()) report.rows = op.matrix().rows();
  report.supports_differ = problem.near.supports.size() > 1;
  report.entries = op.matrix().nonZeros();
  report.schemes.clear();
  for (const auto& scheme : op.rows.schemes)
    if (scheme) ++report.schemes[name(*scheme)];
  if (op.rows.errors.size() > 0) report.largest_error = 0;
  for (int i = 0; i < op.rows.errors.size(); ++i)
    if (std::isfinite(op.rows.errors[i]) && !std::ranges::binary_search(problem.unused, i))
      report.largest_error = std::max(*report.largest_error, op.rows.errors[i]);
  report.neighbours = neighbour_counts(problem.near, op.rows);
  report.degenerate = degenerate_rows(op, problem.cloud);
  report.degenerate_rows = report.degenerate.count();
  if (Eigen::Index worst; op.rows.reciprocal_condition.size() > 0) {
    const double least = op.rows.reciprocal_condition.minCoeff(&worst);
    report.worst = {least, op.points.empty() ? worst : op.points[worst]};
  }
}

namespace {

/// One for all points, or one for each.
DenseVector wavelengths(const OperatorOptions& options, const Problem& problem) {
  const std::string& given = options.wavelength;
  double length = problem.cloud.size() > 1 ? longest_wave(problem.cloud) : 1.0;
  const auto read = std::from_chars(given.data(), given.data() + given.size(), length);
  if (given.empty() || (read.ec == std::errc() && read.ptr == given.data() + given.size()))
    return DenseVector::Constant(1, length);
  return finite_column(problem.table, problem.cloud, given);
}

}  // namespace

Operator choose_rows(const OperatorOptions& options, Problem& problem,
                     const std::vector<int>& unused, bool stable, Report& report) {
  // A lone point has no extent, and no row either.
  const DenseVector lengths = wavelengths(options, problem);
  report.tolerance = *options.tolerance;
  report.wavelength = lengths.size() == 1 ? text(lengths[0]) : options.wavelength;
  if (problem.table.has("support"))
    warn(
        {"the column 'support' is not used: rows chosen to a tolerance have supports of their own"},
        report);
  problem.unused = unused;
  Operator op =
      assemble_to({*options.tolerance, lengths}, Scheme(options.scheme).derivative, problem.cloud,
                  {.kernel = kernel(options.kernel),
                   .on_miss = policy(options.on_degenerate.value_or("fail")),
                   .stable = stable,
                   .fixed = unused,
                   .threads = options.threads});
  DenseVector supports = op.rows.supports;
  std::vector<int> rows;  // that are not zero
  for (int i = 0; i < problem.cloud.size(); ++i)
    if (supports[i] > 0) rows.push_back(i);
  supports = (supports.array() > 0).select(supports, lengths.maxCoeff());
  problem.near = gradpsi::find_neighbours(problem.cloud, supports, rows, options.threads);
  return op;
}

namespace {

void assemble_chosen(const OperatorOptions& options, Problem& problem, Report& report) {
  Stopwatch watch;
  try {
    problem.op = choose_rows(options, problem, {}, false, report);
  } catch (const StencilError& error) {
    throw StencilError(words(error, report), error.point, error.neighbours,
                       error.reciprocal_condition);
  }
  report.seconds.weights = watch.lap();
  describe(problem.op, problem, report);
}

}  // namespace

void assemble(const OperatorOptions& options, Problem& problem, Report& report,
              const std::optional<std::vector<int>>& rows) {
  if (options.tolerance) return assemble_chosen(options, problem, report);
  if (rows && options.symmetric_support)
    throw BadUsage("--symmetric-support", "needs the rows of all points");
  AssemblyOptions assembly = assembly_options(options, problem.table);
  assembly.rows = rows;
  find_neighbours(options, problem, report);
  Stopwatch watch;
  try {
    problem.op = gradpsi::assemble(options.scheme, problem.cloud, problem.near, assembly);
  } catch (const StencilError& error) {
    throw StencilError(words(error, report) + remedy(options.scheme, problem, assembly,
                                                     rows.value_or(std::vector<int>())),
                       error.point, error.neighbours, error.reciprocal_condition);
  }
  if (options.symmetric_support)
    problem.op = with_symmetric_supports(options.scheme, std::move(problem.op), options.threads);
  report.seconds.weights = watch.lap();
  describe(problem.op, problem, report);
}

std::string words(const StencilError& error, const Report& report) {
  return std::string(error.what()) +
         (report.dropped_points > 0 ? " (dropped points are not counted)" : "");
}

std::vector<std::string> component_names(const Scheme& scheme, const std::string& axes) {
  return in_axes(components(scheme.derivative, static_cast<int>(axes.size())), axes);
}

std::vector<std::string> in_axes(std::vector<std::string> components, const std::string& axes) {
  for (std::string& name : components)
    for (char& axis : name) axis = axes[axis - 'x'];
  return components;
}

std::vector<int> rows_without_answer(const OperatorOptions& options, const Operator& op) {
  std::vector<int> rows;
  if (options.on_degenerate == "zero") return rows;
  for (std::size_t k = 0; k < op.rows.outcome.size(); ++k)
    if (op.rows.outcome[k] == RowOutcome::Zero) rows.push_back(static_cast<int>(k));
  return rows;
}

}  // namespace gradpsi::apps
