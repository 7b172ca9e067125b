#include "common/operator_options.hpp"

#include <omp.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <sstream>
#include <utility>

#include "../../lib/base/stopwatch.hpp"

namespace gradpsi::apps {

using gradpsi::InvalidInput;
using gradpsi::Stopwatch;
using std::filesystem::path;

gradpsi::CloudOptions cloud_options(const OperatorOptions& options, const gradpsi::Table& table) {
  gradpsi::CloudOptions result;
  if (options.volume) {
    if (!(*options.volume > 0 && std::isfinite(*options.volume)))
      throw InvalidInput("--volume must be > 0 and finite, not " + text(*options.volume));
    result.volumes = Eigen::VectorXd::Constant(table.values.rows(), *options.volume);
  }
  result.box = options.periodic;
  return result;
}

Eigen::VectorXd supports(const OperatorOptions& options, const gradpsi::Table& table,
                         const std::function<double()>& spacing) {
  if (table.has("support")) return table.column("support");
  if (options.support) return Eigen::VectorXd::Constant(1, *options.support);
  const auto ratio =
      options.support_ratio ? options.support_ratio : gradpsi::support_ratio(options.scheme);
  if (!ratio)
    throw InvalidInput(options.points.string() +
                       " has no column 'support': give --support or --support-ratio");
  if (!(*ratio > 0 && std::isfinite(*ratio)))
    throw InvalidInput("--support-ratio must be > 0 and finite, not " + text(*ratio));
  return Eigen::VectorXd::Constant(1, *ratio * spacing());
}

nlohmann::ordered_json degenerate_rows(const gradpsi::Operator& op, const gradpsi::Cloud& cloud) {
  const gradpsi::RowReport& rows = op.rows;
  nlohmann::ordered_json result = {{"lowered", 0}, {"widened", 0}, {"zero", 0}};
  auto list = nlohmann::ordered_json::array();
  for (int k = 0; k < static_cast<int>(rows.outcome.size()); ++k) {
    if (rows.outcome[k] == gradpsi::RowOutcome::AsAsked) continue;
    const std::string outcome(name(rows.outcome[k]));
    result[outcome] = result[outcome].get<int>() + 1;
    list.push_back({{"point", cloud.number(op.points.empty() ? k : op.points[k])},
                    {"outcome", outcome},
                    {"degree", rows.degree[k]},
                    {"neighbours", rows.neighbours[k]},
                    {"support", rows.supports[k]},
                    {"reciprocal_condition", rows.reciprocal_condition[k]}});
  }
  result["rows"] = std::move(list);
  return result;
}

namespace {

nlohmann::ordered_json neighbour_counts(const gradpsi::Neighbours& near) {
  std::vector<int> counts(near.size());
  for (int i = 0; i < near.size(); ++i) counts[i] = near.count(i);
  if (counts.empty()) counts = {0};
  std::ranges::sort(counts);
  const int twice_median = counts[(counts.size() - 1) / 2] + counts[counts.size() / 2];
  nlohmann::ordered_json median = twice_median / 2;
  if (twice_median % 2 != 0) median = twice_median / 2.0;
  return {{"min", counts.front()}, {"median", median}, {"max", counts.back()}};
}

/// Whether both names lead to one existing file, pipe or device.
bool same_file(const path& a, const path& b) {
  struct stat first, second;
  return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 &&
         first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}

/// LX[,LY[,LZ]]
std::array<double, 3> lengths(const std::string& text) {
  std::array<double, 3> result = {0, 0, 0};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (double& length : result) {
    const auto [rest, error] = std::from_chars(at, end, length);
    if (error != std::errc() || (rest != end && *rest != ',')) break;
    if (rest == end) return result;
    at = rest + 1;
  }
  throw BadUsage("--periodic", "expected LX[,LY[,LZ]], not '" + text + "'");
}

}  // namespace

std::string text(double x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

void OperatorOptions::declare_points(Options& options) {
  options
      .file("POINTS", points, "CSV",
            "CSV with a header: x, y, z; volume and support if there are; fields")
      .required();
  std::string names;
  for (const auto& k : gradpsi::kernels())
    names += (names.empty() ? "" : ", ") + std::string(k.name);
  options.text("--kernel", kernel, "NAME", "One of " + names);
  options.number("--volume", volume, "V",
                 "Every point's volume, where there is no column `volume`; without either, the\n"
                 "number density 1 / sum_j W_ij is used");
  options.parsed(
      "--periodic", [this](const std::string& given) { periodic = lengths(given); }, "LX[,LY[,LZ]]",
      "Lengths of a periodic box from the origin, at least twice the support; 0: open in\n"
      "that direction. Points outside stand for their image");
  options.choice("--duplicates", duplicates, {"error", "drop"}, "POLICY",
                 "Coincident points: error, or drop all but the first of each group");
  options.count("--threads", threads, thread_limits, "N", "0: as many as there are");
}

void OperatorOptions::declare(Options& options) {
  declare_points(options);
  options.text("--scheme", scheme, "NAME", "One of those that `gradpsi schemes` lists").required();
  const Option absolute = options.number(
      "--support", support, "H", "Support radius h, a length: the kernel is 0 from r = h on");
  options
      .number("--support-ratio", support_ratio, "K",
              "Support radius as a multiple of the spacing: (mean volume)^(1/d), or without\n"
              "volumes the median distance to the nearest point. A column `support`, one h a\n"
              "point, goes before either; ls-P and positive can do without: P + 1/2, 5/2")
      .excludes(absolute);
  options.choice(
      "--on-degenerate", on_degenerate, {"fail", "lower", "widen", "zero"}, "POLICY",
      "Rows that cannot be solved: fail, lower their consistency, widen their support up\n"
      "to three times, or leave them zero [fail; widen where no support is given]");
  options.file("--report", report, "FILE.json", "Write sizes, times and memory to this JSON file");
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
  auto report = first_report(options, cloud.size(), points_read - cloud.size(), watch.lap());
  return {std::move(table), std::move(cloud), {}, {}, std::move(report)};
}

nlohmann::ordered_json first_report(const OperatorOptions& options, std::int64_t points,
                                    std::int64_t dropped, double read_seconds) {
  // The order of the keys is that of the specification; later steps fill them in.
  return {{"points", points},
          {"entries", 0},
          {"neighbours", {}},
          {"seconds", {{"read", read_seconds}, {"search", 0.0}, {"weights", 0.0}, {"write", 0.0}}},
          {"degenerate_rows", 0},
          {"dropped_points", dropped},
          {"peak_bytes", 0},
          {"threads", options.threads > 0 ? options.threads : omp_get_max_threads()}};
}

gradpsi::AssemblyOptions assembly_options(const OperatorOptions& options,
                                          const gradpsi::Table& table) {
  using gradpsi::OnDegenerate;
  const bool given = options.support || options.support_ratio || table.has("support");
  const std::string policy = options.on_degenerate.value_or(given ? "fail" : "widen");
  return {.kernel = gradpsi::kernel(options.kernel),
          .on_degenerate = policy == "fail"    ? OnDegenerate::Fail
                           : policy == "lower" ? OnDegenerate::Lower
                           : policy == "widen" ? OnDegenerate::Widen
                                               : OnDegenerate::Zero,
          .threads = options.threads};
}

gradpsi::Operator assembled(const OperatorOptions& options, gradpsi::AssemblyOptions assembly,
                            const std::vector<int>& unused, int points, const Assemble& assemble) {
  if (assembly.on_degenerate != gradpsi::OnDegenerate::Fail)
    return assemble(options.scheme, assembly);
  assembly.on_degenerate = gradpsi::OnDegenerate::Zero;
  gradpsi::Operator op = assemble(options.scheme, assembly);
  std::vector<char> used(points, true);
  for (const int i : unused) used[i] = false;
  assembly.on_degenerate = gradpsi::OnDegenerate::Fail;
  assembly.rows.emplace();
  for (int k = 0; k < static_cast<int>(op.rows.outcome.size()); ++k) {
    const int i = op.points.empty() ? k : op.points[k];
    if (used[i] && op.rows.outcome[k] == gradpsi::RowOutcome::Zero) assembly.rows->push_back(i);
  }
  assemble(options.scheme, assembly);  // throws if there are any
  return op;
}

std::string advice(const gradpsi::StencilError& error, const nlohmann::ordered_json& report) {
  std::string message = error.what();
  if (report["dropped_points"] > 0) message += " (dropped points are not counted)";
  return message + "; try a larger support or --on-degenerate widen";
}

void assemble(const OperatorOptions& options, Problem& problem, const std::vector<int>& unused) {
  const gradpsi::AssemblyOptions assembly = assembly_options(options, problem.table);
  Stopwatch watch;
  const bool empty = problem.cloud.size() == 0;  // no rows, no supports
  const Eigen::VectorXd h = supports(
      options, problem.table, [&] { return empty ? 1 : problem.cloud.spacing(options.threads); });
  problem.near = gradpsi::find_neighbours(problem.cloud, h, options.threads);
  for (const std::string& warning :
       gradpsi::warnings(problem.cloud, problem.near, options.threads)) {
    std::cerr << "warning: " << warning << '\n';
    problem.report["warnings"].push_back(warning);
  }
  problem.report["seconds"]["search"] = watch.lap();
  const auto assemble = [&](const gradpsi::Scheme& scheme, const gradpsi::AssemblyOptions& rows) {
    return gradpsi::assemble(scheme, problem.cloud, problem.near, rows);
  };
  try {
    problem.op = unused.empty()
                     ? assemble(options.scheme, assembly)
                     : assembled(options, assembly, unused, problem.cloud.size(), assemble);
  } catch (const gradpsi::StencilError& error) {
    throw std::runtime_error(advice(error, problem.report));
  }
  problem.report["seconds"]["weights"] = watch.lap();
  problem.report["entries"] = problem.op.matrix().nonZeros();
  problem.report["neighbours"] = neighbour_counts(problem.near);
  problem.report["degenerate_rows"] = problem.op.rows.degenerate();
  if (problem.op.rows.degenerate() > 0)
    problem.report["degenerate"] = degenerate_rows(problem.op, problem.cloud);
  if (const auto& conditions = problem.op.rows.reciprocal_condition; conditions.size() > 0) {
    Eigen::Index worst;
    const double least = conditions.minCoeff(&worst);
    problem.worst = {least, worst};
  }
}

Eigen::VectorXd finite_column(const gradpsi::Table& table, const gradpsi::Cloud& cloud,
                              const std::string& name) {
  Eigen::VectorXd values = table.column(name);
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      throw InvalidInput("point " + std::to_string(cloud.number(static_cast<int>(i))) +
                         " has a value of '" + name + "' that is not finite");
  return values;
}

Option declare_table_output(Options& options, path& output, const std::string& description) {
  return options.file("-o", output, "OUT", description).check([](const std::string& name) {
    const auto extension = path(name).extension();
    if (extension != ".csv" && extension != ".vtu") return "must end in .csv or .vtu";
    // They would end up in scripts and XML.
    const auto control = [](unsigned char c) { return c < 32; };
    return std::ranges::any_of(name, control) ? "must not have control characters" : "";
  });
}

void write_table(const path& file, const gradpsi::Table& table) {
  file.extension() == ".vtu" ? write_vtu(file, table) : write_csv(file, table);
}

void check_outputs(const OperatorOptions& options, std::vector<path> files) {
  if (!options.report.empty()) files.push_back(options.report);
  std::error_code ignored;
  for (const path& file : files) {
    const path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (!std::filesystem::is_directory(folder, ignored))
      throw InvalidInput("cannot write " + file.string() + ": there is no folder " +
                         folder.string());
    if (std::filesystem::is_directory(file, ignored))
      throw InvalidInput("cannot write " + file.string() + ": it is a folder");
    if (same_file(file, options.points))
      throw InvalidInput(file.string() + " is the file of the points; it is not overwritten");
  }
  for (path& file : files)
    file = std::filesystem::weakly_canonical(std::filesystem::absolute(file), ignored);
  std::ranges::sort(files);
  if (const auto twice = std::ranges::adjacent_find(files); twice != files.end())
    throw InvalidInput("two results, or a result and the report, are both to be written to " +
                       twice->string());
}

void write_report(const OperatorOptions& options, Problem& problem) {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  problem.report["peak_bytes"] = usage.ru_maxrss * 1024L;
  if (!options.report.empty()) gradpsi::write_text(options.report, problem.report.dump(2) + "\n");
}

bool write_and_report(const OperatorOptions& options, Problem& problem,
                      const std::vector<path>& files, const std::function<void()>& write) {
  Stopwatch watch;
  write();
  auto& report = problem.report;
  report["seconds"]["write"] = watch.lap();
  write_report(options, problem);
  return print_summary(options, report, problem.worst, problem.table.has("support"), files);
}

bool print_summary(const OperatorOptions& options, const nlohmann::ordered_json& report,
                   const WorstRow& worst, bool support_column, const std::vector<path>& files) {
  for (const path& file : files)
    if (same_file(file, "/dev/stdout")) return false;
  std::cout << options.scheme << ": " << report["points"] << " points, " << report["entries"]
            << " entries a matrix, written to";
  for (const path& file : files) std::cout << ' ' << file.string();
  std::cout << '\n';
  if (report["dropped_points"] > 0)
    std::cout << "coincident points dropped: " << report["dropped_points"] << '\n';
  if ((options.support || options.support_ratio) && support_column)
    std::cout << "supports are those of the column 'support', not of the option\n";
  if (gradpsi::Scheme(options.scheme).consistency != gradpsi::Consistency::Zoc && worst)
    std::cout << "smallest reciprocal condition number " << worst->first << ", at point "
              << worst->second << '\n';
  if (report.contains("degenerate")) {
    const auto& degenerate = report["degenerate"];
    const auto number = [&](const char* outcome) {
      return degenerate[outcome].get<std::int64_t>();
    };
    const std::int64_t count = number("lowered") + number("widened") + number("zero");
    std::cout << "degenerate rows: " << count << ", of them " << degenerate["lowered"]
              << " lowered in consistency, " << degenerate["widened"] << " widened, "
              << degenerate["zero"] << " zero; points";
    for (std::size_t k = 0; k < std::min<std::size_t>(degenerate["rows"].size(), 10); ++k)
      std::cout << ' ' << degenerate["rows"][k]["point"];
    std::cout << (count > 10 ? " ...\n" : "\n");
  }
  return true;
}

}  // namespace gradpsi::apps
