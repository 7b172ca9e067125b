#pragma once

#include <gradpsi/petsc.hpp>
#include <optional>

#include "common/points.hpp"
#include "mpi/processes.hpp"

namespace gradpsi::apps {

/// This process's share of the file's points, and who owns them.
struct Given {
  Table table;
  std::int64_t first = 0, all = 0;  ///< number of its first point, and of points in the file
  std::int64_t dropped = 0;         ///< points of all processes that coincide with one before
  std::string axes = "xyz";         ///< differing_axes() of all points
  Notes said = {};                  ///< about the columns
  Notes notes = {};                 ///< all
  std::optional<petsc::Partition> partition;
};
Given read_share(const PointOptions& options);

}  // namespace gradpsi::apps
