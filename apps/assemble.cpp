// gradpsi assemble: a scheme's matrices on the points of a file, as Matrix Market.

#include <memory>

#include "commands.hpp"
#include "operator_options.hpp"

namespace {

using std::filesystem::path;

/// OUT.mtx for a Laplacian, OUT_x.mtx, OUT_y.mtx, OUT_z.mtx for a gradient.
std::vector<path> matrix_files(const path& output, const gradpsi::Scheme& scheme,
                               std::size_t axes) {
  if (scheme.derivative == gradpsi::Derivative::Laplacian) return {output};
  std::vector<path> files;
  for (const char* axis : {"_x", "_y", "_z"}) {
    if (files.size() == axes) break;
    path name = output.stem();
    name += axis;
    name += output.extension();
    files.push_back(path(output).replace_filename(name));
  }
  return files;
}

void run(const OperatorOptions& options, const path& output) {
  const gradpsi::Scheme scheme = options.scheme;
  Problem problem = read_points(options);
  assemble(options, problem);
  const auto& axes = problem.op.axes;
  write_and_report(options, problem, output, [&] {
    gradpsi::write_matrix_market(matrix_files(output, scheme, axes.size()), axes);
  });
}

}  // namespace

void add_assemble(CLI::App& app) {
  auto* command = app.add_subcommand("assemble", "Write a scheme's matrices as Matrix Market.");
  auto options = std::make_shared<OperatorOptions>();
  auto output = std::make_shared<path>();
  options->add_to(*command);
  command
      ->add_option("-o", *output, "OUT.mtx; a gradient writes OUT_x.mtx, OUT_y.mtx and OUT_z.mtx")
      ->required();
  command->footer(
      "Example: gradpsi assemble points.csv --scheme gradient-direct-foc --support 0.1 -o "
      "grad.mtx");
  command->callback([=] { run(*options, *output); });
}
