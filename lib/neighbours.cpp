#include "gradpsi/neighbours.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nanoflann.hpp>
#include <string>
#include <vector>

#include "check.hpp"
#include "dispatch.hpp"
#include "gradpsi/error.hpp"
#include "median.hpp"
#include "parallel.hpp"
#include "points.hpp"
#include "search.hpp"
#include "text.hpp"

namespace gradpsi {
namespace {

constexpr int leaf_size = 24;         // points; measured: 24 to 48 within a tenth, fewer are slower
constexpr int leaves_per_chunk = 64;  // one task of a thread
constexpr int leaves_for_estimate = 64;

template <int D>
using Point = std::array<double, D>;

struct Leaf {
  int begin, end;  // in tree order
};

/// A k-d tree over the points in units of a power of two near the `length` that matters: the
/// scaling is exact, and squared distances cannot overflow or vanish where they are compared.
template <int D>
class Tree {
 public:
  Tree(const Cloud& cloud, double length)
      : exponent_(cloud.size() > 0 ? std::ilogb(length) : 0),
        points_{scaled(cloud, exponent_)},
        index_(D, points_, nanoflann::KDTreeSingleIndexAdaptorParams(leaf_size)) {
    for (int a = 0; a < D; ++a) box_[a] = std::ldexp(cloud.box()[a], -exponent_);
    collect_leaves(root());
    ordered_.reserve(points_.x.size());
    for (const int i : order()) ordered_.push_back(points_.x[i]);
  }
  Tree(const Tree&) = delete;

