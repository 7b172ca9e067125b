// gradpsi diffuse: implicit diffusion, or the steady problem, with a scheme's Laplacian.

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <memory>
#include <ostream>

#include "../lib/stopwatch.hpp"
#include "commands.hpp"
#include "operator_options.hpp"
#include "picture.hpp"
#include "progress.hpp"

namespace {

using gradpsi::InvalidInput;
using std::filesystem::path;

struct Options : OperatorOptions {
  std::string field;
  double diffusivity = 1;
  std::optional<double> time_step;
  std::optional<int> steps;
  bool steady = false;
  double theta = 1;
  std::string fixed, normal, flux, gradient = "gradient-direct-soc";
  std::string conductivity, mean = "arithmetic";
  std::string source;
  std::string method = "auto";
  double memory = 0;  // GB
  int every = 0;
  path output;

  path beside(const std::string& ending) const {
    return path(output).replace_filename(output.stem().string() + ending);
  }
};

/// Points where the column is not 0.
std::vector<int> marked(const Eigen::VectorXd& column) {
  std::vector<int> points;
  for (Eigen::Index i = 0; i < column.size(); ++i)
    if (column[i] != 0) points.push_back(static_cast<int>(i));
  return points;
}

/// The fixed points, and those with a normal that are not fixed; their gradients are still empty.
gradpsi::BoundaryConditions boundary(const Options& options, const Problem& problem) {
  gradpsi::BoundaryConditions conditions;
  auto& walls = conditions.walls;
  Eigen::VectorXd fixed = Eigen::VectorXd::Zero(problem.cloud.size());
  if (!options.fixed.empty()) fixed = finite_column(problem.table, options.fixed);
  conditions.fixed.points = marked(fixed);
  if (options.normal.empty()) return conditions;
  const int dimension = problem.cloud.dimension();
  gradpsi::Positions normals(problem.cloud.size(), dimension);
  for (int a = 0; a < dimension; ++a)
    normals.col(a) = finite_column(problem.table, options.normal + "xyz"[a]);
  for (int i = 0; i < problem.cloud.size(); ++i)
    if (fixed[i] == 0 && !normals.row(i).isZero(0)) walls.points.push_back(i);
  walls.normals = normals(walls.points, Eigen::all);
  if (!options.flux.empty()) walls.flux = finite_column(problem.table, options.flux)(walls.points);
  return conditions;
}

/// n . grad u = flux: the gradients at the walls' points.
void add_gradient(const Options& options, Problem& problem, gradpsi::WallConditions& walls) {
  if (walls.points.empty()) return;
  gradpsi::AssemblyOptions assembly = assembly_options(options, problem.table);
  assembly.rows = walls.points;
  gradpsi::Operator gradient;
  try {
    gradient = gradpsi::assemble(options.gradient, problem.cloud, problem.near, assembly);
  } catch (const gradpsi::StencilError& error) {
    throw std::runtime_error(std::string(error.what()) +
                             "; try a larger support, another --gradient or --on-degenerate widen");
  }
  if (const int lowered = gradient.rows.degenerate(); lowered > 0) {
    std::cout << options.gradient << ": " << lowered << " of " << walls.points.size()
              << " rows of wall points are degenerate and lowered, widened or zero\n";
    problem.report["degenerate_rows"] = problem.report["degenerate_rows"].get<int>() + lowered;
  }
  walls.gradient = std::move(gradient.axes);
}

gradpsi::ImplicitDiffusion diffusion(const Options& options, Problem& problem) {
  const gradpsi::Table& table = problem.table;
  gradpsi::BoundaryConditions conditions = boundary(options, problem);
  // Rows that conditions take the place of need not be there.
  std::vector<int> unused = conditions.fixed.points;
  unused.insert(unused.end(), conditions.walls.points.begin(), conditions.walls.points.end());
  assemble(options, problem, unused);
  add_gradient(options, problem, conditions.walls);
  if (!options.conductivity.empty())
    problem.op = with_conductivity(
        std::move(problem.op), finite_column(table, options.conductivity),
        options.mean == "harmonic" ? gradpsi::Mean::Harmonic : gradpsi::Mean::Arithmetic);
  gradpsi::DiffusionOptions diffusion{
      .diffusivity = options.diffusivity,
      .time_step = options.steady ? std::numeric_limits<double>::infinity() : *options.time_step,
      .theta = options.steady ? 1 : options.theta,
      .solver = {.method = gradpsi::method(options.method),
                 .memory = options.memory * 1e9,
                 .threads = options.threads}};
  if (!options.source.empty()) diffusion.source = finite_column(table, options.source);
  return {problem.cloud, problem.op, conditions, diffusion};
}

/// VTU files numbered by step, and the .pvd that lists them with their times.
class Series {
 public:
  Series(const Options& options) : options_(options) {}

  void write(const gradpsi::Table& table, int step) {
    std::string number = std::to_string(step);
    number.insert(0, std::to_string(*options_.steps).size() - number.size(), '0');
    const path file = options_.beside("_" + number + ".vtu"), list = options_.beside(".pvd");
    check_outputs(options_, {file, list});
    gradpsi::write_vtu(file, table);
    written_.emplace_back(step * *options_.time_step, file);
    gradpsi::write_pvd(list, written_);
  }

