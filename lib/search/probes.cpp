#include "search/probes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "search/check.hpp"
#include "search/leaf_search.hpp"
#include "search/tree.hpp"

namespace gradpsi {
namespace {

constexpr int probes_per_chunk = 256;
constexpr double infinity = std::numeric_limits<double>::infinity();

void check_probes(const Cloud& cloud, const Positions& probes) {
  if (probes.cols() != cloud.dimension())
    throw InvalidInput("the probes have " + std::to_string(probes.cols()) +
                       " coordinates, the points " + std::to_string(cloud.dimension()));
  for (Eigen::Index k = 0; k < probes.rows(); ++k)
    if (!probes.row(k).allFinite())
      throw InvalidInput("probe " + std::to_string(k) +
                         " has a coordinate that is not finite: " + coordinates(probes, k));
}

void check_not_empty(const Cloud& cloud) {
  if (cloud.size() == 0) throw InvalidInput("there are probes, but no points around them");
}

/// As far from a point as about `count` others are, if they lie evenly.
double likely_reach(const Cloud& cloud, int count) {
  const Positions& x = cloud.positions();
  const double side = (x.colwise().maxCoeff() - x.colwise().minCoeff()).maxCoeff();
  const double share = static_cast<double>(count) / cloud.size();
  return side > 0 ? side * std::pow(share, 1.0 / cloud.dimension()) : 1;
}

/// The length that matters: what is looked for is within the reach, or anywhere.
double length(const Cloud& cloud, const Positions& probes, double reach) {
  if (reach < infinity) return reach;
  const double extent =
      std::max(cloud.positions().cwiseAbs().maxCoeff(), probes.cwiseAbs().maxCoeff());
  return extent > 0 ? extent : 1;
}

/// The points in the probes' box widened by the reach, in periodic directions all.
std::vector<int> points_around(const Cloud& cloud, const Positions& probes, double reach) {
  std::vector<int> result;
  if (probes.rows() == 0) return result;
  const auto d = probes.cols();
  Eigen::RowVectorXd low = probes.colwise().minCoeff(), high = probes.colwise().maxCoeff();
  low.array() -= reach, high.array() += reach;
  for (Eigen::Index a = 0; a < d; ++a)
    if (cloud.box()[a] > 0) {
      low[a] = -infinity;
      high[a] = infinity;
    }
  const double* x = cloud.positions().data();
  for (int i = 0; i < cloud.size(); ++i, x += d) {
    bool inside = true;
    for (Eigen::Index a = 0; a < d; ++a) inside = inside && x[a] >= low[a] && x[a] <= high[a];
    if (inside) result.push_back(i);
  }
  return result;
}

/// The points around some probes, found probe by probe.
template <int D>
class ProbeSearch {
 public:
  /// @param numbers  of the tree's points in the cloud
  ProbeSearch(const Tree<D>& tree, const std::vector<int>& numbers)
      : tree_(tree), numbers_(numbers) {}

  /// The point nearest to x among those within `most`, looked for from `least` on; -1 if there is none.
  int nearest(const Point<D>& x, double least, double most) {
    most = tree_.to_units(most);
    for (double reach = tree_.to_units(least);; reach *= 2) {
      search_.gather(tree_, x, std::min(reach, most));
      const auto found = search_.nearest(x);
      if (found.squared <= reach * reach || reach >= most)
        return found.number < 0 ? -1 : numbers_[found.number];
    }
  }

  /// How far the count-th nearest point is from x; infinity if farther than `most`.
  double distance(const Point<D>& x, int count, double most) {
    most = tree_.to_units(most);
    if (last_ == 0) last_ = tree_.likely_reach({0, tree_.size()}, count);
    for (double reach = std::min(1.1 * last_, most);; reach = std::min(1.5 * reach, most)) {
      search_.gather(tree_, x, reach);
      const double squared = search_.nearest_squared(-1, x, count, reach);
      if (std::isfinite(squared)) return tree_.to_length(last_ = std::sqrt(squared));
      if (reach >= most) return infinity;
    }
  }