  int size() const { return static_cast<int>(points_.x.size()); }
  double to_units(double length) const { return std::ldexp(length, -exponent_); }
  double to_length(double units) const { return std::ldexp(units, exponent_); }
  const Point<D>& box() const { return box_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  /// Point k in tree order, and which point of the cloud it is.
  const Point<D>& point(int k) const { return ordered_[k]; }
  int number(int k) const { return order()[k]; }

  /// Calls visit(begin, end) for leaves that can hold points in [low, high], in tree order.
  template <class Visit>
  void visit_leaves(const Point<D>& low, const Point<D>& high, const Visit& visit) const {
    if (root()) descend(*root(), low, high, visit);
  }

  /// Squared distance from x to the nearest point other than i; infinity if there is none.
  double nearest_squared(int i, const Point<D>& x) const {
    std::array<int, 2> index;
    std::array<double, 2> squared;
    const auto found = index_.knnSearch(x.data(), 2, index.data(), squared.data());
    for (std::size_t k = 0; k < found; ++k)
      if (index[k] != i) return squared[k];
    return std::numeric_limits<double>::infinity();
  }

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
  const std::vector<int>& order() const { return index_.vAcc_; }
#else
  const Node* root() const { return index_.root_node; }
  const std::vector<int>& order() const { return index_.vAcc; }
#endif

  static std::vector<Point<D>> scaled(const Cloud& cloud, int exponent) {
    const Positions wrapped = wrapped_positions(cloud);
    std::vector<Point<D>> x(cloud.size());
    for (int i = 0; i < cloud.size(); ++i)
      for (int a = 0; a < D; ++a) {
        x[i][a] = std::ldexp(wrapped(i, a), -exponent);
        if (!std::isfinite(x[i][a]))
          throw InvalidInput("a support near " + shortest(std::ldexp(1.0, exponent)) +
                             " is lost in the rounding of point " + std::to_string(i) + " at " +
                             coordinates(cloud.positions(), i));
      }
    return x;
  }

  void collect_leaves(const Node* node) {
    if (!node) return;
    if (!node->child1) {
      const auto& range = node->node_type.lr;
      leaves_.push_back({static_cast<int>(range.left), static_cast<int>(range.right)});
    } else {
      collect_leaves(node->child1);
      collect_leaves(node->child2);
    }
  }

  template <class Visit>
  static void descend(const Node& node, const Point<D>& low, const Point<D>& high,
                      const Visit& visit) {
    if (!node.child1) {
      const auto& range = node.node_type.lr;
      visit(static_cast<int>(range.left), static_cast<int>(range.right));
      return;
    }
    const auto& split = node.node_type.sub;
    if (low[split.divfeat] <= split.divlow) descend(*node.child1, low, high, visit);
    if (high[split.divfeat] >= split.divhigh) descend(*node.child2, low, high, visit);
  }

  int exponent_;
  Points points_;
  Index index_;
  Point<D> box_;
  std::vector<Leaf> leaves_;
  std::vector<Point<D>> ordered_;
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

/// Finds the neighbours of all points of a leaf together: the tree is walked once for the leaf's
/// box widened by the support, and the candidates found, sorted once, are tested for each point.
template <int D>
class LeafSearch {
 public:
  void gather(const Tree<D>& tree, Leaf leaf, double reach) {
    Point<D> low = tree.point(leaf.begin);
    Point<D> high = low;
    for (int k = leaf.begin; k < leaf.end; ++k)
      for (int a = 0; a < D; ++a) {
        low[a] = std::min(low[a], tree.point(k)[a]);
        high[a] = std::max(high[a], tree.point(k)[a]);
      }
    for (int a = 0; a < D; ++a) low[a] -= reach, high[a] += reach;

    candidates_.clear();
    periodic_ = false;
    for_each_image<D>(tree.box(), [&](const Point<D>& shift) { gather(tree, low, high, shift); });
    const auto by_number = [](const auto& a, const auto& b) { return a.number < b.number; };
    if (!std::is_sorted(candidates_.begin(), candidates_.end(), by_number))
      std::sort(candidates_.begin(), candidates_.end(), by_number);

    numbers_.resize(candidates_.size());
    squared_.resize(candidates_.size());
    for (int a = 0; a < D; ++a) x_[a].resize(candidates_.size());
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      numbers_[c] = candidates_[c].number;
      for (int a = 0; a < D; ++a) x_[a][c] = candidates_[c].x[a];
    }
  }

  /// The neighbours of point i at x, ascending, are appended to `found`, unless another point has no
  /// distance from it.
  struct Found {
    std::int64_t count;
    bool coincides;
  };
  Found append(int i, const Point<D>& x, double support, std::vector<int>& found) {
    const int candidates = static_cast<int>(numbers_.size());
    for (int c = 0; c < candidates; ++c) squared_[c] = square(x_[0][c] - x[0]);
    for (int a = 1; a < D; ++a)
      for (int c = 0; c < candidates; ++c) squared_[c] += square(x_[a][c] - x[a]);

    const std::size_t before = found.size();
    found.resize(before + candidates);
    int* end = found.data() + before;
    int zeros = 0;
    for (int c = 0; c < candidates; ++c) {
      *end = numbers_[c];
      end += (squared_[c] < square(support)) & (numbers_[c] != i);
      zeros += squared_[c] == 0;
    }
    // At half a box, rounding can let two images of the same point pass.
    if (periodic_) end = std::unique(found.data() + before, end);
    const Found result{end - (found.data() + before), zeros > 1};
    found.resize(result.coincides ? before : before + static_cast<std::size_t>(result.count));
    return result;
  }

 private:
  struct Candidate {
    int number;
    Point<D> x;
  };

  static double square(double x) { return x * x; }

  void gather(const Tree<D>& tree, const Point<D>& low, const Point<D>& high,
              const Point<D>& shift) {
    Point<D> near_low, near_high;
    for (int a = 0; a < D; ++a) near_low[a] = low[a] - shift[a], near_high[a] = high[a] - shift[a];
    const std::size_t before = candidates_.size();
    tree.visit_leaves(near_low, near_high, [&](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        Candidate c{tree.number(k), tree.point(k)};
        bool inside = true;
        for (int a = 0; a < D; ++a) {
          inside &= c.x[a] >= near_low[a] && c.x[a] <= near_high[a];
          c.x[a] += shift[a];
        }
        if (inside) candidates_.push_back(c);
      }
    });
    periodic_ |= candidates_.size() > before && shift != Point<D>{};
  }