 private:
  const Options& options_;
  std::vector<std::pair<double, path>> written_;
};

/// All steps; done(n) is called after the n-th. What they took together.
nlohmann::ordered_json solve(const Options& options, gradpsi::ImplicitDiffusion& heat,
                             Eigen::VectorXd& u, const std::function<void(int)>& done) {
  const int count = options.steady ? 1 : *options.steps;
  Progress progress(count, "steps");
  const auto size = [](const Eigen::VectorXd& field) {
    return field.size() > 0 ? field.cwiseAbs().maxCoeff() : 0;
  };
  const double initially = size(u);
  gradpsi::SolveReport total;
  for (int step = 1; step <= count; ++step) {
    try {
      const gradpsi::SolveReport report = heat.step(u);
      total.residual = std::max(total.residual, report.residual);
      total.iterations += report.iterations;
      total.seconds += report.seconds;
    } catch (const gradpsi::SolverError& error) {
      if (options.steady) throw;
      std::string message = "step " + std::to_string(step) + ": " + error.what();
      if (const double now = size(u); initially > 0 && now > 1e10 * initially)
        message += "; the field had grown from " + text(initially) + " to " + text(now) +
                   ": this scheme is unstable on these points";
      throw std::runtime_error(message);
    }
    done(step);
    progress.show(step);
  }
  return {{"count", count},
          {"largest_residual", total.residual},
          {"iterations", total.iterations},
          {"seconds", total.seconds}};
}

nlohmann::ordered_json json(const gradpsi::SolverReport& solver) {
  return {{"method", name(solver.method)},
          {"description", solver.description},
          {"reason", solver.reason},
          {"unknowns", solver.unknowns},
          {"factor_entries", solver.factor.entries},
          {"factor_flops", solver.factor.flops},
          {"factor_bytes", solver.factor.bytes},
          {"analyse_seconds", solver.factor.analyse_seconds},
          {"factor_seconds", solver.factor.factor_seconds}};
}

struct Range {
  explicit Range(const Eigen::VectorXd& u)
      : least(u.size() > 0 ? u.minCoeff() : 0), most(u.size() > 0 ? u.maxCoeff() : 0) {}
  double least, most;
};

std::ostream& operator<<(std::ostream& out, const Range& range) {
  return out << '[' << range.least << ", " << range.most << ']';
}

/// Whether the field has left its range by more than rounding.
bool left(const Range& before, const Range& after) {
  const double margin = 0.01 * (before.most - before.least) +
                        1e-9 * std::max(std::abs(before.least), std::abs(before.most));
  return after.least < before.least - margin || after.most > before.most + margin;
}

void check(const Options& options) {
  if (gradpsi::Scheme(options.scheme).derivative != gradpsi::Derivative::Laplacian)
    throw InvalidInput(options.scheme + " is not a Laplacian");
  for (const char* taken : {"x", "y", "z", "volume", "support"})
    if (options.field == taken)
      throw InvalidInput("column '" + options.field + "' describes the points, it is not a field");
  if (!options.steady && !std::isfinite(*options.time_step))
    throw InvalidInput("--time-step must be finite; --steady is for the steady field");
  static_cast<void>(gradpsi::method(options.method));
  if (gradpsi::Scheme(options.gradient).derivative != gradpsi::Derivative::Gradient)
    throw InvalidInput(options.gradient + " is not a gradient");
}

void run(const Options& options) {
  check(options);
  const path picture = options.beside(".png");
  check_outputs(options, {options.output, picture});
  Problem problem = read_points(options);
  gradpsi::Table& table = problem.table;
  Eigen::VectorXd u = finite_column(table, options.field);
  const Range before(u);
  gradpsi::ImplicitDiffusion heat = diffusion(options, problem);

  Series series(options);
  const auto keep = [&](int step) {
    if (options.every == 0 || (step % options.every != 0 && step != options.steps)) return;
    table.set(options.field, u);
    series.write(table, step);
  };
  keep(0);
  const auto steps = solve(options, heat, u, keep);
  table.set(options.field, u);
  const std::string title =
      options.field + ", " + options.scheme + ", " +
      (options.steady ? "steady" : "t = " + text(*options.steps * *options.time_step));
  problem.report["solver"] = json(heat.solver());
  problem.report["steps"] = steps;
  const bool talk = write_and_report(options, problem, {options.output},
                                     [&] { write_table(options.output, table); });
  const bool drawn = draw_field(picture, problem.cloud.positions(), u, options.field, title);
  if (!talk) return;

  const gradpsi::SolverReport& solver = heat.solver();
  const Range after(u);
  std::cout << "solved by " << solver.description << ":\n  " << solver.reason << '\n'
            << (options.steady ? "steady" : "steps: " + steps["count"].dump()) << ", "
            << (solver.method == gradpsi::Method::Krylov ? "iterations: " : "refinements: ")
            << steps["iterations"] << ", largest relative residual "
            << text(steps["largest_residual"]) << '\n'
            << options.field << " was in " << before << ", is in " << after << '\n';
  const bool ripples = !options.steady && options.theta < 1;  // of Crank-Nicolson
  if (options.source.empty() && options.flux.empty() && !ripples && left(before, after))
    std::cout
        << "  diffusion alone never leaves the range it started from: on these points the scheme, "
           "or that of\n  the walls' gradient, does not approximate it\n";
  if (drawn)
    std::cout << "picture: " << picture.string() << '\n';
  else
    std::cout << "no picture: gnuplot could not draw one (is gnuplot-nox installed?)\n";
}

}  // namespace

