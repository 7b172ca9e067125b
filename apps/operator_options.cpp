#include "operator_options.hpp"

#include <omp.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <utility>

using gradpsi::InvalidInput;

namespace {

/// Seconds since the last call, or since construction.
class Stopwatch {
 public:
  double lap() {
    const auto now = Clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

gradpsi::CloudOptions cloud_options(const OperatorOptions& options, const gradpsi::Table& table) {
  gradpsi::CloudOptions result;
  if (options.volume) {
    if (!(*options.volume > 0)) throw InvalidInput("--volume must be > 0");
    result.volumes = Eigen::VectorXd::Constant(table.values.rows(), *options.volume);
  }
  if (options.periodic.size() > 3) throw InvalidInput("--periodic takes at most three lengths");
  std::ranges::copy(options.periodic, result.box.begin());
  return result;
}

Eigen::VectorXd supports(const OperatorOptions& options, const gradpsi::Table& table,
                         const gradpsi::Cloud& cloud) {
  if (table.has("support")) return table.column("support");
  if (options.support) return Eigen::VectorXd::Constant(1, *options.support);
  if (!options.support_ratio)
    throw InvalidInput(options.points.string() +
                       " has no column 'support': give --support or --support-ratio");
  if (!(*options.support_ratio > 0)) throw InvalidInput("--support-ratio must be > 0");
  if (cloud.size() == 0) return {};  // no rows, no supports
  return Eigen::VectorXd::Constant(1, *options.support_ratio * cloud.spacing());
}

nlohmann::ordered_json neighbour_counts(const gradpsi::Neighbours& near) {
  std::vector<int> counts(near.size());
  for (int i = 0; i < near.size(); ++i) counts[i] = near.count(i);
  if (counts.empty()) return {{"min", 0}, {"median", 0}, {"max", 0}};
  const auto middle = counts.begin() + near.size() / 2;
  std::ranges::nth_element(counts, middle);
  return {
      {"min", std::ranges::min(counts)}, {"median", *middle}, {"max", std::ranges::max(counts)}};
}

}  // namespace

void OperatorOptions::add_to(CLI::App& command) {
  command
      .add_option("POINTS", points,
                  "CSV with a header: x, y, z; volume and support if there are; fields")
      ->required();
  command.add_option("--scheme", scheme, "One of those that `gradpsi schemes` lists")->required();
  auto* absolute = command.add_option("--support", support, "Support radius h, a length");
  command
      .add_option("--support-ratio", support_ratio,
                  "Support radius as a multiple of the spacing: (mean volume)^(1/d), or without\n"
                  "volumes the median distance to the nearest point. A column `support`, one h a\n"
                  "point, goes before either")
      ->excludes(absolute);
  std::string names;
  for (const auto& k : gradpsi::kernels())
    names += (names.empty() ? "" : ", ") + std::string(k.name);
  command.add_option("--kernel", kernel, "One of " + names)->capture_default_str();
  command.add_option(
      "--volume", volume,
      "Every point's volume, where there is no column `volume`; without either, the\n"
      "number density 1 / sum_j W_ij is used");
  command
      .add_option("--periodic", periodic,
                  "LX[,LY[,LZ]]: lengths of a box from the origin; 0: open in that direction")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      .add_option("--on-degenerate", on_degenerate,
                  "Rows whose moment system cannot be solved: fail, lower their consistency, or\n"
                  "leave them zero")
      ->check(CLI::IsMember({"fail", "lower", "zero"}))
      ->capture_default_str();
  command
      .add_option("--duplicates", duplicates,
                  "Coincident points: error, or drop all but the first of each group")
      ->check(CLI::IsMember({"error", "drop"}))
      ->capture_default_str();
  command.add_option("--threads", threads, "0: as many as there are")->capture_default_str();
  command.add_option("--report", report, "Write sizes, times and memory to this JSON file");
}

Problem read_points(const OperatorOptions& options) {
  Stopwatch watch;
  gradpsi::Table table = gradpsi::read_csv(options.points);
  gradpsi::Cloud cloud = gradpsi::make_cloud(table, cloud_options(options, table));
  const int points_read = cloud.size();
  if (options.duplicates == "drop") {
    table = table.select(gradpsi::distinct_points(cloud));
    cloud = gradpsi::make_cloud(table, cloud_options(options, table));
  }
  // The order of the keys is that of the specification; later steps fill them in.
  nlohmann::ordered_json report = {
      {"points", cloud.size()},
      {"entries", 0},
      {"neighbours", {}},
      {"seconds", {{"read", watch.lap()}, {"search", 0.0}, {"weights", 0.0}, {"write", 0.0}}},
      {"degenerate_rows", 0},
      {"dropped_points", points_read - cloud.size()},
      {"peak_bytes", 0},
      {"threads", options.threads > 0 ? options.threads : omp_get_max_threads()}};
  return {std::move(table), std::move(cloud), {}, std::move(report)};
}

void assemble(const OperatorOptions& options, Problem& problem) {
  const gradpsi::AssemblyOptions assembly{
      .kernel = gradpsi::kernel(options.kernel),
      .on_degenerate = options.on_degenerate == "fail"    ? gradpsi::OnDegenerate::Fail
                       : options.on_degenerate == "lower" ? gradpsi::OnDegenerate::Lower
                                                          : gradpsi::OnDegenerate::Zero,
      .threads = options.threads};
  const Eigen::VectorXd h = supports(options, problem.table, problem.cloud);
  Stopwatch watch;
  const auto near = gradpsi::find_neighbours(problem.cloud, h, options.threads);
  problem.report["seconds"]["search"] = watch.lap();
  problem.op = gradpsi::assemble(options.scheme, problem.cloud, near, assembly);
  problem.report["seconds"]["weights"] = watch.lap();
  problem.report["entries"] = problem.op.matrix().nonZeros();
  problem.report["neighbours"] = neighbour_counts(near);
  problem.report["degenerate_rows"] = problem.op.rows.degenerate();
}

void write_and_report(const OperatorOptions& options, Problem& problem,
                      const std::filesystem::path& output, const std::function<void()>& write) {
  Stopwatch watch;
  write();
  auto& report = problem.report;
  report["seconds"]["write"] = watch.lap();
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  report["peak_bytes"] = usage.ru_maxrss * 1024L;
  if (!options.report.empty()) gradpsi::write_text(options.report, report.dump(2) + "\n");

  std::cout << options.scheme << ": " << report["points"] << " points, " << report["entries"]
            << " entries a matrix, written to " << output.string() << '\n';
  if (report["dropped_points"] > 0)
    std::cout << report["dropped_points"] << " coincident points dropped\n";
  if (const auto& rows = problem.op.rows; rows.degenerate() > 0) {
    using gradpsi::RowOutcome;
    const auto count = [&](RowOutcome o) { return std::ranges::count(rows.outcome, o); };
    std::cout << rows.degenerate() << " degenerate rows: " << count(RowOutcome::LoweredToFoc)
              << " lowered to foc, " << count(RowOutcome::LoweredToZoc) << " lowered to zoc, "
              << count(RowOutcome::Zero) << " zero\n";
  }
}
