#include "commands/derive_at.hpp"

#include <gradpsi/interpolate.hpp>
#include <utility>

#include "common/stopwatch.hpp"

namespace gradpsi::apps {

namespace {

void check(const OperatorOptions& options) {
  for (const auto& [given, name] :
       {std::pair(options.on_surface, "--on-surface"),
        std::pair(options.symmetric_support, "--symmetric-support"),
        std::pair(options.on_degenerate.has_value(), "--on-degenerate")})
    if (given) throw BadUsage(name, "is for rows of the points, not for probes (--at)");
}

/// The probes by the points' axes. What all points have in common, the probes must have, too.
Positions positions(const Table& probes, const Problem& points) {
  Positions x(probes.values.rows(), std::ssize(points.axes));
  for (std::size_t a = 0; a < points.axes.size(); ++a)
    x.col(static_cast<Eigen::Index>(a)) = probes.column(std::string(1, points.axes[a]));
  for (const std::string axis : {"x", "y", "z"}) {
    if (points.axes.find(axis) != points.axes.npos || !points.table.has(axis) ||
        !probes.has(axis) || points.cloud.size() == 0)
      continue;
    const double common = points.table.column(axis)[0];
    const DenseVector own = probes.column(axis);
    for (Eigen::Index k = 0; k < own.size(); ++k)
      if (own[k] != common)
        throw InvalidInput("probe " + std::to_string(k) + " has " + axis + " = " + text(own[k]) +
                           ", all points " + axis + " = " + text(common));
  }
  return x;
}

}  // namespace

Problem at_probes(const OperatorOptions& options, const std::filesystem::path& probes,
                  const Problem& points, Report& report) {
  check(options);
  const Scheme scheme = options.scheme;
  const Table table = read_table(probes);
  const Positions x = positions(table, points);
  const Eigen::VectorXd h = supports(options, points);
  Stopwatch watch;
  Operator op = interpolate(scheme, points.cloud, x, h,
                            {.kernel = kernel(options.kernel), .threads = options.threads});
  Problem result{{table, Cloud(x), 0, points.axes}, {}, std::move(op)};
  report.seconds.weights = watch.lap();
  report.probes = x.rows();
  describe(result.op, result, report);
  return result;
}

}  // namespace gradpsi::apps
