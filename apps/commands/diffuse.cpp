// gradpsi diffuse: implicit diffusion, or the steady problem, with a scheme's Laplacian.

#include <iostream>
#include <memory>

#include "commands.hpp"
#include "commands/diffuse_options.hpp"
#include "common/picture.hpp"

namespace gradpsi::apps {

namespace {

using std::filesystem::path;

/// n . grad u = flux: the gradients at the walls' points.
void add_gradient(const DiffuseOptions& options, Problem& problem, gradpsi::WallConditions& walls) {
  if (walls.points.empty()) return;
  gradpsi::AssemblyOptions assembly = assembly_options(options, problem.table);
  assembly.rows = walls.points;
  gradpsi::Operator gradient;
  try {
    gradient = gradpsi::assemble(options.gradient, problem.cloud, problem.near, assembly);
  } catch (const gradpsi::StencilError& error) {
    throw std::runtime_error(gradient_advice(error));
  }
  if (const int degenerate = gradient.rows.degenerate(); degenerate > 0) {
    std::cout << gradient_note(options, degenerate, std::ssize(walls.points));
    problem.report["degenerate_rows"] = problem.report["degenerate_rows"].get<int>() + degenerate;
  }
  walls.gradient = std::move(gradient.axes);
}

gradpsi::ImplicitDiffusion diffusion(const DiffuseOptions& options, Problem& problem) {
  const gradpsi::Table& table = problem.table;
  gradpsi::BoundaryConditions conditions = boundary(options, table, problem.cloud);
  // Rows that conditions take the place of need not be there.
  std::vector<int> unused = conditions.fixed.points;
  unused.insert(unused.end(), conditions.walls.points.begin(), conditions.walls.points.end());
  assemble(options, problem, unused);
  add_gradient(options, problem, conditions.walls);
  if (!options.conductivity.empty())
    problem.op =
        with_conductivity(std::move(problem.op),
                          finite_column(table, problem.cloud, options.conductivity), mean(options));
  return {problem.cloud, problem.op, conditions, equation(options, table, problem.cloud)};
}

/// VTU files numbered by step, and the .pvd that lists them with their times.
class Series {
 public:
  Series(const DiffuseOptions& options) : options_(options) {}

  void write(const gradpsi::Table& table, int step) {
    const path file = options_.numbered(step, ".vtu"), list = options_.beside(".pvd");
    check_outputs(options_, {file, list});
    gradpsi::write_vtu(file, table);
    written_.emplace_back(step * *options_.time_step, file);
    gradpsi::write_pvd(list, written_);
  }

 private:
  const DiffuseOptions& options_;
  std::vector<std::pair<double, path>> written_;
};

void run(const DiffuseOptions& options) {
  options.check();
  const path picture = options.beside(".png");
  check_outputs(options, {options.output, picture});
  Problem problem = read_points(options);
  gradpsi::Table& table = problem.table;
  Eigen::VectorXd u = finite_column(table, problem.cloud, options.field);
  const Range before = range(u);
  gradpsi::ImplicitDiffusion heat = diffusion(options, problem);

  Series series(options);
  const auto keep = [&](int step) {
    if (!options.keeps(step)) return;
    table.set(options.field, u);
    series.write(table, step);
  };
  keep(0);
  const Stepper stepper{.step = [&](Eigen::VectorXd& field) { return heat.step(field); },
                        .largest = [](double x) { return x; }};
  const auto steps = solve(options, stepper, u, keep);
  table.set(options.field, u);
  problem.report["solver"] = json(heat.solver());
  problem.report["steps"] = steps;
  const bool talk = write_and_report(options, problem, {options.output},
                                     [&] { write_table(options.output, table); });
  const bool drawn =
      draw_field(picture, problem.cloud.positions(), u, options.field, options.title());
  if (talk) print_solution(options, heat.solver(), steps, before, range(u), picture, drawn);
}

}  // namespace

std::function<void()> declare_diffuse(Options& options) {
  auto wanted = std::make_shared<DiffuseOptions>();
  wanted->declare_diffusion(
      options,
      "OUT.csv or OUT.vtu: the input's columns, the field as it is at last; and a\n"
      "picture of it, OUT.png",
      "gradpsi");
  return [wanted] { run(*wanted); };
}

}  // namespace gradpsi::apps
