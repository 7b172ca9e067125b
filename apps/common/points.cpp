#include "common/points.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <gradpsi/error.hpp>
#include <limits>
#include <map>
#include <numeric>
#include <sstream>
#include <utility>

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

/// What the dropped points had that those in the same place, which are kept, do not: nothing, if all is equal.
Notes differing_duplicates(const Table& table, const Cloud& all, const std::vector<int>& kept) {
  const auto place = [&](int i) {
    std::array<double, 3> x{};
    for (int a = 0; a < all.dimension(); ++a) x[a] = all.positions()(i, a) + 0.0;  // -0 is 0
    return x;
  };
  std::map<std::array<double, 3>, int> keeper;
  for (const int i : kept) keeper.emplace(place(i), i);
  Eigen::VectorXd most = Eigen::VectorXd::Zero(table.values.cols());
  int differing = 0;
  for (int i = 0; i < all.size(); ++i) {
    const auto found = keeper.find(place(i));
    if (found == keeper.end() || found->second == i) continue;
    const Eigen::VectorXd off = (table.values.row(i) - table.values.row(found->second)).cwiseAbs();
    differing += (off.array() > 0).any();
    most = most.cwiseMax(off);
  }
  if (differing == 0) return {};
  std::string columns;
  for (Eigen::Index c = 0; c < most.size(); ++c)
    if (most[c] > 0)
      columns +=
          (columns.empty() ? "" : ", ") + ("'" + table.names[c] + "' by up to ") + text(most[c]);
  return {std::to_string(differing) +
          " dropped points differ from the one in their place that is kept: " + columns};
}

/// Leaves out all but the first of each group of coincident points, and notes what that loses.
void drop_duplicates(const PointOptions& options, Points& points) {
  const Cloud all = std::move(points.cloud);
  const std::vector<int> kept = distinct_points(all);
  const Table table = points.table.select(kept);
  points.cloud = make_cloud(table, cloud_options(options, table));
  points.dropped = all.size() - points.cloud.size();
  for (std::string& note : differing_duplicates(points.table, all, kept))
    points.notes.push_back(std::move(note));
  points.table = table;
}

/// The column that one of this name is likely to be meant for; null: none.
const char* likely_meaning(std::string name) {
  std::ranges::transform(name, name.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (name == "h" || name == "smoothing_length" || name == "support") return "support";
  if (name == "m" || name == "mass" || name == "rho" || name == "density" || name == "vol" ||
      name == "volume")
    return "volume";
  return nullptr;
}

}  // namespace

void PointOptions::declare_points(Options& options) {
  options
      .file("POINTS", points, "CSV",
            "CSV with a header: x, y, z; volume and support if there are; fields. Or with ;, tabs\n"
            "or blanks between cells")
      .required();
  options.text("--columns", columns, "LIST",
               "NAME=COLUMN,..: other names of columns, as in x=\"Points:0\",support=radius; or\n"
               "x,y,T: the names of all columns, of a file without a header");
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
  Notes said;
  Points result{read_columns(options.points, options.columns, said), Cloud(Positions(0, 1))};
  result.cloud = make_cloud(result.table, cloud_options(options, result.table));
  const Extent span = extent(result.cloud);
  result.notes = std::move(said);
  for (std::string& note : notes(result.table, result.cloud, span))
    result.notes.push_back(std::move(note));
  if (options.duplicates == "drop") drop_duplicates(options, result);
  result.axes = differing_axes(result.cloud, span);
  result.cloud = with_axes(result.cloud, result.axes);
  return result;
}

Extent extent(const Cloud& cloud) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Extent result;
  result.least.fill(infinity);
  result.most.fill(-infinity);
  for (int a = 0; a < cloud.dimension() && cloud.size() > 0; ++a) {
    result.least[a] = cloud.positions().col(a).minCoeff();
    result.most[a] = cloud.positions().col(a).maxCoeff();
  }
  return result;
}

std::string differing_axes(const Cloud& cloud, const Extent& extent) {
  std::string axes;
  for (int a = 0; a < cloud.dimension(); ++a)
    if (extent.least[a] < extent.most[a] || cloud.box()[a] > 0) axes += "xyz"[a];
  return axes.empty() ? std::string("xyz").substr(0, cloud.dimension()) : axes;
}

Cloud with_axes(const Cloud& cloud, const std::string& axes) {
  if (std::ssize(axes) == cloud.dimension()) return cloud;
  Positions positions(cloud.size(), std::ssize(axes));
  CloudOptions options{.volumes = cloud.volumes()};
  for (std::size_t k = 0; k < axes.size(); ++k) {
    positions.col(static_cast<Eigen::Index>(k)) = cloud.positions().col(axes[k] - 'x');
    options.box[k] = cloud.box()[axes[k] - 'x'];
  }
  for (int i = 0; i < cloud.size(); ++i) options.numbers.push_back(cloud.number(i));
  return Cloud(std::move(positions), std::move(options));
}

Notes notes(const Table& table, const Cloud& cloud, const Extent& extent) {
  Notes result;
  const std::string axes = differing_axes(cloud, extent);
  if (std::ssize(axes) < cloud.dimension()) {
    std::string constant;
    for (int a = 0; a < cloud.dimension(); ++a)
      if (const char axis = "xyz"[a]; axes.find(axis) == axes.npos)
        constant += (constant.empty() ? "" : " and ") + std::string(1, axis) + " = " +
                    text(extent.least[a]);
    result.push_back("all points have " + constant + ": they are taken as points in " +
                     std::to_string(axes.size()) + "D");
  }
  for (int a = 0; a < cloud.dimension(); ++a)
    if (const double period = cloud.box()[a], span = extent.most[a] - extent.least[a];
        period > 0 && span > period)
      result.push_back("the points span " + text(span) + " in " + "xyz"[a] +
                       ", more than the periodic box, " + text(period) +
                       ": layers of them lie upon one another");
  for (const std::string& name : table.names)
    if (const char* const meant = likely_meaning(name); meant && !table.has(meant))
      result.push_back("column '" + name + "' is taken as a field: what it may be meant for is " +
                       "read from a column '" + meant + "'");
  return result;
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

std::string count(Eigen::Index n, const std::string& what) {
  return std::to_string(n) + ' ' + what + (n == 1 ? "" : "s");
}

std::string spacing_text(const Eigen::VectorXd& spacing) {
  const double least = spacing.minCoeff(), most = spacing.maxCoeff();
  return text(least) + (least < most ? " to " + text(most) : "");
}

std::string text(double x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

double longest_wave(const Cloud& cloud) {
  const auto [least, most] = extent(cloud);
  double longest = 0;
  for (int a = 0; a < cloud.dimension(); ++a)
    longest = std::max(longest, cloud.box()[a] > 0 ? cloud.box()[a] : most[a] - least[a]);
  return longest;
}

}  // namespace gradpsi::apps
