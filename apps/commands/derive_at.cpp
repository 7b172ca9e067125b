#include "commands/derive_at.hpp"

#include <gradpsi/error.hpp>
#include <gradpsi/interpolate.hpp>
#include <stdexcept>
#include <string>
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

/// What all points have along an axis in which they do not differ; 0 where they have no such column.
double common(const Problem& points, const std::string& axis) {
  return points.table.has(axis) ? points.table.column(axis)[0] : 0;
}

/// The probes by the points' axes. What all points have in common, the probes must have, too.
Positions positions(const Table& probes, const Problem& points) {
  Positions x(probes.values.rows(), std::ssize(points.axes));
  for (std::size_t a = 0; a < points.axes.size(); ++a)
    x.col(static_cast<Eigen::Index>(a)) = probes.column(std::string(1, points.axes[a]));
  for (const std::string axis : {"x", "y", "z"}) {
    if (points.axes.find(axis) != points.axes.npos || !probes.has(axis) || points.cloud.size() == 0)
      continue;
    const double all = common(points, axis);
    const DenseVector own = probes.column(axis);
    for (Eigen::Index k = 0; k < own.size(); ++k)
      if (own[k] != all)
        throw InvalidInput("probe " + std::to_string(k) + " has " + axis + " = " + text(own[k]) +
                           (points.table.has(axis) ? ", all points " + axis + " = " + text(all)
                                                   : ", the points have no " + axis));
  }
  return x;
}

/// Whether the points that each probe needs, instead of those within the support that is given, are enough.
std::string remedy(const Scheme& scheme, const Problem& points, const Positions& x,
                   const InterpolationOptions& options) {
  try {
    interpolate(scheme, points.cloud, x, DenseVector(), options);
    return "; without a support, each probe has one that computes it";
  } catch (const std::exception&) {
    return "";
  }
}

}  // namespace

Problem at_probes(const OperatorOptions& options, const std::filesystem::path& probes,
                  const Problem& points, Report& report) {
  check(options);
  const Scheme scheme = options.scheme;
  Notes said;
  const Table table = read_columns(probes, "", said);
  warn(said, report);
  const Positions x = naming(probes, [&] { return positions(table, points); });
  const InterpolationOptions how{.kernel = kernel(options.kernel), .threads = options.threads};
  const bool given = has_support(options, points.table);
  Stopwatch watch;
  Operator op;
  try {
    op = interpolate(scheme, points.cloud, x, given ? supports(options, points) : Eigen::VectorXd(),
                     how);
  } catch (const StencilError& error) {
    throw std::runtime_error(error.what() + (given ? remedy(scheme, points, x, how) : ""));
  }
  Problem result{{table, Cloud(x), 0, points.axes}, {}, std::move(op)};
  report.seconds.weights = watch.lap();
  report.probes = x.rows();
  describe(result.op, result, report);
  return result;
}

}  // namespace gradpsi::apps
