#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "search/grid.hpp"

namespace gradpsi {

constexpr int past_end = 8;  // vector code reads and writes up to so many elements past an end
constexpr int leaves_per_chunk = 64;  // one task of a thread

struct Leaf {
  int begin, end;  // in tree order
};

/// Points as structure of arrays, with room for vector code past the end.
template <int D>
struct PointArrays {
  std::array<std::vector<double>, D> x;
  std::vector<int> number;  // of the point in the cloud

  void resize(std::size_t n) {
    for (auto& coordinate : x) coordinate.resize(n + past_end);
    number.resize(n + past_end);
  }
  std::array<const double*, D> coordinates() const {
    std::array<const double*, D> all;
    for (int a = 0; a < D; ++a) all[a] = x[a].data();
    return all;
  }
};

/// The points in units of a power of two near the `length` that matters: the scaling is exact, and
/// squared distances cannot overflow or vanish where they are compared. A k-d tree in each cell of a
/// grid: they are small enough for the caches and are built in parallel.
template <int D>
class Tree {
 public:
  Tree(const Cloud& cloud, double length, int threads);
  Tree(const Tree&) = delete;
  ~Tree();

  int size() const { return static_cast<int>(ordered_.number.size()) - past_end; }
  double to_units(double length) const;
  double to_length(double units) const;
  const Point<D>& box() const { return box_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// The points in tree order; those of a leaf ascend.
  const PointArrays<D>& points() const { return ordered_; }
  /// How far about `count` points lie around one of the leaf, if they are as dense as in its box; if that is
  /// flat, as in the box of all.
  double likely_reach(Leaf leaf, int count) const;
  int number(int k) const { return ordered_.number[k]; }
  Point<D> point(int k) const {
    Point<D> x;
    for (int a = 0; a < D; ++a) x[a] = ordered_.x[a][k];
    return x;
  }

  /// Some points in these units, in the box where it is periodic.
  std::vector<Point<D>> scaled(const Cloud& cloud, int threads) const;

  /// Leaves that can hold points of the box, in tree order, in place of what is in `found`. `cells` is
  /// memory that can be used again.
  void leaves_in(const Box<D>& box, std::vector<int>& cells, std::vector<Leaf>& found) const;

 private:
  class Block;

  std::vector<Point<D>> scaled(const Cloud& cloud, const Positions& positions, int threads) const;
  void build(const std::vector<Point<D>>& points, int c, std::vector<Leaf>& leaves);

  int exponent_;
  Point<D> box_;
  std::optional<Grid<D>> grid_;
  std::vector<std::unique_ptr<Block>> blocks_;
  std::vector<Leaf> leaves_;
  PointArrays<D> ordered_;
};

/// A tree for when all distances matter, not those within a support.
template <int D>
Tree<D> tree_of_all(const Cloud& cloud, int threads) {
  const double extent = cloud.positions().cwiseAbs().maxCoeff();
  return {cloud, extent > 0 ? extent : 1, threads};
}

}  // namespace gradpsi
