#pragma once

#include <span>
#include <string>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// Who is within whose support: compressed rows, ascending in each row, the point itself absent.
/// Built once, shared by every scheme.
struct Neighbours {
  IndexVector offsets;   ///< n + 1; row i is indices[offsets[i]] .. indices[offsets[i + 1] - 1]
  IndexVector indices;   ///< 0-based points
  DenseVector supports;  ///< h: one for all points, or n, one per row
  /// All points, near ones close to one another: the order in which rows are worked on, for the sake of
  /// the caches; no result depends on it. Empty: 0, 1, 2, ..
  IndexVector order = {};
  /// How far lists reach beyond the supports, for points that move; 0: not at all. Points between h and
  /// h + skin are in the lists without being neighbours: entries of matrices that are 0 until they come nearer.
  double skin = 0;
  Positions places = {};  ///< with a skin, where the points were when these were found (n x d)

  /// The number of points, n.
  int size() const { return static_cast<int>(offsets.size()) - 1; }
  /// The number of neighbours of point i, and of points in its skin.
  int count(int i) const { return offsets[i + 1] - offsets[i]; }
  /// h of point i.
  double support(int i) const { return supports[supports.size() == 1 ? 0 : i]; }
  /// The neighbours of point i, with those in its skin, ascending.
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
/// @throws InvalidInput  if h or `threads` is out of range; if points coincide (names the first pair and the
///   count); if most points have no neighbour (gives the median nearest distance); if there would
///   be more entries than an int can count (gives the bytes it would take)
Neighbours find_neighbours(const Cloud& cloud, double support, int threads = 0);

/// The same with one support per row: j is a neighbour of i if |x_j - x_i| < supports[i].
/// @param cloud     n points
/// @param supports  n lengths > 0, or one for all
/// @param threads   0: as many as OpenMP offers
/// @throws InvalidInput  as above; if the least is not 1e-145 of the largest (their squares are not comparable)
Neighbours find_neighbours(const Cloud& cloud, const VectorView& supports, int threads = 0);

/// The same for some points only; the lists of the others are left empty.
/// @param cloud     n points
/// @param supports  n lengths > 0, or one for all
/// @param rows      0-based points, each once
/// @param threads   0: as many as OpenMP offers
/// @throws InvalidInput  as above, but not for points without a neighbour; if a row is out of range or there
///   twice
Neighbours find_neighbours(const Cloud& cloud, const VectorView& supports,
                           const std::vector<int>& rows, int threads = 0);

/// How far lists are to reach beyond the supports.
struct Skin {
  double width;  ///< > 0 (a length)
};

/// The same with a skin: as long as no point has moved by more than half of it, every neighbour is in the
/// lists, and reassemble() gives what these points' own lists would give, on a pattern that stays.
/// Lists are longer by about (1 + skin / h)^d.
/// @throws InvalidInput  as above; if the width is not > 0, or h and skin are more than half a periodic box
Neighbours find_neighbours(const Cloud& cloud, double support, Skin skin, int threads = 0);
/// The same with one support per row.
Neighbours find_neighbours(const Cloud& cloud, const VectorView& supports, Skin skin,
                           int threads = 0);

/// Whether a point has moved by more than half the skin since `near` was found, the shortest image counting
/// in periodic directions: a neighbour may then be missing, and whatever takes `near` refuses it. One pass over
/// the positions.
/// @param near     found with a skin
/// @param cloud    the same n points, where they are now
/// @param threads  0: as many as OpenMP offers
/// @throws InvalidInput  if `near` has no skin or is of other points, or `threads` is out of range
bool is_stale(const Neighbours& near, const Cloud& cloud, int threads = 0);

/// Distance from each point to the nearest other one (n lengths; infinity for a lone point). O(n log n).
/// @param cloud    n points
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if `threads` is out of range
DenseVector nearest_distances(const Cloud& cloud, int threads = 0);

/// Distance from each point to its k-th nearest other one (n lengths): with a hair more as supports, each
/// has k neighbours at least. O(n log n).
/// @param cloud    n points
/// @param k        1 to n - 1
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if `k` or `threads` is out of range
DenseVector kth_nearest_distances(const Cloud& cloud, int k, int threads = 0);

/// The spacing of the points where they are. One length, Cloud::spacing(), where points lie as evenly as
/// jittered or random ones; else n: volume^(1/d), or without volumes what the distance to the twelfth
/// nearest point tells, such that the median is Cloud::spacing(). Of two points, one among the other's
/// nearest, neither has more than 1.5 times the other's: the smaller one is raised, but for the sake of a
/// point that is among nobody's. So find_neighbours(cloud, 3 * local_spacing(cloud)) has supports that
/// vary slowly. O(n log n).
/// @param cloud    n points
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  as Cloud::spacing()
DenseVector local_spacing(const Cloud& cloud, int threads = 0);

/// Points whose nearest neighbour is nearer than this part of the usual distance are worth a warning.
inline constexpr double much_closer = 0.01;

/// So are coordinates whose rounding is this part of the usual distance or more.
inline constexpr double much_rounded = 1e-6;

/// What about the points deserves a warning, a sentence each; mostly nothing. "Usual" is the median of
/// nearest_distances(), which is what this costs, where supports differ in units of the support; points
/// without neighbours do not count.
///
/// - Pairs much closer than is usual. Weights that grow like 1/r or 1/r^2 (diffuse) are dominated by them,
///   and explicit time steps are limited.
/// - Coordinates so far from the origin that they have lost digits: they are rounded by eps |x|, which
///   moves points by the part eps |x| / dx of their distance. A first derivative is off by up to that part of
///   |grad u|, a Laplacian by that part of |grad u| / dx. What is computed from them does not lose more,
///   since only differences enter.
///
/// @param cloud    n points
/// @param near     their neighbours: the supports count
/// @param threads  0: as many as OpenMP offers; the result does not depend on it
/// @throws InvalidInput  if `near` belongs to another number of points or `threads` is out of range
std::vector<std::string> warnings(const Cloud& cloud, const Neighbours& near, int threads = 0);

}  // namespace gradpsi
#pragma GCC visibility pop
