#include "common/diffuse_options.hpp"

#include <cmath>
#include <cstdlib>

#include "common/outputs.hpp"

namespace gradpsi::apps {

using std::filesystem::path;

void ConditionOptions::check_gradient() const {
  if (gradient != positive_walls && Scheme(gradient).derivative != Derivative::Gradient)
    throw InvalidInput(gradient + " is not a gradient");
  if (gradient != positive_walls && degree(Scheme(gradient)) < 1)
    throw InvalidInput(
        gradient +
        " does not differentiate linear fields exactly: no condition on a slope can be met");
}

Option ConditionOptions::declare_normal(Options& options) {
  return options
      .text("--normal", normal, "PREFIX",
            "Columns PREFIXx, PREFIXy, PREFIXz: points where that vector n is not 0, and\n"
            "that are not fixed, obey n . grad u + c u = flux instead")
      .check(not_empty);
}

void ConditionOptions::declare_transfer(Options& options, const Option& normals) {
  options
      .text("--transfer", transfer, "COLUMN",
            "Column of that c >= 0, exchange with what is at flux / c; 0 without")
      .check(not_empty)
      .needs(normals);
}

void ConditionOptions::declare_gradient(Options& options, const Option& normals) {
  options
      .text("--gradient", gradient, "NAME",
            "Scheme of that gradient; or positive: rows of the Laplacian that know the slope and\n"
            "let no field grow")
      .needs(normals);
}

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
  if (damped_start && !steady && theta != 0.5)
    throw BadUsage("diffuse", "--damped-start needs --theta 0.5");
  if (Scheme(scheme).derivative != Derivative::Laplacian)
    throw InvalidInput(scheme + " is not a Laplacian");
  for (const char* taken : {"x", "y", "z", "volume", "support"})
    if (field == taken)
      throw InvalidInput("column '" + field + "' describes the points, it is not a field");
  if (!steady && !std::isfinite(*time_step))
    throw InvalidInput("--time-step must be finite; --steady is for the steady field");
  static_cast<void>(gradpsi::method(method));
  check_gradient();
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
        const double value = std::strtod(given.c_str(), nullptr);
        return value == 1 || value == 0.5 ? "" : "must be 1 or 0.5, not " + given;
      });
  options.flag("--damped-start", damped_start,
               "With --theta 0.5: the first step is two of half the length by backward Euler, so\n"
               "that it does not overshoot from jumps; the order remains 2 (Rannacher)");
  return options.flag(
      "--steady", steady,
      "Solve -nu lap u = f in one go; --time-step, --steps, --theta and --damped-start do not\n"
      "count then");
}

void DiffuseOptions::declare_conditions(Options& options) {
  options.text("--fixed", fixed, "COLUMN", "Points where this column is not 0 keep their value")
      .check(not_empty);
  const Option normals = declare_normal(options);
  options.text("--flux", flux, "COLUMN", "Column of that flux; 0 without")
      .check(not_empty)
      .needs(normals);
  declare_transfer(options, normals);
  declare_gradient(options, normals);
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
  options.text(
      "--method", method, "NAME",
      "auto, cholesky (symmetric matrices only), lu, krylov or multigrid; auto says what it\n"
      "took");
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
