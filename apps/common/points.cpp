#include "common/points.hpp"

#include <charconv>
#include <cmath>
#include <gradpsi/error.hpp>
#include <numeric>
#include <sstream>

namespace gradpsi::apps {

namespace {

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

void PointOptions::declare_points(Options& options) {
  options
      .file("POINTS", points, "CSV",
            "CSV with a header: x, y, z; volume and support if there are; fields")
      .required();
  std::string names;
  for (const auto& k : kernels()) names += (names.empty() ? "" : ", ") + std::string(k.name);
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

CloudOptions cloud_options(const PointOptions& options, const Table& table) {
  CloudOptions result;
  if (options.volume) {
    if (!(*options.volume > 0 && std::isfinite(*options.volume)))
      throw InvalidInput("--volume must be > 0 and finite, not " + text(*options.volume));
    result.volumes = Eigen::VectorXd::Constant(table.values.rows(), *options.volume);
  }
  result.box = options.periodic;
  return result;
}

Points read_points(const PointOptions& options) {
  Table table = read_table(options.points);
  Cloud cloud = make_cloud(table, cloud_options(options, table));
  const int read = cloud.size();
  if (options.duplicates == "drop") {
    table = table.select(distinct_points(cloud));
    cloud = make_cloud(table, cloud_options(options, table));
  }
  const int dropped = read - cloud.size();
  return {std::move(table), std::move(cloud), dropped};
}

Eigen::VectorXd finite_column(const Table& table, const Cloud& cloud, const std::string& name) {
  Eigen::VectorXd values = table.column(name);
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i]))
      throw InvalidInput("point " + std::to_string(cloud.number(static_cast<int>(i))) +
                         " has a value of '" + name + "' that is not finite");
  return values;
}

std::vector<int> evolving_points(const Points& points, const std::string& fixed) {
  std::vector<int> evolving(points.cloud.size());
  std::iota(evolving.begin(), evolving.end(), 0);
  if (fixed.empty()) return evolving;
  const Eigen::VectorXd held = finite_column(points.table, points.cloud, fixed);
  std::erase_if(evolving, [&](int i) { return held[i] != 0; });
  return evolving;
}

std::string text(double x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

}  // namespace gradpsi::apps
