#include <algorithm>
#include <cmath>
#include <string>

#include "base/dispatch.hpp"
#include "base/median.hpp"
#include "base/parallel.hpp"
#include "base/sum.hpp"
#include "gradpsi/cloud.hpp"
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

template <int D>
DenseVector nearest(const Cloud& cloud, int threads) {
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
  return dispatch(cloud.dimension(),
                  [&](auto d) { return nearest<decltype(d)::value>(cloud, threads); });
}

// Here, so that a cloud need not know about a search.
double Cloud::spacing(int threads) const {
  checked_threads(threads);
  if (has_volumes()) {
    Sum sum;
    for (const double volume : volumes_) sum += volume;
    return std::pow(sum.value() / size(), 1.0 / dimension());
  }
  if (size() < 2)
    throw InvalidInput("the spacing of " + std::to_string(size()) +
                       " point(s) without volumes is not defined");
  const double spacing = median(nearest_distances(*this, threads));
  if (!(spacing > 0))
    throw InvalidInput("most points coincide with another one; their spacing is 0");
  return spacing;
}

}  // namespace gradpsi
