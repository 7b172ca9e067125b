#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/neighbours.hpp"
#include "search/leaf_search.hpp"
#include "search/tree.hpp"

namespace gradpsi {
namespace {

/// Writes the distances of a leaf's points: those within it say how far to look outside.
template <int D>
void measure(LeafSearch<D>& search, const Tree<D>& tree, Leaf leaf, DenseVector& distances) {
  const auto squared = [&](int k) { return search.nearest_squared(tree.number(k), tree.point(k)); };
  double squared_reach = 0;
  search.gather(tree, leaf, 0);
  for (int k = leaf.begin; k < leaf.end; ++k) squared_reach = std::max(squared_reach, squared(k));
  // One more digit, so that rounding does not lose who is just there.
  search.gather(tree, leaf, std::sqrt(squared_reach) * (1 + 1e-14));
  for (int k = leaf.begin; k < leaf.end; ++k)
    distances[tree.number(k)] = tree.to_length(std::sqrt(squared(k)));
}

/// The same to their count-th nearest one, from as far as that many are likely to be found.
template <int D>
void measure(LeafSearch<D>& search, const Tree<D>& tree, Leaf leaf, int count,
             DenseVector& distances) {
  double reach = tree.likely_reach(leaf, count), needed;
  std::vector<double> found(leaf.end - leaf.begin);
  for (bool sure = false; !sure; reach = std::isinf(needed) ? 2 * reach : needed * (1 + 1e-14)) {
    search.gather(tree, leaf, reach);
    for (int k = leaf.begin; k < leaf.end; ++k)
      found[k - leaf.begin] =
          std::sqrt(search.nearest_squared(tree.number(k), tree.point(k), count));
    needed = *std::ranges::max_element(found);
    sure = needed <= reach;
  }
  for (int k = leaf.begin; k < leaf.end; ++k)
    distances[tree.number(k)] = tree.to_length(found[k - leaf.begin]);
}

/// What measure(search, tree, leaf, distances) writes for each leaf.
template <int D, class Measure>
DenseVector distances_by_leaf(const Cloud& cloud, int threads, const Measure& measure) {
  DenseVector distances(cloud.size());
  if (cloud.size() == 0) return distances;
  const Tree<D> tree = tree_of_all<D>(cloud, threads);
  parallel_chunks(static_cast<int>(tree.leaves().size()), leaves_per_chunk, threads,
                  [&, search = LeafSearch<D>()](int begin, int end) mutable {
                    for (int l = begin; l < end; ++l)
                      measure(search, tree, tree.leaves()[l], distances);
                  });
  return distances;
}

}  // namespace

DenseVector nearest_distances(const Cloud& cloud, int threads) {
  checked_threads(threads);
  return dispatch(cloud.dimension(), [&](auto d) {
    return distances_by_leaf<d>(
        cloud, threads, [](auto& search, const auto& tree, Leaf leaf, DenseVector& distances) {
          measure(search, tree, leaf, distances);
        });
  });
}

DenseVector kth_nearest_distances(const Cloud& cloud, int k, int threads) {
  checked_threads(threads);
  if (k < 1 || k >= cloud.size())
    throw InvalidInput("each of " + std::to_string(cloud.size()) + " points has up to " +
                       std::to_string(cloud.size() - 1) + " nearest ones, not " +
                       std::to_string(k));
  return dispatch(cloud.dimension(), [&](auto d) {
    return distances_by_leaf<d>(
        cloud, threads, [&](auto& search, const auto& tree, Leaf leaf, DenseVector& distances) {
          measure(search, tree, leaf, k, distances);
        });
  });
}

}  // namespace gradpsi
