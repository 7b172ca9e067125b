// gradpsi inspect: what an operator on the points of a file is fit for, and which rows spoil it.

#include <gradpsi/error.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "commands.hpp"
#include "common/diffusion.hpp"
#include "common/outputs.hpp"
#include "studies/findings_text.hpp"
#include "studies/verdict.hpp"

namespace gradpsi::apps {

namespace {

struct InspectOptions : ConditionOptions {
  std::optional<std::string> what;
  bool spectrum = false;
  std::filesystem::path output;
};

WallRows wall_rows(const std::vector<int>& walls, const RowReport& rows,
                   const WallConditions& remaining) {
  WallRows result{.count = std::ssize(walls), .by_gradient = std::ssize(remaining.points)};
  if (result.by_gradient == result.count) return result;
  for (const int i : walls) result.first_order += rows.outcome[i] == RowOutcome::Lowered;
  for (const int i : remaining.points) result.first_order -= rows.outcome[i] == RowOutcome::Lowered;
  result.second_order = result.count - result.by_gradient - result.first_order;
  return result;
}

/// The operator, and of a Laplacian what `diffuse` would step.
Stepped assemble_with_walls(const InspectOptions& options, Problem& problem, Report& report) {
  if (Scheme(options.scheme).derivative != Derivative::Laplacian) {
    assemble(options, problem, report);
    return {};
  }
  const auto machine = one_process(problem);
  BoundaryConditions conditions = conditions_of(options, *machine);
  machine->find_neighbours(options, report);
  const bool conditioned = !conditions.fixed.points.empty() || !conditions.walls.points.empty();
  try {
    problem.op = laplacian(options, *machine, conditions, conditioned, report);
  } catch (const SolverError& error) {  // which `diffuse` would end with
    std::cout << "no steps: " << error.what() << '\n';
    problem.op = laplacian(options, *machine, conditions, false, report);
  }
  Operator with_walls = problem.op;
  const std::vector<int> walls = conditions.walls.points;
  std::vector<std::string> remarks;
  set_walls(options, *machine, conditions, with_walls, report, remarks);
  machine->describe(problem.op, report);
  for (const std::string& remark : remarks) std::cout << remark << '\n';
  Stepped result = stepped(with_walls, conditions);
  result.walls = wall_rows(walls, with_walls.rows, conditions.walls);
  return result;
}

void run(InspectOptions options) {
  settle(options, options.what);
  options.check_gradient();
  const bool writes = !options.output.empty();
  check_outputs(options,
                writes ? std::vector{options.output} : std::vector<std::filesystem::path>());
  Report report;
  Problem problem = read_problem(options, report);
  Stepped stepped = assemble_with_walls(options, problem, report);
  const Findings findings =
      examine(options.scheme, problem, std::move(stepped), options.spectrum, options.threads);
  report.inspection = inspection(problem, findings);
  if (writes) {
    add_columns(problem.table, problem.op.rows, findings);
    write_table(options.output, problem.table);
  }
  write_report(options, report);
  print(problem, findings, report);
  if (writes && problem.cloud.size() > 0)
    std::cout << "every row: " << options.output.string() << '\n';
}

}  // namespace

std::function<void()> declare_inspect(Options& options) {
  auto wanted = std::make_shared<InspectOptions>();
  wanted->declare(options);
  declare_derivative(options, wanted->what);
  options
      .text("--fixed", wanted->fixed, "COLUMN",
            "Points where this column is not 0 keep their value: steps are judged by the\n"
            "others. Without it the points just end, which no scheme of second order survives")
      .check(not_empty);
  const Option normals = wanted->declare_normal(options);
  wanted->declare_transfer(options, normals);
  wanted->declare_gradient(options, normals);
  options.flag("--spectrum", wanted->spectrum,
               "Compute the eigenvalues too: all of them up to 2,000 points (half a minute),\n"
               "beyond the outermost ones");
  declare_table_output(
      options, wanted->output,
      "OUT.csv or OUT.vtu: the input's columns and what is known of each row:\n"
      "neighbours, support_used, reciprocal_condition, outcome (0 as asked, 1 lowered,\n"
      "2 widened, 3 zero), degree, amplification, negative_share, residual,\n"
      "error_bound (times the largest derivative of u of the order above the scheme's\n"
      "degree; nan in rows that promise less); with --tolerance certified_error");
  options.examples(
      "Example: gradpsi inspect points.csv --scheme laplacian-mixed-soc --support-ratio 3 "
      "-o rows.vtu");
  return [wanted] { run(*wanted); };
}

}  // namespace gradpsi::apps
