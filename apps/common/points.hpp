#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <gradpsi/cloud.hpp>
#include <gradpsi/io.hpp>
#include <gradpsi/kernel.hpp>
#include <optional>
#include <string>

#include "common/cli.hpp"

// The points of a file.

namespace gradpsi::apps {

/// The options that say what the points are, the same in every command.
struct PointOptions {
  std::filesystem::path points;
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
};
/// The points of the file, coincident ones dropped if so wished.
Points read_points(const PointOptions& options);

/// A column of the points, all its values finite. Errors name points by their numbers in the cloud.
Eigen::VectorXd finite_column(const Table& table, const Cloud& cloud, const std::string& name);

/// Points that have a 0 in this column; without a column all.
std::vector<int> evolving_points(const Points& points, const std::string& fixed);

/// A number as the terminal shows it, six digits.
std::string text(double x);

}  // namespace gradpsi::apps
