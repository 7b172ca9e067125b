#include "search/tree.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <string>
#include <utility>

#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"

namespace gradpsi {
namespace {

constexpr int leaf_size = 24;  // points; measured: 24 to 48 within a tenth, fewer are slower

}  // namespace

/// A k-d tree of nanoflann over the points of a cell.
template <int D>
class Tree<D>::Block {
 public:
  explicit Block(std::vector<Point<D>> points)
      : points_{std::move(points)},
        index_(D, points_, nanoflann::KDTreeSingleIndexAdaptorParams(leaf_size)) {}
  Block(const Block&) = delete;

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

template <int D>
Tree<D>::Tree(const Cloud& cloud, double length, int threads)
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

template <int D>
Tree<D>::~Tree() = default;

template <int D>
double Tree<D>::to_units(double length) const {
  return std::ldexp(length, -exponent_);
}

template <int D>
double Tree<D>::to_length(double units) const {
  return std::ldexp(units, exponent_);
}

template <int D>
double Tree<D>::likely_reach(Leaf leaf, int count) const {
  const auto longest = [&](int begin, int end) {
    double side = 0;
    for (const auto& x : ordered_.x) {
      const auto [low, high] = std::minmax_element(x.begin() + begin, x.begin() + end);
      side = std::max(side, *high - *low);
    }
    return side;
  };
  const double share = static_cast<double>(count) / (leaf.end - leaf.begin);
  if (const double side = longest(leaf.begin, leaf.end); side > 0)
    return side * std::max(0.5, 0.6 * std::pow(share, 1.0 / D));
  const double side = longest(0, size());
  return side > 0 ? side * std::pow(static_cast<double>(count) / size(), 1.0 / D) : 1;
}

template <int D>
void Tree<D>::leaves_in(const Box<D>& box, std::vector<int>& cells,
                        std::vector<Leaf>& found) const {
  cells.clear();
  found.clear();
  grid_->cells_in(box, cells);
  std::ranges::sort(cells);
  for (const int c : cells)
    if (blocks_[c])
      blocks_[c]->for_each_leaf_in(box, [&, first = grid_->begin(c)](int begin, int end) {
        found.push_back({first + begin, first + end});
      });
}

template <int D>
std::vector<Point<D>> Tree<D>::scaled(const Cloud& cloud, const Positions& positions,
                                      int threads) const {
  // In two steps, neither of which can overflow where the result does not.
  const double half = std::ldexp(1.0, -exponent_ / 2);
  const double rest = std::ldexp(1.0, -exponent_ - -exponent_ / 2);
  std::vector<Point<D>> x(cloud.size());
  parallel_chunks(cloud.size(), 1 << 15, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      for (int a = 0; a < D; ++a) {
        x[i][a] = positions.data()[std::ptrdiff_t{i} * D + a] * half * rest;
        if (!std::isfinite(x[i][a]))
          throw InvalidInput("a support near " + shortest(std::ldexp(1.0, exponent_)) +
                             " is lost in the rounding of point " +
                             std::to_string(cloud.number(i)) + " at " +
                             coordinates(cloud.positions(), i));
      }
  });
  return x;
}

template <int D>
std::vector<Point<D>> Tree<D>::scaled(const Cloud& cloud, int threads) const {
  const bool periodic = std::ranges::any_of(cloud.box(), [](double length) { return length > 0; });
  return periodic ? scaled(cloud, wrapped_positions(cloud), threads)
                  : scaled(cloud, cloud.positions(), threads);
}

template <int D>
void Tree<D>::build(const std::vector<Point<D>>& points, int c, std::vector<Leaf>& leaves) {
  const int first = grid_->begin(c), count = grid_->begin(c + 1) - first;
  if (count == 0) return;
  std::vector<Point<D>> own(count);
  const int* const number = grid_->sorted().data() + first;
  for (int k = 0; k < count; ++k) own[k] = points[number[k]];
  blocks_[c] = std::make_unique<Block>(std::move(own));
  Block& tree = *blocks_[c];
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

template class Tree<1>;
template class Tree<2>;
template class Tree<3>;

}  // namespace gradpsi
