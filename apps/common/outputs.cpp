#include "common/outputs.hpp"

#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <iostream>

#include "common/stopwatch.hpp"

namespace gradpsi::apps {

using std::filesystem::path;

Option declare_table_output(Options& options, path& output, const std::string& description) {
  return options.file("-o", output, "OUT", description)
      .check([](const std::string& name) -> std::string {
        std::string endings;
        for (const TableFormat& format : table_formats())
          endings += (endings.empty() ? "" : " or ") + std::string(format.ending);
        if (std::ranges::find(table_formats(), path(name).extension().string(),
                              &TableFormat::ending) == table_formats().end())
          return "must end in " + endings;
        // They would end up in scripts and XML.
        const auto control = [](unsigned char c) { return c < 32; };
        return std::ranges::any_of(name, control) ? "must not have control characters" : "";
      });
}

namespace {

/// Whether both names lead to one existing file, pipe or device.
bool same_file(const path& a, const path& b) {
  struct stat first, second;
  return ::stat(a.c_str(), &first) == 0 && ::stat(b.c_str(), &second) == 0 &&
         first.st_dev == second.st_dev && first.st_ino == second.st_ino;
}

}  // namespace

void check_outputs(const OperatorOptions& options, std::vector<path> files, const path& probes) {
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
    if (same_file(file, probes))
      throw InvalidInput(file.string() + " is the file of the probes; it is not overwritten");
  }
  for (path& file : files)
    file = std::filesystem::weakly_canonical(std::filesystem::absolute(file), ignored);
  std::ranges::sort(files);
  if (const auto twice = std::ranges::adjacent_find(files); twice != files.end())
    throw InvalidInput("two results, or a result and the report, are both to be written to " +
                       twice->string());
}

std::int64_t peak_memory() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss * std::int64_t{1024};
}

void write_report(const OperatorOptions& options, Report& report) {
  report.peak_bytes = peak_memory();
  if (!options.report.empty()) write_text(options.report, json(report));
}

void write_and_report(const OperatorOptions& options, Report& report, bool support_column,
                      const std::vector<path>& files, const std::function<void()>& write) {
  Stopwatch watch;
  write();
  report.seconds.write = watch.lap();
  write_report(options, report);
  print_summary(options, report, support_column, files);
}

namespace {

void print_degenerate(const DegenerateRows& degenerate, bool chosen) {
  std::cout << (chosen ? "rows that miss the tolerance: " : "degenerate rows: ")
            << degenerate.count() << ", of them " << degenerate.lowered
            << (chosen ? " the best there are, " : " lowered in consistency, ")
            << degenerate.widened << " widened, " << degenerate.zero << " zero; points";
  for (std::size_t k = 0; k < std::min<std::size_t>(degenerate.rows.size(), 10); ++k)
    std::cout << ' ' << degenerate.rows[k].point;
  std::cout << (degenerate.count() > 10 ? " ...\n" : "\n");
}

/// What was assembled.
std::string title(const OperatorOptions& options, const Report& report) {
  if (!options.tolerance) return options.scheme;
  return std::string(name(Scheme(options.scheme).derivative)) + " good to " +
         text(report.tolerance) + " for waves of length " + report.wavelength;
}

}  // namespace

std::string words(const std::map<std::string, std::int64_t>& schemes) {
  std::string result;
  for (const auto& [scheme, rows] : schemes)
    result += (result.empty() ? "" : ", ") + scheme.substr(scheme.find('-') + 1) + ' ' +
              std::to_string(rows);
  return result;
}

bool print_summary(const OperatorOptions& options, const Report& report, bool support_column,
                   const std::vector<path>& files) {
  for (const path& file : files)
    if (same_file(file, "/dev/stdout")) return false;
  std::cout << title(options, report) << ": "
            << (report.rows ? std::to_string(*report.rows) + " of " : "") << report.points
            << " points, " << (report.probes ? std::to_string(*report.probes) + " probes, " : "")
            << report.entries << " entries a matrix, "
            << (report.degenerate.zero > 0
                    ? count(report.degenerate.zero, "row") + " zero for want of an answer, "
                    : "")
            << "written to";
  for (const path& file : files) std::cout << ' ' << file.string();
  std::cout << '\n';
  if (report.dropped_points > 0)
    std::cout << "coincident points dropped: " << report.dropped_points << '\n';
  if ((options.support || options.support_ratio || options.neighbours) && support_column)
    std::cout << "supports are those of the column 'support', not of the option\n";
  if (report.supports_differ && !options.symmetric_support &&
      symmetry(options.scheme) != Symmetry::None)
    std::cout << "supports differ, so that the matrix is not " << name(symmetry(options.scheme))
              << " after scaling by volume; with --symmetric-support it is\n";
  if (report.largest_error && !report.schemes.empty())
    std::cout << "rows by " << words(report.schemes) << "; largest error " << *report.largest_error
              << '\n';
  if (degree(options.scheme) > 0 && report.worst)
    std::cout << "smallest reciprocal condition number " << report.worst->reciprocal_condition
              << (report.probes ? ", at probe " : ", at point ") << report.worst->point << '\n';
  if (report.degenerate.count() > 0)
    print_degenerate(report.degenerate, report.largest_error.has_value());
  return true;
}

}  // namespace gradpsi::apps
