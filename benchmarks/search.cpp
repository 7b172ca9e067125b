// Neighbours within a distance: the library's search, and the ways of using nanoflann for it.

#include <algorithm>
#include <nanoflann.hpp>

#include "parallel.hpp"
#include "suite.hpp"

namespace {

using gradpsi::Positions;

struct Points {
  const Positions& x;
  std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(x.rows()); }
  double kdtree_get_pt(std::size_t i, std::size_t a) const {
    return x.data()[i * static_cast<std::size_t>(x.cols()) + a];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

template <int D>
using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points, double, int>,
                                        Points, D, int>;

#if NANOFLANN_VERSION >= 0x150
using Parameters = nanoflann::SearchParameters;
using Match = nanoflann::ResultItem<int, double>;
#else
using Parameters = nanoflann::SearchParams;
using Match = std::pair<int, double>;
#endif

/// Takes what is nearer than a radius straight into a list, without distances.
class Appender {
 public:
  using DistanceType = double;
  using IndexType = int;

  Appender(std::vector<int>& list, int self, double squared_radius)
      : list_(list), first_(list.size()), self_(self), squared_radius_(squared_radius) {}
  bool addPoint(double squared_distance, int j) {
    if (squared_distance < squared_radius_ && j != self_) list_.push_back(j);
    return true;
  }
  double worstDist() const { return squared_radius_; }
  std::size_t size() const { return list_.size() - first_; }
  bool full() const { return true; }
  bool empty() const { return size() == 0; }
  void sort() { std::sort(list_.begin() + static_cast<std::ptrdiff_t>(first_), list_.end()); }

 private:
  std::vector<int>& list_;
  std::size_t first_;
  int self_;
  double squared_radius_;
};

/// Appends the neighbours of point i, ascending, by radiusSearch as its documentation shows it.
struct ByRadius {
  static constexpr int leaf = 10;  // nanoflann's default
  std::vector<Match> matches = {};

  template <int D>
  void operator()(const Tree<D>& tree, const double* x, int i, double squared_radius,
                  std::vector<int>& list) {
    matches.clear();
    tree.radiusSearch(x, squared_radius, matches, Parameters());
    const auto first = static_cast<std::ptrdiff_t>(list.size());
    for (const auto& match : matches)
      if (match.first != i) list.push_back(match.first);
    std::sort(list.begin() + first, list.end());
  }
};

struct ByCallback {
  static constexpr int leaf = 16;

  template <int D>
  void operator()(const Tree<D>& tree, const double* x, int i, double squared_radius,
                  std::vector<int>& list) {
    Appender result(list, i, squared_radius);
    tree.findNeighbors(result, x, Parameters());
    result.sort();
  }
};

/// Compressed rows by a search for each point, a list for each thread put together at the end.
template <class Search, int D>
gradpsi::Neighbours search(const Positions& x, double radius, int threads) {
  const Points points{x};
  const Tree<D> tree(D, points, nanoflann::KDTreeSingleIndexAdaptorParams(Search::leaf));
  const int n = static_cast<int>(x.rows()), share = (n + threads - 1) / threads;
  std::vector<std::vector<int>> lists((n + share - 1) / share);
  gradpsi::Neighbours near{.offsets = Eigen::VectorXi::Zero(n + 1),
                           .indices = {},
                           .supports = Eigen::VectorXd::Constant(1, radius)};
  parallel_chunks(n, share, threads, [&](int begin, int) {
    std::vector<int>& list = lists[begin / share];
    Search append;
    for (int i = begin; i < std::min(n, begin + share); ++i) {
      append(tree, x.data() + std::ptrdiff_t{i} * D, i, radius * radius, list);
      near.offsets[i + 1] = static_cast<int>(list.size());
    }
  });
  for (int part = 1; part < std::ssize(lists); ++part)
    for (int i = part * share; i < std::min(n, (part + 1) * share); ++i)
      near.offsets[i + 1] += near.offsets[part * share];
  near.indices.resize(near.offsets[n]);
  parallel_chunks(static_cast<int>(lists.size()), 1, threads, [&](int part, int) {
    std::copy(lists[part].begin(), lists[part].end(),
              near.indices.begin() + near.offsets[part * share]);
  });
  return near;
}

template <class Search>
gradpsi::Neighbours search(const gradpsi::Cloud& cloud, double radius, int threads) {
  switch (cloud.dimension()) {
    case 1: return search<Search, 1>(cloud.positions(), radius, threads);
    case 2: return search<Search, 2>(cloud.positions(), radius, threads);
    default: return search<Search, 3>(cloud.positions(), radius, threads);
  }
}

void count_search(benchmark::State& state, const Prepared& scene) {
  const auto n = static_cast<double>(scene.cloud.size());
  const auto found = static_cast<double>(scene.near.indices.size());
  count(state, scene,
        {.entries = found, .bytes = 8 * n * scene.cloud.dimension() + 4 * (n + found)});
}

template <class Search>
void add_rival(const std::string& impl, const Scene& scene) {
  add("op:search/impl:" + impl, scene, [=](benchmark::State& state, Prepared& p, int threads) {
    const double radius = p.near.support(0);
    const bool right = p.derived.get(impl, [&] {
      const auto near = search<Search>(p.cloud, radius, threads);
      return near.offsets == p.near.offsets && near.indices == p.near.indices;
    });
    if (!right) return state.SkipWithError("other neighbours than the library's");
    for (auto _ : state) benchmark::DoNotOptimize(search<Search>(p.cloud, radius, threads));
    count_search(state, p);
  });
}

template <int D>
void build_tree(const Positions& x) {
  const Points points{x};
  const Tree<D> tree(D, points, nanoflann::KDTreeSingleIndexAdaptorParams(ByCallback::leaf));
  benchmark::DoNotOptimize(&tree);
}

}  // namespace

void add_search(const Scene& scene) {
  add("op:search/impl:gradpsi", scene, [](benchmark::State& state, Prepared& p, int threads) {
    for (auto _ : state)
      benchmark::DoNotOptimize(find_neighbours(p.cloud, p.near.supports, threads));
    count_search(state, p);
  });
}

void add_spacing(const Scene& scene) {
  add("op:spacing/impl:gradpsi", scene, [](benchmark::State& state, Prepared& p, int threads) {
    const gradpsi::Cloud bare(p.cloud.positions());
    for (auto _ : state) benchmark::DoNotOptimize(local_spacing(bare, threads));
    count(state, p, {});
  });
}

void add_rival_searches(const Scene& scene) {
  add_rival<ByRadius>("nanoflann-radius", scene);
  add_rival<ByCallback>("nanoflann-callback", scene);
  add("op:tree/impl:nanoflann", scene,
      [](benchmark::State& state, Prepared& p, int) {
        const Positions& x = p.cloud.positions();
        for (auto _ : state) {
          if (p.cloud.dimension() == 1) build_tree<1>(x);
          if (p.cloud.dimension() == 2) build_tree<2>(x);
          if (p.cloud.dimension() == 3) build_tree<3>(x);
        }
        count(state, p, {});
      },
      {1});  // nanoflann builds with one thread
}
