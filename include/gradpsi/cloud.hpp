#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gradpsi/dense.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// What points may have beside their positions.
struct CloudOptions {
  /// n volumes omega_j > 0 (length^d). Empty: assemble() takes number_density_volumes().
  DenseVector volumes = {};
  /// Lengths of a periodic box that starts at the origin; 0: open in that direction.
  std::array<double, 3> box = {0, 0, 0};
  /// n numbers: what points are called in messages, where they are some of a larger cloud's.
  /// Empty: 0, 1, 2, ..
  std::vector<std::int64_t> numbers = {};
};

/// Points with their volumes in open space or a periodic box. Valid from construction on: finite
/// coordinates, positive volumes, sizes that agree. That no two points coincide is checked by
/// find_neighbours(), for which it costs nothing; distinct_points() removes such points beforehand.
class Cloud {
 public:
  /// @param positions  n x d, n >= 0; with a periodic box, points outside it stand for their image
  /// @param options    volumes and box
  /// @throws InvalidInput  naming the point or the argument
  explicit Cloud(Positions positions, CloudOptions options = {});

  /// Puts the points somewhere else, in the memory they have.
  /// @throws InvalidInput  if the size is another one, or a coordinate is not finite; all is then as before
  void move_to(const Positions& positions);

  int size() const { return static_cast<int>(positions_.rows()); }       ///< n
  int dimension() const { return static_cast<int>(positions_.cols()); }  ///< d
  const Positions& positions() const { return positions_; }              ///< n x d, as given
  bool has_volumes() const { return volumes_.size() > 0; }               ///< or volumes() is empty
  const DenseVector& volumes() const { return volumes_; }                ///< n, or empty
  const std::array<double, 3>& box() const { return box_; }              ///< 0: open
  /// What point i is called in messages; i, if it has no other number.
  std::int64_t number(int i) const { return numbers_.empty() ? i : numbers_[i]; }

  /// (mean volume)^(1/d) when there are volumes, else the median distance to the nearest neighbour
  /// (a length; computed at each call with a k-d tree, n log n).
  /// @param threads  0: as many as OpenMP offers
  /// @throws InvalidInput  without volumes and with fewer than two points, or if most coincide; if `threads`
  ///   is out of range
  double spacing(int threads = 0) const;

 private:
  Positions positions_;
  DenseVector volumes_;
  std::array<double, 3> box_;
  std::vector<std::int64_t> numbers_;
};

/// Indices of the points that remain, ascending, when of each group of coincident points (equal
/// coordinates, up to the periods of the box) all but the first are dropped. n log n.
std::vector<int> distinct_points(const Cloud& cloud);

/// The same points in another order: point k of `cloud` is point order[k] of the one it was made from.
struct Reordered {
  Cloud cloud;             ///< the points, with their volumes and box
  std::vector<int> order;  ///< n numbers of points, each once
};

/// Puts points that are near one another close together in memory (leaf by leaf of a k-d tree). Products
/// with matrices of points that came in random order take several times as long. n log n.
/// @param cloud    n points in any order
/// @param threads  0: as many as OpenMP offers
/// @throws InvalidInput  if `threads` is out of range
Reordered reorder(const Cloud& cloud, int threads = 0);

/// A jittered lattice for studies: points at the centres of equal cells.
struct Lattice {
  int dimension = 2;         ///< d, 1 to 3
  int points_per_side = 10;  ///< at least 1
  double lower = 0;          ///< the domain is [lower, upper]^d
  double upper = 1;          ///< greater than lower
  double jitter = 0;         ///< each coordinate moves by up to +-jitter cells, uniformly; >= 0
  std::uint64_t seed = 1;    ///< same seed, same points, on every platform
  bool periodic = false;     ///< in all directions; needs lower = 0
  /// Points are drawn together towards the centre: spacings are so many times smaller there than along the
  /// faces (across the faces they are twice those along them); >= 1, and 1 in periodic boxes.
  double grading = 1;
};

/// The lattice's points, last coordinate fastest, with volumes dx^d, dx = (upper - lower) /
/// points_per_side, or of what the grading makes of such cells.
/// @throws InvalidInput  if a number is outside its range
Cloud make_cloud(const Lattice& lattice);

}  // namespace gradpsi
#pragma GCC visibility pop
