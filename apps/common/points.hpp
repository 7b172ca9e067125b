#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <gradpsi/cloud.hpp>
#include <gradpsi/io.hpp>
#include <gradpsi/kernel.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/cli.hpp"
#include "common/named.hpp"

// The points of a file.

namespace gradpsi::apps {

/// The options that say what the points are, the same in every command.
struct PointOptions {
  std::filesystem::path points;
  std::string columns;
  std::string kernel = std::string(kernels().front().name);
  std::optional<double> volume;
  std::array<double, 3> periodic = {0, 0, 0};
  std::string duplicates = "error";
  int threads = 0;

  void declare_points(Options& options);
};

/// Volumes and box of a table's points.
CloudOptions cloud_options(const PointOptions& options, const Table& table);

struct Points {
  Table table;
  Cloud cloud;
  std::int64_t dropped = 0;  ///< coincident with one before
  std::string axes = "xyz";  ///< the names of the cloud's coordinates come first
  Notes notes = {};
};
/// The points of the file, coincident ones dropped if so wished. A coordinate that is the same for all of them
/// is left out of the cloud.
Points read_points(const PointOptions& options);

/// The least and the largest coordinates of some points; of none, +infinity and -infinity.
struct Extent {
  std::array<double, 3> least, most;
};
Extent extent(const Cloud& cloud);

/// The coordinates in which points of this extent differ, "xy" for those in a plane of constant z, but for
/// periodic ones; all of them where points do not differ at all.
std::string differing_axes(const Cloud& cloud, const Extent& extent);

/// The same points with these coordinates only.
Cloud with_axes(const Cloud& cloud, const std::string& axes);

/// What about the extent and the columns deserves a note.
Notes notes(const Table& table, const Cloud& cloud, const Extent& extent);

/// A column of the points, all its values finite. Errors name points by their numbers in the cloud.
Eigen::VectorXd finite_column(const Table& table, const Cloud& cloud, const std::string& name);

/// Points that have a 0 in this column; without a column all.
std::vector<int> evolving_points(const Points& points, const std::string& fixed);

/// "3 rows"
std::string count(Eigen::Index n, const std::string& what);

/// local_spacing() in words: "0.1", or "0.01 to 0.1".
std::string spacing_text(const Eigen::VectorXd& spacing);

/// A number as the terminal shows it, six digits.
std::string text(double x);

/// A wave as long as the points' bounding box, or as the box where it is periodic.
double longest_wave(const Cloud& cloud);

}  // namespace gradpsi::apps
