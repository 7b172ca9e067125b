// gradpsi assemble: a scheme's matrices on the points of a file, as Matrix Market.

#include <memory>
#include <optional>

#include "commands.hpp"
#include "common/outputs.hpp"

namespace gradpsi::apps {

namespace {

using std::filesystem::path;

/// OUT.mtx for a Laplacian; OUT_x.mtx, OUT_y.mtx, OUT_z.mtx for a gradient, and so on.
std::vector<path> matrix_files(const path& output, const Scheme& scheme, const std::string& axes) {
  std::vector<path> files;
  for (const std::string& component : component_names(scheme, axes)) {
    if (component.empty()) return {output};
    if (output.extension() != ".mtx")
      throw BadUsage("-o", "of a " + std::string(name(scheme.derivative)) +
                               " must end in .mtx, not be " + output.string());
    files.push_back(
        path(output).replace_filename(output.stem().string() + '_' + component + ".mtx"));
  }
  return files;
}

void run(OperatorOptions options, const std::optional<std::string>& what, const path& output) {
  settle(options, what);
  const Scheme scheme = options.scheme;
  Report report;
  Problem problem = read_problem(options, report);
  const auto files = matrix_files(output, scheme, problem.axes);
  check_outputs(options, files);
  assemble(options, problem, report);
  write_and_report(options, report, problem.table.has("support"), files,
                   [&] { write_matrix_market(files, problem.op.axes); });
}

}  // namespace

std::function<void()> declare_assemble(Options& options) {
  auto wanted = std::make_shared<OperatorOptions>();
  auto output = std::make_shared<path>();
  auto what = std::make_shared<std::optional<std::string>>();
  wanted->declare(options);
  declare_derivative(options, *what);
  options
      .file("-o", *output, "OUT.mtx",
            "Where to; a gradient writes OUT_x.mtx, OUT_y.mtx and OUT_z.mtx,\n"
            "a Hessian OUT_xx.mtx, OUT_xy.mtx and so on")
      .required();
  options.examples(
      "Example: gradpsi assemble points.csv --scheme gradient-direct-foc --support-ratio 3 -o "
      "grad.mtx");
  return [=] { run(*wanted, *what, *output); };
}

}  // namespace gradpsi::apps
