// gradpsi derive: derivatives of fields given at the points of a file.

#include <memory>
#include <optional>
#include <utility>

#include "commands.hpp"
#include "commands/derivatives.hpp"
#include "commands/derive_at.hpp"
#include "common/outputs.hpp"
#include "common/remedy.hpp"

namespace gradpsi::apps {

namespace {

using std::filesystem::path;

struct DeriveOptions : OperatorOptions {
  std::string fields, what, rows;
  path at, output;
};

/// The points that have something else than 0 in the column; without a column all.
std::optional<std::vector<int>> wanted_rows(const Problem& problem, const std::string& column) {
  if (column.empty()) return {};
  const Eigen::VectorXd marks = finite_column(problem.table, problem.cloud, column);
  std::vector<int> rows;
  for (int i = 0; i < problem.cloud.size(); ++i)
    if (marks[i] != 0) rows.push_back(i);
  if (rows.empty()) throw InvalidInput("column '" + column + "' is 0 at all points");
  return rows;
}

/// How the rows that can be computed are had without the others.
std::string without(std::ptrdiff_t unanswered, std::ptrdiff_t rows) {
  if (unanswered == rows) return "";
  return "; --rows COLUMN, a column that is 0 at " +
         std::string(unanswered == 1 ? "this point" : "these points") + ", computes the " +
         std::to_string(rows - unanswered) + " others";
}

/// Assembles; where that fails, what is said tells how many rows do not.
void assemble_wanted(const DeriveOptions& options, const std::optional<std::vector<int>>& rows,
                     Problem& problem, Report& report) {
  try {
    assemble(options, problem, report, rows);
  } catch (const StencilError& error) {
    if (options.tolerance) throw;
    AssemblyOptions assembly = assembly_options(options, problem.table);
    assembly.on_degenerate = OnDegenerate::Zero;
    assembly.rows = rows;
    const Operator op = gradpsi::assemble(options.scheme, problem.cloud, problem.near, assembly);
    throw std::runtime_error(error.what() +
                             without(op.rows.degenerate(), std::ssize(op.rows.outcome)));
  }
}

/// At probes instead of the points.
void run_at(const DeriveOptions& options, const Quantity& what,
            const std::vector<std::string>& fields, const Eigen::MatrixXd& u, const Problem& points,
            Report& report) {
  Problem probes = at_probes(options, options.at, points, report);
  naming(options.at, [&] { add_quantity(what, fields, u, {}, options.threads, probes); });
  write_and_report(options, report, points.table.has("support"), {options.output},
                   [&] { write_table(options.output, probes.table); });
}

void run(DeriveOptions options) {
  if (options.tolerance) {
    for (const auto& [given, option] :
         {std::pair{!options.at.empty(), "--at"}, std::pair{!options.rows.empty(), "--rows"}})
      if (given) throw BadUsage(option, "is for a scheme, not for rows chosen to a tolerance");
  }
  options.settle(options.tolerance ? std::string(name(quantity(options.what).derivative)) : "");
  const Scheme scheme = options.scheme;
  const Quantity& what = quantity(options.what, scheme);
  if (options.at.empty() && scheme.derivative == Derivative::Value)
    throw BadUsage("--scheme", name(scheme) + " is for values elsewhere: --at PROBES.csv");
  const std::vector<std::string> fields = field_names(options.fields);
  check_outputs(options, {options.output}, options.at);
  Report report;
  Problem problem = read_problem(options, report);
  check_fields(what, fields, options, problem.axes);
  Eigen::MatrixXd u(problem.cloud.size(), std::ssize(fields));
  for (std::size_t c = 0; c < fields.size(); ++c)
    u.col(static_cast<Eigen::Index>(c)) = finite_column(problem.table, problem.cloud, fields[c]);
  if (!options.at.empty()) return run_at(options, what, fields, u, problem, report);
  const auto rows = wanted_rows(problem, options.rows);
  assemble_wanted(options, rows, problem, report);
  const std::vector<int> unanswered = rows_without_answer(options, problem.op);
  add_quantity(what, fields, u, unanswered, options.threads, problem);
  write_and_report(options, report, problem.table.has("support"), {options.output},
                   [&] { write_table(options.output, problem.table); });
  if (unanswered.empty()) return;
  std::vector<int> points = unanswered;
  if (rows)
    for (int& point : points) point = (*rows)[point];
  const std::ptrdiff_t missing = std::ssize(unanswered), all = problem.op.matrix().rows();
  throw std::runtime_error(
      count(missing, "row") + " of " + std::to_string(all) + " could not be computed and " +
      (missing == 1 ? "is" : "are") + " nan in " + options.output.string() +
      remedy(scheme, problem, assembly_options(options, problem.table), points) +
      without(missing, all));
}

}  // namespace

std::function<void()> declare_derive(Options& options) {
  auto wanted = std::make_shared<DeriveOptions>();
  wanted->declare(options);
  options
      .text("--field", wanted->fields, "COLUMN[,COLUMN..]",
            "The columns to differentiate, each by itself; or with --what divergence and the\n"
            "like a vector's components: vx,vy,vz")
      .required();
  options.choice(
      "--what", wanted->what, quantity_names(), "NAME",
      "What is computed, from a scheme of the derivative in brackets: gradient,\n"
      "laplacian, hessian, value of each column [the scheme's own]; of a vector divergence,\n"
      "curl, strain (gradient) or grad-div (hessian)");
  const Option rows =
      options.text("--rows", wanted->rows, "COLUMN",
                   "Only at points where this column is not 0; the others, which count as "
                   "neighbours\nall the same, get nan");
  Option(rows).check(not_empty);
  options
      .file("--at", wanted->at, "PROBES.csv",
            "At these places instead of the points, by value-mls-P, gradient-mls-P or the like;\n"
            "the output has their columns")
      .excludes(rows)
      .check(not_empty);
  declare_table_output(
      options, wanted->output,
      "OUT.csv or OUT.vtu: the input's columns, and FIELD_x, FIELD_y, FIELD_z\n"
      "(gradient), lap_FIELD (Laplacian), FIELD_xx, FIELD_xy, .. (Hessian), FIELD (value);\n"
      "of a vector v div_v, curl_v (3D: curl_v_x, ..), strain_v_xx, ..,\n"
      "grad_div_v_x, ..; a VTU file has vectors as such, too")
      .required();
  options.examples(
      "Examples:\n"
      "  gradpsi derive points.csv --field T --what laplacian --tolerance 0.05 -o "
      "lap.vtu\n"
      "  gradpsi derive points.csv --field T --scheme laplacian-mixed-soc --support-ratio 3 -o "
      "lap.vtu\n"
      "  gradpsi derive points.csv --field vx,vy --what curl --scheme gradient-ls-2 -o curl.vtu\n"
      "  gradpsi derive points.csv --field T --scheme value-mls-2 --at probes.csv -o there.csv");
  return [wanted] { run(*wanted); };
}

}  // namespace gradpsi::apps
