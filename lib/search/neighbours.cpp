#include "gradpsi/neighbours.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <nanoflann.hpp>
#include <optional>
#include <ranges>
#include <string>
#include <utility>
#include <vector>

#include "base/cpu.hpp"
#include "base/dispatch.hpp"
#include "base/median.hpp"
#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "search/candidates.hpp"
#include "search/check.hpp"
#include "search/search.hpp"

namespace gradpsi {
namespace {

constexpr int leaf_size = 24;         // points; measured: 24 to 48 within a tenth, fewer are slower
constexpr int block_size = 4096;      // points of a tree, about
constexpr int leaves_per_chunk = 64;  // one task of a thread
constexpr int leaves_for_estimate = 64;
constexpr int lanes = 8;  // vector code reads and writes up to so many elements past an end

template <int D>
using Point = std::array<double, D>;

template <int D>
struct Box {
  Point<D> low, high;
};

struct Leaf {
  int begin, end;  // in tree order
};

/// Points as structure of arrays, with room for vector code past the end.
template <int D>
struct PointArrays {
  std::array<std::vector<double>, D> x;
  std::vector<int> number;  // of the point in the cloud

  void resize(std::size_t n) {
    for (auto& coordinate : x) coordinate.resize(n + lanes);
    number.resize(n + lanes);
  }
  std::array<const double*, D> coordinates() const {
    std::array<const double*, D> all;
    for (int a = 0; a < D; ++a) all[a] = x[a].data();
    return all;
  }
};

/// A coarse grid over the points, a few thousand to a cell, and the points sorted by cell. Cells are
/// numbered so that near ones have near numbers.
template <int D>
class Grid {
 public:
  Grid(const std::vector<Point<D>>& points, int threads) {
    const int n = static_cast<int>(points.size());
    const int chunk = 1 << 15, chunks = (n + chunk - 1) / chunk;
    std::vector<Box<D>> boxes(chunks);
    parallel_chunks(n, chunk, threads, [&](int begin, int end) {
      Box<D> box{points[begin], points[begin]};
      for (int i = begin; i < end; ++i) extend(box, points[i]);
      boxes[begin / chunk] = box;
    });
    Box<D> all = boxes[0];
    for (const auto& box : boxes) extend(all, box.low), extend(all, box.high);
    divide(all, std::max(1, n / block_size));

    // A counting sort, in chunks: where each chunk's points of each cell go.
    std::vector<int> cell(n), place(static_cast<std::size_t>(chunks) * cells());
    parallel_chunks(n, chunk, threads, [&](int begin, int end) {
      int* const count = place.data() + static_cast<std::ptrdiff_t>(begin / chunk) * cells();
      for (int i = begin; i < end; ++i) ++count[cell[i] = cell_of(points[i])];
    });
    begin_.push_back(0);
    for (int c = 0, sum = 0; c < cells(); ++c) {
      for (int k = 0; k < chunks; ++k)
        sum += std::exchange(place[static_cast<std::size_t>(k) * cells() + c], sum);
      begin_.push_back(sum);
    }
    sorted_.resize(n);
    parallel_chunks(n, chunk, threads, [&](int begin, int end) {
      int* const to = place.data() + static_cast<std::ptrdiff_t>(begin / chunk) * cells();
      for (int i = begin; i < end; ++i) sorted_[to[cell[i]]++] = i;
    });
  }

  int cells() const { return static_cast<int>(number_.size()); }
  /// The points of cell c are sorted()[begin(c)] .. sorted()[begin(c + 1) - 1].
  int begin(int c) const { return begin_[c]; }
  const std::vector<int>& sorted() const { return sorted_; }