  std::vector<Candidate> candidates_;
  std::vector<int> numbers_;
  std::array<std::vector<double>, D> x_;
  std::vector<double> squared_;
  bool periodic_ = false;
};

void check_supports(const Cloud& cloud, const Eigen::VectorXd& supports) {
  if (supports.size() != 1 && supports.size() != cloud.size())
    throw InvalidInput("supports has " + std::to_string(supports.size()) + " entries for " +
                       std::to_string(cloud.size()) + " points");
  for (Eigen::Index i = 0; i < supports.size(); ++i) {
    const std::string whose =
        supports.size() == 1 ? "support" : "the support of point " + std::to_string(i);
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
  throw InvalidInput("points " + std::to_string(all.first_partner) + " and " +
                     std::to_string(first) + " coincide at " +
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
void gather(LeafSearch<D>& search, const Tree<D>& tree, const Neighbours& near, Leaf leaf) {
  double reach = 0;
  for (int k = leaf.begin; k < leaf.end; ++k) reach = std::max(reach, near.support(tree.number(k)));
  search.gather(tree, leaf, tree.to_units(reach));
}

/// The neighbours of all points, estimated from one point in each of a few leaves.
template <int D>
double estimated_neighbours(const Tree<D>& tree, const Neighbours& near) {
  const auto leaf_count = static_cast<std::int64_t>(tree.leaves().size());
  const auto samples = std::min<std::int64_t>(leaf_count, leaves_for_estimate);
  LeafSearch<D> search;
  double sum = 0;
  for (std::int64_t s = 0; s < samples; ++s) {
    const Leaf leaf = tree.leaves()[s * leaf_count / samples];
    gather(search, tree, near, leaf);
    const int i = tree.number(leaf.begin);
    std::vector<int> found;
    const double support = tree.to_units(near.support(i));
    sum += static_cast<double>(search.append(i, tree.point(leaf.begin), support, found).count);
  }
  return sum / static_cast<double>(samples) * tree.size();
}

template <int D>
Neighbours find(const Cloud& cloud, const Eigen::VectorXd& supports, int threads) {
  const int n = cloud.size();
  Neighbours near{Eigen::VectorXi::Zero(n + 1), {}, supports};
  if (n == 0) return near;
  const double largest = supports.maxCoeff();
  const Tree<D> tree(cloud, largest);
  const auto& leaves = tree.leaves();
  const int leaf_count = static_cast<int>(leaves.size());

  // What is clearly too much is refused before anything large is allocated, the rest when counted.
  if (const double estimate = estimated_neighbours(tree, near);
      estimate > 1.25 * std::numeric_limits<int>::max())
    check_entries(estimate, cloud, largest);

  std::vector<std::vector<int>> chunks(  // rows in tree order, end to end
      (leaf_count + leaves_per_chunk - 1) / leaves_per_chunk);
  std::atomic<std::int64_t> total = 0;
  std::atomic<bool> coincident = false;
  const auto search_chunk = [&, search = LeafSearch<D>()](int begin, int end) mutable {
    std::vector<int>& found = chunks[begin / leaves_per_chunk];
    for (int l = begin; l < end; ++l) {
      gather(search, tree, near, leaves[l]);
      for (int k = leaves[l].begin; k < leaves[l].end; ++k) {
        const int i = tree.number(k);
        const auto row = search.append(i, tree.point(k), tree.to_units(near.support(i)), found);
        near.offsets[i + 1] = static_cast<int>(row.count);
        if (row.coincides) coincident = true;
      }
    }
    total += static_cast<std::int64_t>(found.size());
    check_entries(static_cast<double>(total), cloud, largest);
  };
  parallel_chunks(leaf_count, leaves_per_chunk, threads, search_chunk);
  if (coincident) throw_coincident(cloud, largest);
  for (int i = 0; i < n; ++i) near.offsets[i + 1] += near.offsets[i];

  near.indices.resize(total.load());
  parallel_chunks(leaf_count, leaves_per_chunk, threads, [&](int begin, int end) {
    std::vector<int>& found = chunks[begin / leaves_per_chunk];
    const int* row = found.data();
    for (int k = leaves[begin].begin; k < leaves[end - 1].end; ++k) {
      const int i = tree.number(k);
      std::copy_n(row, near.count(i), near.indices.data() + near.offsets[i]);
      row += near.count(i);
    }
    std::vector<int>().swap(found);
  });
  check_isolation(cloud, near);
  return near;
}

template <int D>
Neighbours around(const Cloud& cloud, const std::vector<int>& points,
                  const Eigen::VectorXd& supports, int threads) {
  const int count = static_cast<int>(points.size());
  Neighbours near{Eigen::VectorXi::Zero(count + 1), {}, supports};
  if (count == 0) return near;
  const Tree<D> tree(cloud, supports.maxCoeff());
  std::vector<int> place(cloud.size());  // in tree order
  for (int k = 0; k < tree.size(); ++k) place[tree.number(k)] = k;

  std::vector<std::vector<int>> rows(count);
  parallel_chunks(count, 16, threads, [&, search = LeafSearch<D>()](int begin, int end) mutable {
    for (int k = begin; k < end; ++k) {
      const int at = place[points[k]];
      const double support = tree.to_units(supports[k]);
      search.gather(tree, {at, at + 1}, support);
      search.append(points[k], tree.point(at), support, rows[k]);
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

template <int D>
Eigen::VectorXd nearest(const Cloud& cloud, int threads) {
  Eigen::VectorXd distance(cloud.size());
  if (cloud.size() == 0) return distance;
  const double extent = cloud.positions().cwiseAbs().maxCoeff();
  const Tree<D> tree(cloud, extent > 0 ? extent : 1);
  parallel_chunks(cloud.size(), 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      double squared = std::numeric_limits<double>::infinity();
      for_each_image<D>(tree.box(), [&](const Point<D>& shift) {
        Point<D> x = tree.point(k);
        for (int a = 0; a < D; ++a) x[a] += shift[a];
        squared = std::min(squared, tree.nearest_squared(tree.number(k), x));
      });
      distance[tree.number(k)] = tree.to_length(std::sqrt(squared));
    }
  });
  return distance;
}

}  // namespace

Neighbours find_neighbours(const Cloud& cloud, const Eigen::VectorXd& supports, int threads) {
  check_supports(cloud, supports);
  checked_threads(threads);
  return dispatch(cloud.dimension(),
                  [&](auto d) { return find<decltype(d)::value>(cloud, supports, threads); });
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

Eigen::VectorXd number_density_volumes(const Cloud& cloud, const Neighbours& near,
                                       const Kernel& kernel, int threads) {
  check_match(cloud, near);
  check_kernel(kernel, cloud.dimension());
  return dispatch(cloud.dimension(), [&](auto d) {
    constexpr int D = decltype(d)::value;
    Eigen::VectorXd volumes(cloud.size());
    parallel_chunks(cloud.size(), 1024, threads, [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        const double h = near.support(i);
        double sum = kernel.profile(0).w;
        for (const int j : near.of(i))
          sum += kernel.profile(std::min((displacement<D>(cloud, i, j) / h).norm(), 1.0)).w;
        volumes[i] = std::pow(h, D) / (kernel.normalisation[D - 1] * sum);
        if (!(std::isnormal(volumes[i]) && volumes[i] > 0))
          throw InvalidInput("the number density of point " + std::to_string(i) + " with support " +
                             shortest(h) + " is beyond the range of a double");
      }
    });
    return volumes;
  });
}

}  // namespace gradpsi