void add_diffuse(CLI::App& app) {
  // An empty shell variable must not become "no condition".
  const auto not_empty = [](const std::string& name) {
    return name.empty() ? "must not be empty" : "";
  };
  auto* command = app.add_subcommand(
      "diffuse", "Implicit diffusion of a field, or the steady field, with boundary conditions.");
  auto options = std::make_shared<Options>();
  options->add_to(*command);
  command->add_option("--field", options->field, "The column u to start from")
      ->type_name("COLUMN")
      ->check(not_empty)
      ->required();
  command->add_option("--diffusivity", options->diffusivity, "nu in du/dt = nu lap u + f")
      ->type_name("NU")
      ->capture_default_str();
  command->add_option("--time-step", options->time_step, "Of the implicit steps")->type_name("DT");
  command->add_option("--steps", options->steps, "How many")
      ->type_name("N")
      ->check(CLI::Range(1, 2147483647));
  command
      ->add_option("--theta", options->theta,
                   "1: backward Euler, order 1; 0.5: Crank-Nicolson, order 2")
      ->type_name("1|0.5")
      ->check([](const std::string& given) {
        const double theta = std::strtod(given.c_str(), nullptr);
        return theta == 1 || theta == 0.5 ? "" : "must be 1 or 0.5, not " + given;
      })
      ->capture_default_str();
  auto* steady = command->add_flag(
      "--steady", options->steady,
      "Solve -nu lap u = f in one go; --time-step, --steps and --theta do not count then");
  command
      ->add_option("--fixed", options->fixed, "Points where this column is not 0 keep their value")
      ->type_name("COLUMN")
      ->check(not_empty);
  auto* normal =
      command
          ->add_option(
              "--normal", options->normal,
              "Columns PREFIXx, PREFIXy, PREFIXz: points where that vector n is not 0, and\n"
              "that are not fixed, obey n . grad u = flux instead")
          ->type_name("PREFIX")
          ->check(not_empty);
  command->add_option("--flux", options->flux, "Column of that flux; 0 without")
      ->type_name("COLUMN")
      ->check(not_empty)
      ->needs(normal);
  command->add_option("--gradient", options->gradient, "Scheme of that gradient")
      ->type_name("NAME")
      ->needs(normal)
      ->capture_default_str();
  auto* conductivity = command
                           ->add_option("--conductivity", options->conductivity,
                                        "Column kappa > 0 in du/dt = nu div(kappa grad u) + f")
                           ->type_name("COLUMN")
                           ->check(not_empty);
  command
      ->add_option("--mean", options->mean,
                   "Of kappa between two points: arithmetic where it is smooth, harmonic where it\n"
                   "jumps")
      ->type_name("MEAN")
      ->check(CLI::IsMember({"arithmetic", "harmonic"}))
      ->needs(conductivity)
      ->capture_default_str();
  command->add_option("--source", options->source, "Column of f; 0 without")
      ->type_name("COLUMN")
      ->check(not_empty);
  command
      ->add_option("--method", options->method,
                   "auto, cholesky (symmetric matrices only), lu or krylov; auto says what it took")
      ->type_name("NAME")
      ->capture_default_str();
  command
      ->add_option("--memory", options->memory,
                   "What a factorisation may take; 0: three quarters of the machine's")
      ->type_name("GB")
      ->capture_default_str();
  command
      ->add_option("--every", options->every,
                   "Write every K-th field as OUT_<step>.vtu, and OUT.pvd, which ParaView plays")
      ->type_name("K")
      ->check(CLI::Range(1, 2147483647))
      ->excludes(steady);
  add_table_output(*command, options->output,
                   "OUT.csv or OUT.vtu: the input's columns, the field as it is at last; and a\n"
                   "picture of it, OUT.png")
      ->required();
  command->footer(
      "Examples:\n  gradpsi diffuse points.csv --field T --scheme laplacian-mixed-zoc "
      "--support-ratio 3 \\\n    --diffusivity 0.1 --time-step 0.01 --steps 100 --fixed wall -o "
      "T.vtu\n  gradpsi diffuse points.csv --field T --scheme laplacian-mixed-soc --support-ratio "
      "3 "
      "\\\n    --steady --fixed wall -o T.csv");
  command->callback([options] {
    if (!options->steady && (!options->time_step || !options->steps))
      throw CLI::ValidationError("diffuse", "needs --time-step and --steps, or --steady");
    run(*options);
  });
}
