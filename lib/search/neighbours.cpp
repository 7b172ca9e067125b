#include "gradpsi/neighbours.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/dispatch.hpp"
#include "base/median.hpp"
#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "search/check.hpp"
#include "search/leaf_search.hpp"
#include "search/search.hpp"
#include "search/tree.hpp"
#include "search/within.hpp"

namespace gradpsi {

double largest_support(const Cloud& cloud) {
  double most = std::numeric_limits<double>::infinity();
  for (const double length : cloud.box())
    if (length > 0) most = std::min(most, length / 2);
  return most;
}

namespace {

/// Distances are compared squared, in units of the largest support: so many orders below it, digits are lost.
void check_ratio(const Cloud& cloud, const VectorView& supports) {
  constexpr double least_ratio = 1e-145;
  Eigen::Index least, most;
  if (supports.minCoeff(&least) >= least_ratio * supports.maxCoeff(&most)) return;
  const auto text = [&](Eigen::Index i) {
    return std::to_string(cloud.number(static_cast<int>(i))) + ", " + shortest(supports[i]);
  };
  throw InvalidInput("the support of point " + text(least) + ", vanishes beside that of point " +
                     text(most) + ", once they are squared");
}

}  // namespace

void check_supports(const Cloud& cloud, const VectorView& supports) {
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
  if (supports.size() > 1) check_ratio(cloud, supports);
}

namespace {

constexpr int leaves_for_estimate = 64;

[[noreturn]] void throw_coincident(const Cloud& cloud, double support) {
  const Coincidences all = coincidences(cloud);
  if (all.points.empty())
    throw InvalidInput(
        "some points are so close together that their distance, squared, vanishes beside a support "
        "of " +
        shortest(support));
  throw InvalidInput(words(all, cloud, std::ssize(all.points), cloud.size()));
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

void check_skin(const Cloud& cloud, const VectorView& supports, double skin) {
  if (!(skin > 0 && std::isfinite(skin)))
    throw InvalidInput("the skin must be > 0 and finite, not " + shortest(skin));
  for (int a = 0; a < cloud.dimension(); ++a)
    if (cloud.box()[a] > 0 && supports.maxCoeff() + skin > cloud.box()[a] / 2)
      throw InvalidInput("support and skin, " + shortest(supports.maxCoeff()) + " and " +
                         shortest(skin) + ", are together more than half the periodic box, " +
                         shortest(cloud.box()[a]));
}

void check_isolation(const Cloud& cloud, const Neighbours& near, int threads) {
  int isolated = 0;
  std::vector<int> memory;
  for (int i = 0; i < near.size(); ++i) isolated += within_support(cloud, near, i, memory).empty();
  if (cloud.size() < 2 || isolated <= cloud.size() / 2) return;
  throw InvalidInput(std::to_string(isolated) + " of " + std::to_string(cloud.size()) +
                     " points have no neighbour within the support " + shortest(near.supports[0]) +
                     (near.supports.size() > 1 ? " (of point 0)" : "") +
                     "; the median distance to the nearest point is " +
                     shortest(median(nearest_distances(cloud, threads))));
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

/// The rows of leaves, one after the other; each thread has its own. The counts go to `near`.
template <int D>
struct LeafRows {
  const Tree<D>& tree;
  const Wanted& wanted;
  Neighbours& near;
  LeafSearch<D> search = {};
  std::vector<int> found = {};  // with room past `size`
  std::size_t size = 0;
  bool coincident = false;  // whether two points were in one place

  void append(Leaf leaf) {
    const int* const numbers = tree.points().number.data();
    if (std::none_of(numbers + leaf.begin, numbers + leaf.end, std::cref(wanted))) return;
    gather(search, tree, near, wanted, leaf);
    search.sort();
    for (int k = leaf.begin; k < leaf.end; ++k)
      if (wanted(numbers[k])) append(k);
  }

 private:
  void append(int k) {
    const int i = tree.number(k);
    if (found.size() < size + search.most()) found.resize(2 * (size + search.most()));
    const auto row =
        search.select(tree.point(k), tree.to_units(near.support(i)), found.data() + size);
    near.offsets[i + 1] = row.count;
    size += row.count;
    coincident |= row.coincides;
  }
};

/// The rows of each chunk of leaves, end to end in tree order, in memory of `slabs`; their lengths are
/// near.offsets[i + 1].
template <int D>
std::vector<const int*> rows_by_chunk(const Cloud& cloud, const Tree<D>& tree, const Wanted& wanted,
                                      int threads, Neighbours& near, Slabs& slabs) {
  const int leaf_count = static_cast<int>(tree.leaves().size());
  const double largest = near.supports.maxCoeff();
  std::vector<const int*> chunks((leaf_count + leaves_per_chunk - 1) / leaves_per_chunk);
  std::atomic<std::int64_t> total = 0;
  std::atomic<bool> coincident = false;
  const auto search_chunk = [&, rows = LeafRows<D>{tree, wanted, near}](int begin,
                                                                        int end) mutable {
    rows.size = 0;
    for (int l = begin; l < end; ++l) rows.append(tree.leaves()[l]);
    if (rows.coincident) coincident = true;
    total += static_cast<std::int64_t>(rows.size);
    check_entries(static_cast<double>(total), cloud, largest);
    int* const kept = slabs.take(rows.size);
    std::copy_n(rows.found.data(), rows.size, kept);
    chunks[begin / leaves_per_chunk] = kept;
  };
  parallel_chunks(leaf_count, leaves_per_chunk, threads, search_chunk);
  if (coincident) throw_coincident(cloud, largest);
  return chunks;
}

/// Puts the rows in their places.
template <int D>
void copy_rows(const std::vector<const int*>& chunks, const Tree<D>& tree, int threads,
               Neighbours& near) {
  const auto& leaves = tree.leaves();
  near.indices.resize(near.offsets[near.size()]);
  prefer_large_pages(near.indices.data(), sizeof(int) * near.indices.size());
  near.order.resize(near.size());
  parallel_chunks(static_cast<int>(leaves.size()), leaves_per_chunk, threads,
                  [&](int begin, int end) {
                    const int* row = chunks[begin / leaves_per_chunk];
                    for (int k = leaves[begin].begin; k < leaves[end - 1].end; ++k) {
                      const int i = near.order[k] = tree.number(k);
                      std::copy_n(row, near.count(i), near.indices.data() + near.offsets[i]);
                      row += near.count(i);
                    }
                  });
}

template <int D>
Neighbours find(const Cloud& cloud, const VectorView& supports, double skin, const Wanted& wanted,
                int threads) {
  const int n = cloud.size();
  Neighbours near{IndexVector::Zero(n + 1), {}, supports};
  if (skin > 0) near.places = cloud.positions();
  near.skin = skin;
  if (wanted.count == 0) return near;
  near.supports.array() += skin;  // as far as the search is concerned
  const double largest = near.supports.maxCoeff();
  const Tree<D> tree(cloud, largest, threads);

  // What is clearly too much is refused before anything large is allocated, the rest when counted.
  if (const double estimate = estimated_neighbours(tree, near, wanted);
      estimate > 1.25 * std::numeric_limits<int>::max())
    check_entries(estimate, cloud, largest);

  Slabs slabs;
  const auto chunks = rows_by_chunk(cloud, tree, wanted, threads, near, slabs);
  for (int i = 0; i < n; ++i) near.offsets[i + 1] += near.offsets[i];
  copy_rows(chunks, tree, threads, near);
  near.supports = supports;
  if (wanted.marks.empty()) check_isolation(cloud, near, threads);  // a part may well be sparse
  return near;
}

/// @param place  of each point, in tree order
template <int D>
Neighbours around(const Cloud& cloud, const Tree<D>& tree, const std::vector<int>& place,
                  const std::vector<int>& points, const VectorView& supports, int threads) {
  const int count = static_cast<int>(points.size());
  Neighbours near{IndexVector::Zero(count + 1), {}, supports};
  if (count == 0) return near;
  std::vector<std::vector<int>> rows(count);
  parallel_chunks(count, 16, threads, [&, search = LeafSearch<D>()](int begin, int end) mutable {
    for (int k = begin; k < end; ++k) {
      const int at = place[points[k]];
      const double support = tree.to_units(supports[k]);
      search.gather(tree, Leaf{at, at + 1}, support);
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

Neighbours find_neighbours(const Cloud& cloud, const VectorView& supports, const Skin* skin,
                           const std::vector<int>* rows, int threads) {
  check_supports(cloud, supports);
  if (skin) check_skin(cloud, supports, skin->width);
  checked_threads(threads);
  const Wanted wanted = wanted_rows(rows, cloud.size());
  return dispatch(cloud.dimension(), [&](auto d) {
    return find<decltype(d)::value>(cloud, supports, skin ? skin->width : 0, wanted, threads);
  });
}

}  // namespace

Neighbours find_neighbours(const Cloud& cloud, const VectorView& supports, int threads) {
  return find_neighbours(cloud, supports, nullptr, nullptr, threads);
}

Neighbours find_neighbours(const Cloud& cloud, const VectorView& supports,
                           const std::vector<int>& rows, int threads) {
  return find_neighbours(cloud, supports, nullptr, &rows, threads);
}

Neighbours find_neighbours(const Cloud& cloud, double support, int threads) {
  return find_neighbours(cloud, DenseVector::Constant(1, support), threads);
}

Neighbours find_neighbours(const Cloud& cloud, const VectorView& supports, Skin skin, int threads) {
  return find_neighbours(cloud, supports, &skin, nullptr, threads);
}

Neighbours find_neighbours(const Cloud& cloud, double support, Skin skin, int threads) {
  return find_neighbours(cloud, DenseVector::Constant(1, support), skin, threads);
}

Surroundings surroundings(const Cloud& cloud, double length, int threads) {
  return dispatch(cloud.dimension(), [&](auto d) -> Surroundings {
    constexpr int D = decltype(d)::value;
    const auto tree = std::make_shared<const Tree<D>>(cloud, length, threads);
    std::vector<int> place(cloud.size());
    for (int k = 0; k < tree->size(); ++k) place[tree->number(k)] = k;
    return [&cloud, tree, place = std::move(place), threads](const std::vector<int>& points,
                                                             const VectorView& supports) {
      return around<D>(cloud, *tree, place, points, supports, threads);
    };
  });
}

}  // namespace gradpsi
