// gradpsi derive: the derivative of a field given at the points of a file.

#include <limits>
#include <memory>

#include "commands.hpp"
#include "common/outputs.hpp"
#include "common/remedy.hpp"

namespace gradpsi::apps {

namespace {

using std::filesystem::path;

void run(const OperatorOptions& options, const std::string& field, const path& output) {
  const Scheme scheme = options.scheme;
  check_outputs(options, {output});
  Report report;
  Problem problem = read_problem(options, report);
  Table& table = problem.table;
  const Eigen::VectorXd u = finite_column(table, problem.cloud, field);
  assemble(options, problem, report);
  const auto& axes = problem.op.axes;
  const auto names = component_names(scheme, problem.axes);
  const std::vector<int> unanswered = rows_without_answer(options, problem.op);
  for (std::size_t a = 0; a < axes.size(); ++a) {
    Eigen::VectorXd values = axes[a] * u;
    values(unanswered).setConstant(std::numeric_limits<double>::quiet_NaN());
    table.add(names[a].empty() ? "lap_" + field : field + '_' + names[a], values);
  }
  write_and_report(options, report, table.has("support"), {output},
                   [&] { write_table(output, table); });
  if (!unanswered.empty())
    throw std::runtime_error(
        count(std::ssize(unanswered), "row") + " of " + std::to_string(problem.cloud.size()) +
        " could not be computed and " + (unanswered.size() == 1 ? "is" : "are") + " nan in " +
        output.string() + remedy(scheme, problem, assembly_options(options, table), unanswered));
}

}  // namespace

std::function<void()> declare_derive(Options& options) {
  auto wanted = std::make_shared<OperatorOptions>();
  auto field = std::make_shared<std::string>();
  auto output = std::make_shared<path>();
  wanted->declare(options);
  options.text("--field", *field, "COLUMN", "The column to differentiate").required();
  declare_table_output(options, *output,
                       "OUT.csv or OUT.vtu: the input's columns, and FIELD_x, FIELD_y, FIELD_z\n"
                       "(gradient), lap_FIELD (Laplacian) or FIELD_xx, FIELD_xy, .. (Hessian)")
      .required();
  options.examples(
      "Example: gradpsi derive points.csv --field T --scheme laplacian-mixed-soc "
      "--support-ratio 3 -o lap.vtu");
  return [=] { run(*wanted, *field, *output); };
}

}  // namespace gradpsi::apps
