// gradpsi inspect: what an operator on the points of a file is fit for, and which rows spoil it.

#include <iostream>
#include <memory>

#include "commands.hpp"
#include "common/outputs.hpp"
#include "studies/findings_text.hpp"
#include "studies/verdict.hpp"

namespace gradpsi::apps {

namespace {

struct InspectOptions : OperatorOptions {
  std::string fixed;
  bool spectrum = false;
  std::filesystem::path output;
};

void run(const InspectOptions& options) {
  const bool writes = !options.output.empty();
  check_outputs(options,
                writes ? std::vector{options.output} : std::vector<std::filesystem::path>());
  Report report;
  Problem problem = read_problem(options, report);
  assemble(options, problem, report);
  const Findings findings =
      examine(options.scheme, problem, evolving_points(problem, options.fixed), options.spectrum,
              options.threads);
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
  options
      .text("--fixed", wanted->fixed, "COLUMN",
            "Points where this column is not 0 keep their value: steps are judged by the\n"
            "others. Without it the points just end, which no scheme of second order survives")
      .check(not_empty);
  options.flag("--spectrum", wanted->spectrum,
               "Compute the eigenvalues too: all of them up to 2,000 points (half a minute),\n"
               "beyond the outermost ones");
  declare_table_output(
      options, wanted->output,
      "OUT.csv or OUT.vtu: the input's columns and what is known of each row:\n"
      "neighbours, support_used, reciprocal_condition, outcome (0 as asked, 1 lowered,\n"
      "2 widened, 3 zero), degree, amplification, negative_share, residual,\n"
      "error_bound (times the largest derivative of u of the order above the scheme's\n"
      "degree; nan in rows that promise less)");
  options.examples(
      "Example: gradpsi inspect points.csv --scheme laplacian-mixed-soc --support-ratio 3 "
      "-o rows.vtu");
  return [wanted] { run(*wanted); };
}

}  // namespace gradpsi::apps
