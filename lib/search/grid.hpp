#pragma once

#include <array>
#include <vector>

namespace gradpsi {

template <int D>
using Point = std::array<double, D>;

template <int D>
struct Box {
  Point<D> low, high;
};

/// A coarse grid over the points, a few thousand to a cell, and the points sorted by cell. Cells are
/// numbered so that near ones have near numbers.
template <int D>
class Grid {
 public:
  Grid(const std::vector<Point<D>>& points, int threads);

  int cells() const { return static_cast<int>(number_.size()); }
  /// The points of cell c are sorted()[begin(c)] .. sorted()[begin(c + 1) - 1].
  int begin(int c) const { return begin_[c]; }
  const std::vector<int>& sorted() const { return sorted_; }

  /// Appends the cells that can hold points of the box.
  void cells_in(const Box<D>& box, std::vector<int>& found) const;

 private:
  void divide(const Box<D>& box, int wanted);
  void number_along_curve(int cells);
  void sort(const std::vector<Point<D>>& points, int threads);
  int along(int a, double x) const;
  int cell_of(const Point<D>& x) const;

  Point<D> low_, per_cell_;
  std::array<int, D> count_;
  std::vector<int> number_;  // of a cell, by its coordinates
  std::vector<int> begin_, sorted_;
};

}  // namespace gradpsi