  /// Appends the cells that can hold points of the box.
  void cells_in(const Box<D>& box, std::vector<int>& found) const {
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

 private:
  static void extend(Box<D>& box, const Point<D>& x) {
    for (int a = 0; a < D; ++a) {
      box.low[a] = std::min(box.low[a], x[a]);
      box.high[a] = std::max(box.high[a], x[a]);
    }
  }

  /// About so many cells, as nearly cubes as can be.
  void divide(const Box<D>& box, int wanted) {
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
    // The cells along a Z-shaped curve: by their coordinates' bits, interleaved.
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
  int along(int a, double x) const {
    const double cell = (x - low_[a]) * per_cell_[a];
    return cell > 0 ? std::min(static_cast<int>(std::min(cell, 1e9)), count_[a] - 1) : 0;
  }
  int cell_of(const Point<D>& x) const {
    int flat = 0;
    for (int a = 0; a < D; ++a) flat = flat * count_[a] + along(a, x[a]);
    return number_[flat];
  }

  Point<D> low_, per_cell_;
  std::array<int, D> count_;
  std::vector<int> number_;  // of a cell, by its coordinates
  std::vector<int> begin_, sorted_;
};

/// A k-d tree of nanoflann over some of the points.
template <int D>
class BlockTree {
 public:
  explicit BlockTree(std::vector<Point<D>> points)
      : points_{std::move(points)},
        index_(D, points_, nanoflann::KDTreeSingleIndexAdaptorParams(leaf_size)) {}
  BlockTree(const BlockTree&) = delete;

  /// Calls visit(begin, end) for the leaves, in tree order.
  template <class Visit>
  void for_each_leaf(const Visit& visit) const {
    if (root()) descend(*root(), nullptr, visit);
  }
  /// .. that can hold points of the box.
  template <class Visit>
  void for_each_leaf_in(const Box<D>& box, const Visit& visit) const {
    if (root()) descend(*root(), &box, visit);
  }

#if NANOFLANN_VERSION >= 0x150
  const std::vector<int>& order() const { return index_.vAcc_; }
#else
  const std::vector<int>& order() const { return index_.vAcc; }
#endif
  const Point<D>& point(int k) const { return points_.x[order()[k]]; }
  void drop_points() { std::vector<Point<D>>().swap(points_.x); }

 private:
  struct Points {
    std::vector<Point<D>> x;
    std::size_t kdtree_get_point_count() const { return x.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t a) const { return x[i][a]; }
    template <class Bounds>
    bool kdtree_get_bbox(Bounds&) const {
      return false;
    }
  };
  using Metric = nanoflann::L2_Simple_Adaptor<double, Points, double, int>;
  using Index = nanoflann::KDTreeSingleIndexAdaptor<Metric, Points, D, int>;
  using Node = typename Index::Node;

#if NANOFLANN_VERSION >= 0x150
  const Node* root() const { return index_.root_node_; }
#else
  const Node* root() const { return index_.root_node; }
#endif

  template <class Visit>
  static void descend(const Node& node, const Box<D>* box, const Visit& visit) {
    if (!node.child1) {
      const auto& range = node.node_type.lr;
      visit(static_cast<int>(range.left), static_cast<int>(range.right));
      return;
    }
    const auto& split = node.node_type.sub;
    if (!box || box->low[split.divfeat] <= split.divlow) descend(*node.child1, box, visit);
    if (!box || box->high[split.divfeat] >= split.divhigh) descend(*node.child2, box, visit);
  }

  Points points_;
  Index index_;
};

/// The points in units of a power of two near the `length` that matters: the scaling is exact, and
/// squared distances cannot overflow or vanish where they are compared. A k-d tree in each cell of a
/// grid: they are small enough for the caches and are built in parallel.
template <int D>
class Tree {
 public:
  Tree(const Cloud& cloud, double length, int threads)
      : exponent_(cloud.size() > 0 ? std::ilogb(length) : 0) {
    for (int a = 0; a < D; ++a) box_[a] = std::ldexp(cloud.box()[a], -exponent_);
    ordered_.resize(cloud.size());
    if (cloud.size() == 0) return;
    const std::vector<Point<D>> points = scaled(cloud, threads);
    grid_.emplace(points, threads);
    blocks_.resize(grid_->cells());
    std::vector<std::vector<Leaf>> leaves(blocks_.size());
    parallel_chunks(grid_->cells(), 1, threads, [&](int c, int) { build(points, c, leaves[c]); });
    for (const auto& of_block : leaves)
      leaves_.insert(leaves_.end(), of_block.begin(), of_block.end());
  }
  Tree(const Tree&) = delete;

  int size() const { return static_cast<int>(ordered_.number.size()) - lanes; }
  double to_units(double length) const { return std::ldexp(length, -exponent_); }
  double to_length(double units) const { return std::ldexp(units, exponent_); }
  const Point<D>& box() const { return box_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// The points in tree order; those of a leaf ascend.
  const PointArrays<D>& points() const { return ordered_; }
  int number(int k) const { return ordered_.number[k]; }
  Point<D> point(int k) const {
    Point<D> x;
    for (int a = 0; a < D; ++a) x[a] = ordered_.x[a][k];
    return x;
  }

  /// Calls visit(begin, end) for leaves that can hold points of the box, in tree order. `cells` is
  /// memory that can be used again.
  template <class Visit>
  void visit_leaves(const Box<D>& box, std::vector<int>& cells, const Visit& visit) const {
    cells.clear();
    grid_->cells_in(box, cells);
    std::ranges::sort(cells);
    for (const int c : cells)
      if (blocks_[c])
        blocks_[c]->for_each_leaf_in(box, [&](int begin, int end) {
          visit(grid_->begin(c) + begin, grid_->begin(c) + end);
        });
  }

 private:
  static std::vector<Point<D>> scaled(const Cloud& cloud, int exponent, int threads,
                                      const Positions& positions) {
    // In two steps, neither of which can overflow where the result does not.
    const double half = std::ldexp(1.0, -exponent / 2);
    const double rest = std::ldexp(1.0, -exponent - -exponent / 2);
    std::vector<Point<D>> x(cloud.size());
    parallel_chunks(cloud.size(), 1 << 15, threads, [&](int begin, int end) {
      for (int i = begin; i < end; ++i)
        for (int a = 0; a < D; ++a) {
          x[i][a] = positions.data()[std::ptrdiff_t{i} * D + a] * half * rest;
          if (!std::isfinite(x[i][a]))
            throw InvalidInput("a support near " + shortest(std::ldexp(1.0, exponent)) +
                               " is lost in the rounding of point " +
                               std::to_string(cloud.number(i)) + " at " +
                               coordinates(cloud.positions(), i));
        }
    });
    return x;
  }
  std::vector<Point<D>> scaled(const Cloud& cloud, int threads) const {
    const bool periodic =
        std::ranges::any_of(cloud.box(), [](double length) { return length > 0; });
    return periodic ? scaled(cloud, exponent_, threads, wrapped_positions(cloud))
                    : scaled(cloud, exponent_, threads, cloud.positions());
  }

  void build(const std::vector<Point<D>>& points, int c, std::vector<Leaf>& leaves) {
    const int first = grid_->begin(c), count = grid_->begin(c + 1) - first;
    if (count == 0) return;
    std::vector<Point<D>> own(count);
    const int* const number = grid_->sorted().data() + first;
    for (int k = 0; k < count; ++k) own[k] = points[number[k]];
    blocks_[c] = std::make_unique<BlockTree<D>>(std::move(own));
    BlockTree<D>& tree = *blocks_[c];
    std::vector<int> order = tree.order();
    tree.for_each_leaf([&](int begin, int end) {
      leaves.push_back({first + begin, first + end});
      std::sort(order.begin() + begin, order.begin() + end);  // so are their numbers, then
    });
    for (int k = 0; k < count; ++k) {
      const int i = number[order[k]];
      ordered_.number[first + k] = i;
      for (int a = 0; a < D; ++a) ordered_.x[a][first + k] = points[i][a];
    }
    tree.drop_points();
  }

  int exponent_;
  Point<D> box_;
  std::optional<Grid<D>> grid_;
  std::vector<std::unique_ptr<BlockTree<D>>> blocks_;
  std::vector<Leaf> leaves_;
  PointArrays<D> ordered_;
};

/// Calls visit(shift) for every combination of -length, 0, +length in the periodic directions.
template <int D, class Visit>
void for_each_image(const Point<D>& box, const Visit& visit) {
  Point<D> shift;
  const auto loop = [&](auto&& self, int a) -> void {
    if (a == D) return visit(shift);
    for (const int k : {-1, 0, 1}) {
      if (k != 0 && box[a] == 0) continue;
      shift[a] = k * box[a];
      self(self, a + 1);
    }
  };
  loop(loop, 0);
}

/// Finds the neighbours of all points of a leaf together: the trees are walked once for the leaf's
/// box widened by the support, and the candidates found, sorted once, are tested for each point.
template <int D>
class LeafSearch {
 public:
  /// Candidates, in no order, for those of the points from leaf.begin to leaf.end.
  void gather(const Tree<D>& tree, Leaf leaf, double reach) {
    Box<D> box{tree.point(leaf.begin), tree.point(leaf.begin)};
    for (int a = 0; a < D; ++a) {
      const double* const x = tree.points().x[a].data();
      for (int k = leaf.begin; k < leaf.end; ++k) {
        box.low[a] = std::min(box.low[a], x[k]);
        box.high[a] = std::max(box.high[a], x[k]);
      }
      box.low[a] -= reach, box.high[a] += reach;
    }
    count_ = 0;
    runs_.assign(1, 0);
    periodic_ = false;
    for_each_image<D>(tree.box(), [&](const Point<D>& shift) { gather(tree, box, shift); });
    make_room(lanes);
    for (int a = 0; a < D; ++a)
      std::fill_n(candidates_.x[a].begin() + count_, lanes,
                  std::numeric_limits<double>::infinity());
  }

  /// Sorts the candidates by number: they came in runs that ascend, which are merged two by two.
  void sort() {
    if (std::is_sorted(candidates_.number.begin(), candidates_.number.begin() + count_)) return;
    keys_.resize(count_);
    merged_.resize(count_);
    for (int c = 0; c < count_; ++c)
      keys_[c] = static_cast<std::uint64_t>(candidates_.number[c]) << 32 | static_cast<unsigned>(c);
    while (runs_.size() > 2) {
      std::size_t to = 1;
      for (std::size_t r = 0; r + 1 < runs_.size(); r += 2) {
        const std::size_t last = std::min(r + 2, runs_.size() - 1);
        merge(runs_[r], runs_[r + 1], runs_[last]);
        runs_[to++] = runs_[last];
      }
      runs_.resize(to);
      keys_.swap(merged_);
    }
    sorted_.resize(candidates_.number.size() - lanes);
    for (int c = 0; c < count_; ++c) {
      sorted_.number[c] = static_cast<int>(keys_[c] >> 32);
      for (int a = 0; a < D; ++a)
        sorted_.x[a][c] = candidates_.x[a][static_cast<std::uint32_t>(keys_[c])];
    }
    for (int a = 0; a < D; ++a)
      std::fill_n(sorted_.x[a].begin() + count_, lanes, std::numeric_limits<double>::infinity());
    std::swap(candidates_, sorted_);
  }

  struct Found {
    int count;
    bool coincides;
  };
  /// How many numbers select() can write.
  int most() const { return count_ + lanes; }
  /// Writes the neighbours of the point at x, in the candidates' order, unless another point has no
  /// distance from it.
  Found select(const Point<D>& x, double support, int* found) const {
    int coincident = 0;
    int count = code_.select[D - 1](coordinates().data(), candidates_.number.data(), count_,
                                    x.data(), support * support, found, &coincident);
    // At half a box, rounding can let two images of the same point pass.
    if (periodic_) count = static_cast<int>(std::unique(found, found + count) - found);
    return {coincident > 1 ? 0 : count, coincident > 1};
  }

  double nearest_squared(int i, const Point<D>& x) const {
    return code_.nearest[D - 1](coordinates().data(), candidates_.number.data(), count_, x.data(),
                                i);
  }

 private:
  std::array<const double*, D> coordinates() const { return candidates_.coordinates(); }

  void make_room(int more) {
    const auto wanted = static_cast<std::size_t>(count_ + more);
    if (candidates_.number.size() < wanted + lanes) candidates_.resize(2 * wanted);
  }

  void gather(const Tree<D>& tree, const Box<D>& box, const Point<D>& shift) {
    Box<D> image = box;
    for (int a = 0; a < D; ++a) image.low[a] -= shift[a], image.high[a] -= shift[a];
    const int before = count_;
    const auto from = tree.points().coordinates();
    tree.visit_leaves(image, cells_, [&](int begin, int end) {
      make_room(end - begin);
      std::array<double*, D> to;
      for (int a = 0; a < D; ++a) to[a] = candidates_.x[a].data() + count_;
      const int added = code_.filter[D - 1](from.data(), tree.points().number.data(), begin, end,
                                            image.low.data(), image.high.data(), shift.data(),
                                            to.data(), candidates_.number.data() + count_);
      if (added == 0) return;
      const bool ascends =
          count_ == 0 || candidates_.number[count_ - 1] < candidates_.number[count_];
      count_ += added;
      if (ascends && runs_.size() > 1)
        runs_.back() = count_;
      else
        runs_.push_back(count_);
    });
    periodic_ |= count_ > before && shift != Point<D>{};
  }

  void merge(int begin, int middle, int end) {
    const std::uint64_t* a = keys_.data() + begin;
    const std::uint64_t* b = keys_.data() + middle;
    const std::uint64_t *const a_end = b, *const b_end = keys_.data() + end;
    std::uint64_t* to = merged_.data() + begin;
    while (a < a_end && b < b_end) {
      const bool second = *b < *a;
      *to++ = second ? *b : *a;
      a += !second;
      b += second;
    }
    std::copy(b, b_end, std::copy(a, a_end, to));
  }

  int count_ = 0;
  PointArrays<D> candidates_, sorted_;
  std::vector<int> runs_;   // where runs of ascending numbers end, after a 0
  std::vector<int> cells_;  // memory for visit_leaves()
  std::vector<std::uint64_t> keys_, merged_;
  bool periodic_ = false;
  CandidateKernels code_ = candidate_kernels(cpu());
};

/// Memory that threads take pieces of; it stays where it is until the end.
class Slabs {
 public:
  int* take(std::size_t count) {
    const std::lock_guard lock(mutex_);
    if (slabs_.empty() || used_ + count > capacity_) {
      // Few points should not take much, many not often.
      capacity_ =
          std::max(count, std::clamp(2 * capacity_, std::size_t{1} << 14, std::size_t{1} << 22));
      slabs_.push_back(std::make_unique_for_overwrite<int[]>(capacity_));
      prefer_large_pages(slabs_.back().get(), capacity_ * sizeof(int));
      used_ = 0;
    }
    return slabs_.back().get() + std::exchange(used_, used_ + count);
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<int[]>> slabs_;
  std::size_t used_ = 0, capacity_ = 0;
};

void check_supports(const Cloud& cloud, const Eigen::VectorXd& supports) {
  if (supports.size() != 1 && supports.size() != cloud.size())
    throw InvalidInput("supports has " + std::to_string(supports.size()) + " entries for " +
                       std::to_string(cloud.size()) + " points");
  for (Eigen::Index i = 0; i < supports.size(); ++i) {
    const std::string whose = supports.size() == 1
                                  ? "support"
                                  : "the support of point " + std::to_string(cloud.number(i));
    if (!(supports[i] >= std::numeric_limits<double>::min() && std::isfinite(supports[i])))
      throw InvalidInput(whose + " must be > 0 and finite, not " + shortest(supports[i]));
    for (int a = 0; a < cloud.dimension(); ++a)
      if (cloud.box()[a] > 0 && supports[i] > cloud.box()[a] / 2)
        throw InvalidInput(whose + ", " + shortest(supports[i]) +
                           ", is more than half the periodic box, " + shortest(cloud.box()[a]) +
                           ": points would meet two images of the same neighbour");
  }
}

[[noreturn]] void throw_coincident(const Cloud& cloud, double support) {
  const Coincidences all = coincidences(cloud);
  if (all.points.empty())
    throw InvalidInput(
        "some points are so close together that their distance, squared, vanishes beside a support "
        "of " +
        shortest(support));
  const int first = all.points.front();
  throw InvalidInput("points " + std::to_string(cloud.number(all.first_partner)) + " and " +
                     std::to_string(cloud.number(first)) + " coincide at " +
                     coordinates(cloud.positions(), first) + "; " +
                     std::to_string(all.points.size()) + " of " + std::to_string(cloud.size()) +
                     " points coincide with an earlier one");
}

/// Refuses what an int cannot count: neighbours and the diagonal.
void check_entries(double neighbours, const Cloud& cloud, double support) {
  const double entries = neighbours + cloud.size();
  if (entries <= std::numeric_limits<int>::max()) return;
  if (!coincidences(cloud).points.empty()) throw_coincident(cloud, support);
  const double gigabytes = entries * (sizeof(int) + sizeof(double)) / 1e9;
  throw InvalidInput("with support " + shortest(support) + " a matrix would have about " +
                     shortest(std::round(entries)) + " entries and take " +
                     shortest(std::round(gigabytes)) +
                     " GB; at most 2^31 - 1 entries are possible: is the support too large?");
}

/// The points whose neighbours are looked for.
struct Wanted {
  std::vector<char> marks;  // empty: all
  int count;
  bool operator()(int i) const { return marks.empty() || marks[i]; }
};

Wanted wanted_rows(const std::vector<int>* rows, int points) {
  if (!rows) return {{}, points};
  Wanted wanted{std::vector<char>(points, false), static_cast<int>(rows->size())};
  for (const int i : *rows)
    if (i < 0 || i >= points || std::exchange(wanted.marks[i], true))
      throw InvalidInput("row " + std::to_string(i) + " is not one of " + std::to_string(points) +
                         " points, or there twice");
  return wanted;
}

void check_isolation(const Cloud& cloud, const Neighbours& near) {
  int isolated = 0;
  for (int i = 0; i < near.size(); ++i) isolated += near.count(i) == 0;
  if (cloud.size() < 2 || isolated <= cloud.size() / 2) return;
  throw InvalidInput(std::to_string(isolated) + " of " + std::to_string(cloud.size()) +
                     " points have no neighbour within the support " + shortest(near.supports[0]) +
                     (near.supports.size() > 1 ? " (of point 0)" : "") +
                     "; the median distance to the nearest point is " +
                     shortest(median(nearest_distances(cloud))));
}

/// Gathers the candidates of a leaf for the supports that `near` holds.
template <int D>
void gather(LeafSearch<D>& search, const Tree<D>& tree, const Neighbours& near,
            const Wanted& wanted, Leaf leaf) {
  double reach = 0;
  for (int k = leaf.begin; k < leaf.end; ++k)
    if (const int i = tree.number(k); wanted(i)) reach = std::max(reach, near.support(i));
  search.gather(tree, leaf, tree.to_units(reach));
}

/// The neighbours of all wanted points, estimated from one point in each of a few leaves.
template <int D>
double estimated_neighbours(const Tree<D>& tree, const Neighbours& near, const Wanted& wanted) {
  const auto leaf_count = static_cast<std::int64_t>(tree.leaves().size());
  const auto samples = std::min<std::int64_t>(leaf_count, leaves_for_estimate);
  LeafSearch<D> search;
  std::vector<int> found;
  double sum = 0;
  for (std::int64_t s = 0; s < samples; ++s) {
    const Leaf leaf = tree.leaves()[s * leaf_count / samples];
    gather(search, tree, near, wanted, leaf);
    found.resize(search.most());
    const double support = tree.to_units(near.support(tree.number(leaf.begin)));
    const auto row = search.select(tree.point(leaf.begin), support, found.data());
    // Points that coincide are all candidates.
    sum += row.coincides ? search.most() : row.count;
  }
  return sum / static_cast<double>(samples) * wanted.count;
}

template <int D>
Neighbours find(const Cloud& cloud, const Eigen::VectorXd& supports, const Wanted& wanted,
                int threads) {
  const int n = cloud.size();
  Neighbours near{Eigen::VectorXi::Zero(n + 1), {}, supports};
  if (wanted.count == 0) return near;
  const double largest = supports.maxCoeff();
  const Tree<D> tree(cloud, largest, threads);
  const auto& leaves = tree.leaves();
  const int leaf_count = static_cast<int>(leaves.size());

  // What is clearly too much is refused before anything large is allocated, the rest when counted.
  if (const double estimate = estimated_neighbours(tree, near, wanted);
      estimate > 1.25 * std::numeric_limits<int>::max())
    check_entries(estimate, cloud, largest);

  Slabs slabs;
  std::vector<const int*> chunks(  // rows in tree order, end to end
      (leaf_count + leaves_per_chunk - 1) / leaves_per_chunk);
  std::atomic<std::int64_t> total = 0;
  std::atomic<bool> coincident = false;
  const auto search_chunk = [&, search = LeafSearch<D>(), found = std::vector<int>()](
                                int begin, int end) mutable {
    std::size_t size = 0;
    for (int l = begin; l < end; ++l) {
      const auto is_wanted = [&](int k) { return wanted(tree.number(k)); };
      if (std::ranges::none_of(std::views::iota(leaves[l].begin, leaves[l].end), is_wanted))
        continue;
      gather(search, tree, near, wanted, leaves[l]);
      search.sort();
      for (int k = leaves[l].begin; k < leaves[l].end; ++k) {
        const int i = tree.number(k);
        if (!wanted(i)) continue;
        if (found.size() < size + search.most()) found.resize(2 * (size + search.most()));
        const auto row =
            search.select(tree.point(k), tree.to_units(near.support(i)), found.data() + size);
        near.offsets[i + 1] = row.count;
        size += row.count;
        if (row.coincides) coincident = true;
      }
    }
    total += static_cast<std::int64_t>(size);
    check_entries(static_cast<double>(total), cloud, largest);
    int* const kept = slabs.take(size);
    std::copy_n(found.data(), size, kept);
    chunks[begin / leaves_per_chunk] = kept;
  };
  parallel_chunks(leaf_count, leaves_per_chunk, threads, search_chunk);
  if (coincident) throw_coincident(cloud, largest);
  for (int i = 0; i < n; ++i) near.offsets[i + 1] += near.offsets[i];

  near.indices.resize(total.load());
  prefer_large_pages(near.indices.data(), sizeof(int) * near.indices.size());
  near.order.resize(n);
  parallel_chunks(leaf_count, leaves_per_chunk, threads, [&](int begin, int end) {
    const int* row = chunks[begin / leaves_per_chunk];
    for (int k = leaves[begin].begin; k < leaves[end - 1].end; ++k) {
      const int i = near.order[k] = tree.number(k);
      std::copy_n(row, near.count(i), near.indices.data() + near.offsets[i]);
      row += near.count(i);
    }
  });
  if (wanted.marks.empty()) check_isolation(cloud, near);  // a part may well be sparse
  return near;
}

template <int D>
Neighbours around(const Cloud& cloud, const std::vector<int>& points,
                  const Eigen::VectorXd& supports, int threads) {
  const int count = static_cast<int>(points.size());
  Neighbours near{Eigen::VectorXi::Zero(count + 1), {}, supports};
  if (count == 0) return near;
  const Tree<D> tree(cloud, supports.maxCoeff(), threads);
  std::vector<int> place(cloud.size());  // in tree order
  for (int k = 0; k < tree.size(); ++k) place[tree.number(k)] = k;

  std::vector<std::vector<int>> rows(count);
  parallel_chunks(count, 16, threads, [&, search = LeafSearch<D>()](int begin, int end) mutable {
    for (int k = begin; k < end; ++k) {
      const int at = place[points[k]];
      const double support = tree.to_units(supports[k]);
      search.gather(tree, {at, at + 1}, support);
      search.sort();
      rows[k].resize(search.most());
      rows[k].resize(search.select(tree.point(at), support, rows[k].data()).count);
    }
  });
  double entries = 0;
  for (const auto& row : rows) entries += static_cast<double>(row.size());
  check_entries(entries, cloud, supports.maxCoeff());
  near.indices.resize(static_cast<Eigen::Index>(entries));
  for (int k = 0; k < count; ++k) {
    std::ranges::copy(rows[k], near.indices.data() + near.offsets[k]);
    near.offsets[k + 1] = near.offsets[k] + static_cast<int>(rows[k].size());
  }
  return near;
}

/// Leaf by leaf: the distances within it say how far to look outside.
template <int D>
Eigen::VectorXd nearest(const Cloud& cloud, int threads) {
  Eigen::VectorXd distance(cloud.size());
  if (cloud.size() == 0) return distance;
  const double extent = cloud.positions().cwiseAbs().maxCoeff();
  const Tree<D> tree(cloud, extent > 0 ? extent : 1, threads);
  parallel_chunks(static_cast<int>(tree.leaves().size()), leaves_per_chunk, threads,
                  [&, search = LeafSearch<D>()](int begin, int end) mutable {
                    for (int l = begin; l < end; ++l) {
                      const Leaf leaf = tree.leaves()[l];
                      double squared_reach = 0;
                      search.gather(tree, leaf, 0);
                      for (int k = leaf.begin; k < leaf.end; ++k)
                        squared_reach = std::max(
                            squared_reach, search.nearest_squared(tree.number(k), tree.point(k)));
                      // One more digit, so that rounding does not lose who is just there.
                      search.gather(tree, leaf, std::sqrt(squared_reach) * (1 + 1e-14));
                      for (int k = leaf.begin; k < leaf.end; ++k)
                        distance[tree.number(k)] = tree.to_length(
                            std::sqrt(search.nearest_squared(tree.number(k), tree.point(k))));
                    }
                  });
  return distance;
}

}  // namespace

namespace {

Neighbours find_neighbours(const Cloud& cloud, const Eigen::VectorXd& supports,
                           const std::vector<int>* rows, int threads) {
  check_supports(cloud, supports);
  checked_threads(threads);
  const Wanted wanted = wanted_rows(rows, cloud.size());
  return dispatch(cloud.dimension(), [&](auto d) {
    return find<decltype(d)::value>(cloud, supports, wanted, threads);
  });
}

}  // namespace

Neighbours find_neighbours(const Cloud& cloud, const Eigen::VectorXd& supports, int threads) {
  return find_neighbours(cloud, supports, nullptr, threads);
}

Neighbours find_neighbours(const Cloud& cloud, const Eigen::VectorXd& supports,
                           const std::vector<int>& rows, int threads) {
  return find_neighbours(cloud, supports, &rows, threads);
}

Neighbours find_neighbours(const Cloud& cloud, double support, int threads) {
  return find_neighbours(cloud, Eigen::VectorXd::Constant(1, support), threads);
}

Neighbours neighbours_around(const Cloud& cloud, const std::vector<int>& points,
                             const Eigen::VectorXd& supports, int threads) {
  return dispatch(cloud.dimension(), [&](auto d) {
    return around<decltype(d)::value>(cloud, points, supports, threads);
  });
}

Eigen::VectorXd nearest_distances(const Cloud& cloud, int threads) {
  return dispatch(cloud.dimension(),
                  [&](auto d) { return nearest<decltype(d)::value>(cloud, threads); });
}

Reordered reorder(const Cloud& cloud, int threads) {
  checked_threads(threads);
  std::vector<int> order(cloud.size());
  if (cloud.size() > 0)
    dispatch(cloud.dimension(), [&](auto d) {
      const double extent = cloud.positions().cwiseAbs().maxCoeff();
      const Tree<decltype(d)::value> tree(cloud, extent > 0 ? extent : 1, threads);
      for (int k = 0; k < cloud.size(); ++k) order[k] = tree.number(k);
    });
  CloudOptions options{.box = cloud.box()};
  if (cloud.has_volumes()) options.volumes = cloud.volumes()(order);
  return {Cloud(cloud.positions()(order, Eigen::all), std::move(options)), std::move(order)};
}

}  // namespace gradpsi