  struct Found {
    int count;
    int nearest;      // the nearest point's number in the tree, of several the least
    double distance;  // its
  };
  /// Appends the points within the support, ascending.
  Found within(const Point<D>& x, double support, std::vector<int>& points) {
    const double h = tree_.to_units(support);
    search_.gather(tree_, x, h);
    search_.sort();
    found_.resize(std::max<std::size_t>(found_.size(), search_.most()));
    const int count = search_.select_all(x, h, found_.data());
    for (int k = 0; k < count; ++k) points.push_back(numbers_[found_[k]]);
    const auto nearest = search_.nearest(x);
    return {count, nearest.number, tree_.to_length(std::sqrt(nearest.squared))};
  }

 private:
  const Tree<D>& tree_;
  const std::vector<int>& numbers_;
  LeafSearch<D> search_;
  double last_ = 0;  // distance found, where to begin for the next probe
  std::vector<int> found_;
};

/// How many of a point's nearest ones tell how wide gaps are around it.
int neighbours_told(int dimension) { return 3 * (dimension + 1); }

struct Lists {
  Neighbours near;
  std::vector<unsigned char> outside;  // whether no point is within half the support
};

void take(const std::vector<std::vector<int>>& chunks, Neighbours& near) {
  std::int64_t entries = 0;
  for (int k = 0; k < near.size(); ++k) {
    entries += near.offsets[k + 1];
    if (entries > std::numeric_limits<int>::max())
      throw InvalidInput("the probes would have more than 2^31 - 1 neighbours");
    near.offsets[k + 1] = static_cast<int>(entries);
  }
  near.indices.resize(entries);
  int* to = near.indices.data();
  for (const std::vector<int>& chunk : chunks) to = std::ranges::copy(chunk, to).out;
}

/// Lists from the points within `reach` of the probes' box.
/// @param support_of  (search, x, k): the support of probe k, infinity if these points do not tell
/// @param is_near     (search, found, place): whether the nearest point is near though it is not within half the
///   support; place(number) is where a point of the tree is
template <class SupportOf, class IsNear>
Lists lists(const Cloud& cloud, const Positions& probes, double reach, int threads,
            const SupportOf& support_of, const IsNear& is_near) {
  const auto m = static_cast<int>(probes.rows());
  Lists result{{IndexVector::Zero(m + 1), {}, DenseVector::Constant(m, infinity)},
               std::vector<unsigned char>(m, true)};
  const std::vector<int> numbers = points_around(cloud, probes, reach);
  if (numbers.empty()) return result;
  const Cloud around(cloud.positions()(numbers, Eigen::all), {.box = cloud.box()});
  const Cloud places(probes, {.box = cloud.box()});
  std::vector<std::vector<int>> chunks((m + probes_per_chunk - 1) / probes_per_chunk);
  dispatch(cloud.dimension(), [&](auto d) {
    const Tree<d> tree(around, length(cloud, probes, reach), threads);
    const auto x = tree.scaled(places, threads);
    const auto place = [&](int number) {
      return tree.scaled(Cloud(around.positions().row(number), {.box = cloud.box()}), 1).front();
    };
    parallel_chunks(m, probes_per_chunk, threads,
                    [&, search = ProbeSearch<d>(tree, numbers)](int begin, int end) mutable {
                      for (int k = begin; k < end; ++k) {
                        const double h = support_of(search, x[k], k);
                        result.near.supports[k] = h;
                        if (h == infinity) continue;
                        const auto found = search.within(x[k], h, chunks[k / probes_per_chunk]);
                        result.near.offsets[k + 1] = found.count;
                        result.outside[k] =
                            found.distance > h / 2 && !is_near(search, found, place);
                      }
                    });
  });
  take(chunks, result.near);
  return result;
}

struct Nearest {
  int point = 0;
  double distance = infinity;
};

/// By looking at all of them.
Nearest nearest_point(const Cloud& cloud, const Positions& probes, Eigen::Index k) {
  Nearest result;
  dispatch(cloud.dimension(), [&](auto d) {
    for (int i = 0; i < cloud.size(); ++i) {
      const double r = displacement<decltype(d)::value>(
                           probes.row(k).data(), cloud.positions().row(i).data(), cloud.box())
                           .norm();
      if (r < result.distance) result = {i, r};
    }
  });
  return result;
}

/// Throws for probes outside the cloud, telling some of them.
/// @param supports  as given to neighbours_of_probes(); empty: found
void throw_if_outside(const Cloud& cloud, const Positions& probes, const Lists& found,
                      const VectorView& supports) {
  constexpr int told = 3;
  const auto count = std::ranges::count(found.outside, true);
  if (count == 0) return;
  std::string which;
  int tells = 0;
  for (Eigen::Index k = 0; k < probes.rows() && tells < told; ++k) {
    if (!found.outside[k]) continue;
    ++tells;
    const Nearest nearest = nearest_point(cloud, probes, k);
    which += (which.empty() ? "probe " : ", probe ") + std::to_string(k) + " at " +
             coordinates(probes, k) + ", " + rounded(nearest.distance) + " from point " +
             std::to_string(cloud.number(nearest.point));
    if (supports.size() > 0)
      which += ", where half the support is " +
               rounded(supports[supports.size() == 1 ? 0 : nearest.point] / 2);
  }
  throw InvalidInput(std::to_string(count) + " of " + std::to_string(probes.rows()) + " probes " +
                     (count == 1 ? "is" : "are") + " outside the cloud: " + which +
                     (count > tells ? ", .." : ""));
}

}  // namespace

Neighbours neighbours_of_probes(const Cloud& cloud, const Positions& probes,
                                const VectorView& supports, int threads) {
  checked_threads(threads);
  check_probes(cloud, probes);
  check_supports(cloud, supports);
  if (probes.rows() == 0) return {IndexVector::Zero(1), {}, DenseVector(0)};
  check_not_empty(cloud);
  const double least = supports.minCoeff(), most = supports.maxCoeff();
  const auto support_of = [&](auto& search, const auto& x, int) {
    if (supports.size() == 1) return most;
    const int point = search.nearest(x, least, most);
    return point < 0 ? infinity : supports[point];
  };
  Lists found = lists(cloud, probes, most, threads, support_of,
                      [](auto&, const auto&, const auto&) { return false; });
  throw_if_outside(cloud, probes, found, supports);
  return std::move(found.near);
}

Neighbours nearest_to_probes(const Cloud& cloud, const Positions& probes,
                             const std::vector<int>& counts, int threads) {
  constexpr double wider = 1.1;  // the farthest one is to count, too
  checked_threads(threads);
  check_probes(cloud, probes);
  if (probes.rows() == 0) return {IndexVector::Zero(1), {}, DenseVector(0)};
  check_not_empty(cloud);
  const double limit = largest_support(cloud),
               likely = 3 * likely_reach(cloud, std::ranges::max(counts));
  const int around = std::min(neighbours_told(cloud.dimension()), cloud.size() - 1);
  Lists found;
  for (const double reach : {likely, infinity}) {
    const double most = std::min(reach / wider, limit);
    const auto support_of = [&](auto& search, const auto& x, int k) {
      const double r = search.distance(x, std::min(counts[k], cloud.size()), most);
      if (r == infinity) return reach == infinity ? limit : r;
      return std::min(limit, r > 0 ? wider * r : likely);
    };
    const auto is_near = [&](auto& search, const auto& nearest, const auto& place) {
      // As far as these points tell; beyond, there are others that are not among them.
      const double known = reach < infinity ? most - nearest.distance : limit;
      if (around == 0 || !(nearest.distance <= known)) return false;
      const double r = search.distance(place(nearest.nearest), around + 1, known);
      return r < infinity ? nearest.distance <= r : reach == infinity;
    };
    found = lists(cloud, probes, reach, threads, support_of, is_near);
    if (std::ranges::count(found.outside, true) == 0) break;
  }
  throw_if_outside(cloud, probes, found, DenseVector());
  return std::move(found.near);
}

}  // namespace gradpsi
