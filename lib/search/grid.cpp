#include "search/grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "base/parallel.hpp"

namespace gradpsi {
namespace {

constexpr int points_per_cell = 4096;  // about
constexpr int chunk = 1 << 15;         // points, one task of a thread

template <int D>
void extend(Box<D>& box, const Point<D>& x) {
  for (int a = 0; a < D; ++a) {
    box.low[a] = std::min(box.low[a], x[a]);
    box.high[a] = std::max(box.high[a], x[a]);
  }
}

int chunks(int points) { return (points + chunk - 1) / chunk; }

template <int D>
Box<D> box_of(const std::vector<Point<D>>& points, int threads) {
  const int n = static_cast<int>(points.size());
  std::vector<Box<D>> boxes(chunks(n));
  parallel_chunks(n, chunk, threads, [&](int begin, int end) {
    Box<D> box{points[begin], points[begin]};
    for (int i = begin; i < end; ++i) extend<D>(box, points[i]);
    boxes[begin / chunk] = box;
  });
  Box<D> all = boxes[0];
  for (const auto& box : boxes) extend<D>(all, box.low), extend<D>(all, box.high);
  return all;
}

}  // namespace

template <int D>
Grid<D>::Grid(const std::vector<Point<D>>& points, int threads) {
  const int n = static_cast<int>(points.size());
  divide(box_of<D>(points, threads), std::max(1, n / points_per_cell));
  sort(points, threads);
}

/// A counting sort, in chunks: where each chunk's points of each cell go.
template <int D>
void Grid<D>::sort(const std::vector<Point<D>>& points, int threads) {
  const int n = static_cast<int>(points.size());
  std::vector<int> cell(n), place(static_cast<std::size_t>(chunks(n)) * cells());
  parallel_chunks(n, chunk, threads, [&](int begin, int end) {
    int* const count = place.data() + static_cast<std::ptrdiff_t>(begin / chunk) * cells();
    for (int i = begin; i < end; ++i) ++count[cell[i] = cell_of(points[i])];
  });
  begin_.push_back(0);
  for (int c = 0, sum = 0; c < cells(); ++c) {
    for (int k = 0; k < chunks(n); ++k)
      sum += std::exchange(place[static_cast<std::size_t>(k) * cells() + c], sum);
    begin_.push_back(sum);
  }
  sorted_.resize(n);
  parallel_chunks(n, chunk, threads, [&](int begin, int end) {
    int* const to = place.data() + static_cast<std::ptrdiff_t>(begin / chunk) * cells();
    for (int i = begin; i < end; ++i) sorted_[to[cell[i]]++] = i;
  });
}

template <int D>
void Grid<D>::cells_in(const Box<D>& box, std::vector<int>& found) const {
  std::array<int, D> first, last;
  for (int a = 0; a < D; ++a) {
    first[a] = along(a, box.low[a]);
    last[a] = along(a, box.high[a]);
  }
  const auto loop = [&](auto&& self, int a, int flat) -> void {
    if (a == D) return found.push_back(number_[flat]);
    for (int c = first[a]; c <= last[a]; ++c) self(self, a + 1, flat * count_[a] + c);
  };
  loop(loop, 0, 0);
}

/// About so many cells, as nearly cubes as can be.
template <int D>
void Grid<D>::divide(const Box<D>& box, int wanted) {
  low_ = box.low;
  double edge = 0;
  for (int a = 0; a < D; ++a) edge = std::max(edge, box.high[a] - box.low[a]);
  const auto cells_of = [&](double length) {
    std::int64_t cells = 1;
    for (int a = 0; a < D; ++a) {
      count_[a] = static_cast<int>((box.high[a] - box.low[a]) / length) + 1;
      cells *= count_[a];
    }
    return cells;
  };
  // Points too far apart for their distance to be a double, or all in one place, are one cell.
  const bool divisible = wanted > 1 && edge > 0 && std::isfinite(edge);
  while (divisible && cells_of(edge / 1.1) <= wanted) edge /= 1.1;
  if (divisible)
    cells_of(edge);
  else
    count_.fill(1);
  int cells = 1;
  for (int a = 0; a < D; ++a) {
    per_cell_[a] = count_[a] > 1 ? 1 / edge : 0;
    cells *= count_[a];
  }
  number_along_curve(cells);
}

/// The cells along a Z-shaped curve: by their coordinates' bits, interleaved.
template <int D>
void Grid<D>::number_along_curve(int cells) {
  std::vector<std::pair<std::uint64_t, int>> curve(cells);
  for (int flat = 0; flat < cells; ++flat) {
    std::uint64_t code = 0;
    for (int a = D - 1, rest = flat; a >= 0; rest /= count_[a], --a)
      for (int bit = 0; bit < 21; ++bit)
        code |= static_cast<std::uint64_t>(rest % count_[a] >> bit & 1) << (bit * D + a);
    curve[flat] = {code, flat};
  }
  std::ranges::sort(curve);
  number_.resize(cells);
  for (int c = 0; c < cells; ++c) number_[curve[c].second] = c;
}

/// Rounding is monotonic: what lies between two numbers is in a cell between theirs.
template <int D>
int Grid<D>::along(int a, double x) const {
  const double cell = (x - low_[a]) * per_cell_[a];
  return cell > 0 ? std::min(static_cast<int>(std::min(cell, 1e9)), count_[a] - 1) : 0;
}

template <int D>
int Grid<D>::cell_of(const Point<D>& x) const {
  int flat = 0;
  for (int a = 0; a < D; ++a) flat = flat * count_[a] + along(a, x[a]);
  return number_[flat];
}

template class Grid<1>;
template class Grid<2>;
template class Grid<3>;

}  // namespace gradpsi
