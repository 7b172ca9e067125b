// gradpsi diffuse: implicit diffusion, or the steady problem, with a scheme's Laplacian; and gradpsi-mpi
// diffuse, by several processes.

#include "commands/diffuse.hpp"

#include <iostream>

#include "common/diffusion.hpp"
#include "common/outputs.hpp"
#include "common/steps.hpp"
#include "common/stopwatch.hpp"

namespace gradpsi::apps {

namespace {

using std::filesystem::path;

/// Where the field goes at last.
path result_file(const DiffuseOptions& options, const Machine& machine) {
  return options.output.extension() == ".csv" ? options.output : options.beside(machine.ending());
}

/// Files numbered by step, and the .pvd that lists them with their times.
class Series {
 public:
  Series(const DiffuseOptions& options, Machine& machine) : options_(options), machine_(machine) {}

  void write(const Table& table, int step) {
    const path file = options_.numbered(step, machine_.ending()), list = options_.beside(".pvd");
    machine_.together([&] { check_outputs(options_, {file, list}); });
    machine_.write(options_, file, table);
    written_.emplace_back(step * *options_.time_step, file);
    machine_.together([&] {
      if (machine_.is_first()) write_pvd(list, written_);
    });
  }

 private:
  const DiffuseOptions& options_;
  Machine& machine_;
  std::vector<std::pair<double, path>> written_;
};

/// The report, its times and memory the largest of all processes.
void write_report(const DiffuseOptions& options, const Machine& machine, Report& report) {
  Seconds& seconds = report.seconds;
  for (double* stage : {&seconds.read, &seconds.search, &seconds.weights, &seconds.write})
    *stage = machine.largest(*stage);
  report.peak_bytes =
      static_cast<std::int64_t>(machine.largest(static_cast<double>(peak_memory())));
  machine.together([&] {
    if (machine.is_first() && !options.report.empty()) write_text(options.report, json(report));
  });
}

/// What there is to say before the first step.
void say_before(const Machine& machine, const Diffusion& heat) {
  const SolverReport solver = heat.solver();  // which all processes are asked for
  if (!machine.is_first()) return;
  for (const std::string& remark : heat.remarks) std::cout << remark << '\n';
  if (!solver.caution.empty())
    std::cerr << "warning: " << name(solver.method) << " may not converge: " << solver.caution
              << '\n';
}

void run(DiffuseOptions options, Machine& machine) {
  options.settle("laplacian");
  options.check();
  const path result = result_file(options, machine), picture = options.beside(".png");
  std::vector<path> files = machine.parts(result);
  files.push_back(picture);
  check_outputs(options, files);
  Report report;
  machine.read(options, report);
  const Eigen::VectorXd start = column(machine, options.field);
  const Range before = range(machine, start);
  Eigen::VectorXd u = start;
  const Diffusion heat = diffusion(options, machine, report);
  say_before(machine, heat);

  Series series(options, machine);
  const auto keep = [&](int step) {
    if (options.keeps(step)) series.write(machine.table_with(options.field, u), step);
  };
  keep(0);
  report.steps = make_steps(options, machine, heat, start, u, keep);
  report.solver = heat.solver();

  Stopwatch watch;
  const Table& table = machine.table_with(options.field, u);
  machine.write(options, result, table);
  report.seconds.write = watch.lap();
  write_report(options, machine, report);
  const bool drawn = machine.draw(picture, table, options.field, options.title());
  const Range after = range(machine, u);
  const std::string note = range_note(options, machine, heat, start, after);
  if (!machine.is_first() ||
      !print_summary(options, report, machine.table().has("support"), {result}))
    return;
  print_solution(options, *report.solver, *report.steps, before, after, note);
  if (drawn)
    std::cout << "picture: " << picture.string() << '\n';
  else
    std::cout << "no picture: gnuplot could not draw one (is gnuplot-nox installed?)\n";
}

}  // namespace

std::function<void()> declare_diffuse(Options& options, const DiffuseProgram& program) {
  auto wanted = std::make_shared<DiffuseOptions>();
  wanted->declare_diffusion(options, program.output, program.call);
  return [wanted, machine = program.machine] { run(*wanted, *machine()); };
}

std::function<void()> declare_diffuse(Options& options) {
  return declare_diffuse(
      options, {.call = "gradpsi",
                .output = "OUT.csv or OUT.vtu: the input's columns, the field as it is at last; "
                          "and a\npicture of it, OUT.png",
                .machine = one_process});
}

}  // namespace gradpsi::apps
