#include "commands/diffuse_options.hpp"

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>

#include "common/progress.hpp"

namespace gradpsi::apps {

using gradpsi::InvalidInput;
using std::filesystem::path;

path DiffuseOptions::beside(const std::string& ending) const {
  return path(output).replace_filename(output.stem().string() + ending);
}

bool DiffuseOptions::keeps(int step) const {
  return every && (step % *every == 0 || step == steps);
}

path DiffuseOptions::numbered(int step, const std::string& ending) const {
  std::string number = std::to_string(step);
  number.insert(0, std::to_string(*steps).size() - number.size(), '0');
  return beside("_" + number + ending);
}

std::string DiffuseOptions::title() const {
  return field + ", " + scheme + ", " + (steady ? "steady" : "t = " + text(*steps * *time_step));
}

void DiffuseOptions::check() const {
  if (!steady && (!time_step || !steps))
    throw BadUsage("diffuse", "needs --time-step and --steps, or --steady");
  if (gradpsi::Scheme(scheme).derivative != gradpsi::Derivative::Laplacian)
    throw InvalidInput(scheme + " is not a Laplacian");
  for (const char* taken : {"x", "y", "z", "volume", "support"})
    if (field == taken)
      throw InvalidInput("column '" + field + "' describes the points, it is not a field");
  if (!steady && !std::isfinite(*time_step))
    throw InvalidInput("--time-step must be finite; --steady is for the steady field");
  static_cast<void>(gradpsi::method(method));
  if (gradpsi::Scheme(gradient).derivative != gradpsi::Derivative::Gradient)
    throw InvalidInput(gradient + " is not a gradient");
}

namespace {

/// Points where the column is not 0.
std::vector<int> marked(const Eigen::VectorXd& column) {
  std::vector<int> points;
  for (Eigen::Index i = 0; i < column.size(); ++i)
    if (column[i] != 0) points.push_back(static_cast<int>(i));
  return points;
}

}  // namespace

gradpsi::BoundaryConditions boundary(const DiffuseOptions& options, const gradpsi::Table& table,
                                     const gradpsi::Cloud& cloud) {
  gradpsi::BoundaryConditions conditions;
  auto& walls = conditions.walls;
  Eigen::VectorXd fixed = Eigen::VectorXd::Zero(cloud.size());
  if (!options.fixed.empty()) fixed = finite_column(table, cloud, options.fixed);
  conditions.fixed.points = marked(fixed);
  if (options.normal.empty()) return conditions;
  const int dimension = cloud.dimension();
  gradpsi::Positions normals(cloud.size(), dimension);
  for (int a = 0; a < dimension; ++a)
    normals.col(a) = finite_column(table, cloud, options.normal + "xyz"[a]);
  for (int i = 0; i < cloud.size(); ++i)
    if (fixed[i] == 0 && !normals.row(i).isZero(0)) walls.points.push_back(i);
  walls.normals = normals(walls.points, Eigen::all);
  if (!options.flux.empty()) walls.flux = finite_column(table, cloud, options.flux)(walls.points);
  return conditions;
}

std::string gradient_advice(const gradpsi::StencilError& error) {
  return std::string(error.what()) +
         "; try a larger support, another --gradient or --on-degenerate widen";
}

std::string gradient_note(const DiffuseOptions& options, std::int64_t degenerate,
                          std::int64_t rows) {
  return options.gradient + ": " + std::to_string(degenerate) + " of " + std::to_string(rows) +
         " rows of wall points are degenerate and lowered, widened or zero\n";
}

gradpsi::Mean mean(const DiffuseOptions& options) {
  return options.mean == "harmonic" ? gradpsi::Mean::Harmonic : gradpsi::Mean::Arithmetic;
}

gradpsi::DiffusionOptions equation(const DiffuseOptions& options, const gradpsi::Table& table,
                                   const gradpsi::Cloud& cloud) {
  gradpsi::DiffusionOptions result{
      .diffusivity = options.diffusivity,
      .time_step = options.steady ? std::numeric_limits<double>::infinity() : *options.time_step,
      .theta = options.steady ? 1 : options.theta,
      .solver = {.method = gradpsi::method(options.method),
                 .memory = options.memory * 1e9,
                 .threads = options.threads}};
  if (!options.source.empty()) result.source = finite_column(table, cloud, options.source);
  return result;
}

nlohmann::ordered_json solve(const DiffuseOptions& options, const Stepper& stepper,
                             Eigen::VectorXd& u, const std::function<void(int)>& done) {
  const int count = options.steady ? 1 : *options.steps;
  std::optional<Progress> progress;
  if (stepper.shows_progress) progress.emplace("steps");
  const auto size = [&](const Eigen::VectorXd& field) {
    return stepper.largest(field.size() > 0 ? field.cwiseAbs().maxCoeff() : 0);
  };
  const double initially = size(u);
  gradpsi::SolveReport total;
  for (int step = 1; step <= count; ++step) {
    try {
      const gradpsi::SolveReport report = stepper.step(u);
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
    if (progress) progress->show(step, count);
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

Range range(const Eigen::VectorXd& u) {
  if (u.size() == 0) return {0, 0};
  return {u.minCoeff(), u.maxCoeff()};
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

void print_solution(const DiffuseOptions& options, const gradpsi::SolverReport& solver,
                    const nlohmann::ordered_json& steps, const Range& before, const Range& after,
                    const path& picture, bool drawn) {
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

void DiffuseOptions::declare_field(Options& options) {
  options.text("--field", field, "COLUMN", "The column u to start from")
      .check(not_empty)
      .required();
  options.number("--diffusivity", diffusivity, "NU", "nu in du/dt = nu lap u + f");
}

Option DiffuseOptions::declare_steps(Options& options) {
  options.number("--time-step", time_step, "DT", "Of the implicit steps");
  options.count("--steps", steps, from_one, "N", "How many");
  options
      .number("--theta", theta, "1|0.5", "1: backward Euler, order 1; 0.5: Crank-Nicolson, order 2")
      .check([](const std::string& given) {
        const double theta = std::strtod(given.c_str(), nullptr);
        return theta == 1 || theta == 0.5 ? "" : "must be 1 or 0.5, not " + given;
      });
  return options.flag(
      "--steady", steady,
      "Solve -nu lap u = f in one go; --time-step, --steps and --theta do not count then");
}

void DiffuseOptions::declare_conditions(Options& options) {
  options.text("--fixed", fixed, "COLUMN", "Points where this column is not 0 keep their value")
      .check(not_empty);
  const Option normals =
      options
          .text("--normal", normal, "PREFIX",
                "Columns PREFIXx, PREFIXy, PREFIXz: points where that vector n is not 0, and\n"
                "that are not fixed, obey n . grad u = flux instead")
          .check(not_empty);
  options.text("--flux", flux, "COLUMN", "Column of that flux; 0 without")
      .check(not_empty)
      .needs(normals);
  options.text("--gradient", gradient, "NAME", "Scheme of that gradient").needs(normals);
}

void DiffuseOptions::declare_materials(Options& options) {
  const Option conductivities = options
                                    .text("--conductivity", conductivity, "COLUMN",
                                          "Column kappa > 0 in du/dt = nu div(kappa grad u) + f")
                                    .check(not_empty);
  options
      .choice("--mean", mean, {"arithmetic", "harmonic"}, "MEAN",
              "Of kappa between two points: arithmetic where it is smooth, harmonic where it\n"
              "jumps")
      .needs(conductivities);
  options.text("--source", source, "COLUMN", "Column of f; 0 without").check(not_empty);
}

void DiffuseOptions::declare_solver(Options& options) {
  options.text("--method", method, "NAME",
               "auto, cholesky (symmetric matrices only), lu or krylov; auto says what it took");
  options.number("--memory", memory, "GB",
                 "What a factorisation may take; 0: three quarters of the machine's");
}

void DiffuseOptions::declare_diffusion(Options& options, const std::string& output_words,
                                       const std::string& program) {
  declare(options);
  declare_field(options);
  const Option steady_flag = declare_steps(options);
  declare_conditions(options);
  declare_materials(options);
  declare_solver(options);
  options
      .count("--every", every, from_one, "K",
             "Write every K-th field as OUT_<step>.vtu, and OUT.pvd, which ParaView plays")
      .excludes(steady_flag);
  declare_table_output(options, output, output_words).required();
  const std::string call = program + " diffuse points.csv --field T ";
  options.examples("Examples:\n  " + call +
                   "--scheme laplacian-mixed-zoc --support-ratio 3 \\\n    --diffusivity 0.1 "
                   "--time-step 0.01 --steps 100 --fixed wall -o T.vtu\n  " +
                   call +
                   "--scheme laplacian-mixed-soc --support-ratio 3 \\\n    --steady --fixed wall "
                   "-o T.csv");
}

}  // namespace gradpsi::apps
