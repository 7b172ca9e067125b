#include "search/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/neighbours.hpp"
#include "search/leaf_search.hpp"

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
  std::vector<int> left(leaf.end - leaf.begin);
  std::iota(left.begin(), left.end(), leaf.begin);
  double reach = tree.likely_reach(leaf, count);
  for (double growth = 1.3; !left.empty(); reach *= growth, growth = 2) {
    search.gather(tree, leaf, reach);
    std::erase_if(left, [&](int k) {
      const double squared = search.nearest_squared(tree.number(k), tree.point(k), count, reach);
      if (std::isfinite(squared)) distances[tree.number(k)] = tree.to_length(std::sqrt(squared));
      return std::isfinite(squared);
    });
  }
}

/// What measure(search, leaf) gives the points of each leaf.
template <int D, class Measure>
DenseVector distances_by_leaf(const Tree<D>& tree, int threads, const Measure& measure) {
  DenseVector distances(tree.size());
  parallel_chunks(static_cast<int>(tree.leaves().size()), leaves_per_chunk, threads,
                  [&, search = LeafSearch<D>()](int begin, int end) mutable {
                    for (int l = begin; l < end; ++l) measure(search, tree.leaves()[l], distances);
                  });
  return distances;
}

}  // namespace

template <int D>
DenseVector nearest_distances(const Tree<D>& tree, int threads) {
  return distances_by_leaf(tree, threads, [&](auto& search, Leaf leaf, DenseVector& distances) {
    measure(search, tree, leaf, distances);
  });
}

template <int D>
DenseVector kth_nearest_distances(const Tree<D>& tree, int k, int threads) {
  return distances_by_leaf(tree, threads, [&](auto& search, Leaf leaf, DenseVector& distances) {
    measure(search, tree, leaf, k, distances);
  });
}

template DenseVector nearest_distances(const Tree<1>&, int);
template DenseVector nearest_distances(const Tree<2>&, int);
template DenseVector nearest_distances(const Tree<3>&, int);
template DenseVector kth_nearest_distances(const Tree<1>&, int, int);
template DenseVector kth_nearest_distances(const Tree<2>&, int, int);
template DenseVector kth_nearest_distances(const Tree<3>&, int, int);

DenseVector nearest_distances(const Cloud& cloud, int threads) {
  checked_threads(threads);
  if (cloud.size() == 0) return {};
  return dispatch(cloud.dimension(), [&](auto d) {
    return nearest_distances(tree_of_all<d>(cloud, threads), threads);
  });
}

DenseVector kth_nearest_distances(const Cloud& cloud, int k, int threads) {
  checked_threads(threads);
  if (k < 1 || k >= cloud.size())
    throw InvalidInput("each of " + std::to_string(cloud.size()) + " points has up to " +
                       std::to_string(cloud.size() - 1) + " nearest ones, not " +
                       std::to_string(k));
  return dispatch(cloud.dimension(), [&](auto d) {
    return kth_nearest_distances(tree_of_all<d>(cloud, threads), k, threads);
  });
}

}  // namespace gradpsi
