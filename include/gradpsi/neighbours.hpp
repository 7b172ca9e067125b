#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/kernel.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Who is within whose support: compressed rows, ascending in each row, the point itself absent.
/// Built once, shared by every scheme.
struct Neighbours {
  Eigen::VectorXi offsets;   ///< n + 1; row i is indices[offsets[i]] .. indices[offsets[i + 1] - 1]
  Eigen::VectorXi indices;   ///< 0-based points
  Eigen::VectorXd supports;  ///< h: one for all points, or n, one per row
  /// All points, near ones close to one another: the order in which rows are worked on, for the sake of
  /// the caches; no result depends on it. Empty: 0, 1, 2, ..
  Eigen::VectorXi order = {};

  /// The number of points, n.
  int size() const { return static_cast<int>(offsets.size()) - 1; }
  /// The number of neighbours of point i.
  int count(int i) const { return offsets[i + 1] - offsets[i]; }
  /// h of point i.
  double support(int i) const { return supports[supports.size() == 1 ? 0 : i]; }
  /// The neighbours of point i, ascending.
  std::span<const int> of(int i) const {
    return {indices.data() + offsets[i], static_cast<std::size_t>(count(i))};
  }
};

/// All j != i with |x_j - x_i| < h, the shortest image counting in periodic directions.
/// Cost: O(n log n) for the k-d tree, then O(neighbours).
///
/// @param cloud    n points
/// @param support  h > 0 (a length), in periodic directions at most half the box
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if h is out of range; if points coincide (names the first pair and the
///   count); if most points have no neighbour (gives the median nearest distance); if there would
///   be more entries than an int can count (gives the bytes it would take)
Neighbours find_neighbours(const Cloud& cloud, double support, int threads = 0);

/// The same with one support per row: j is a neighbour of i if |x_j - x_i| < supports[i].
/// @param cloud     n points
/// @param supports  n lengths > 0, or one for all
/// @param threads   0: as many as OpenMP offers
/// @throws InvalidInput  as above
Neighbours find_neighbours(const Cloud& cloud, const Eigen::VectorXd& supports, int threads = 0);

/// The same for some points only; the lists of the others are left empty.
/// @param cloud     n points
/// @param supports  n lengths > 0, or one for all
/// @param rows      0-based points, each once
/// @param threads   0: as many as OpenMP offers
/// @throws InvalidInput  as above, but not for points without a neighbour; if a row is out of range or there
///   twice
Neighbours find_neighbours(const Cloud& cloud, const Eigen::VectorXd& supports,
                           const std::vector<int>& rows, int threads = 0);

/// Distance from each point to the nearest other one (n lengths; infinity for a lone point). O(n log n).
/// @throws InvalidInput  if `threads` is out of range (so does number_density_volumes())
Eigen::VectorXd nearest_distances(const Cloud& cloud, int threads = 0);

/// Volumes by number density, V_i = 1 / sum_j W_ij, j = i included, with row i's support (n, length^d).
/// @throws InvalidInput  if `near` belongs to another number of points, or a volume is beyond a double
Eigen::VectorXd number_density_volumes(const Cloud& cloud, const Neighbours& near,
                                       const Kernel& kernel = kernels().front(), int threads = 0);

}  // namespace gradpsi
#pragma GCC visibility pop
