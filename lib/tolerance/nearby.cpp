#include "tolerance/nearby.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "cloud/points.hpp"
#include "search/check.hpp"
#include "tolerance/candidates.hpp"

namespace gradpsi {
namespace {

/// The supports of `points` with `count` neighbours, as far as their lists are long enough.
template <int D>
DenseVector supports_of(const Cloud& cloud, const Neighbours& wide, const std::vector<int>& points,
                        int count, int threads) {
  DenseVector supports = wide.supports;
  parallel_chunks(static_cast<int>(points.size()), 256, threads, [&](int begin, int end) {
    std::vector<double> distances;
    for (int k = begin; k < end; ++k) {
      const int i = points[k];
      if (wide.count(i) < count) continue;
      distances.clear();
      for (const int j : wide.of(i)) distances.push_back(displacement<D>(cloud, i, j).norm());
      std::ranges::nth_element(distances, distances.begin() + count - 1);
      supports[i] = std::min(supports[i], beyond_last * distances[count - 1]);
    }
  });
  return supports;
}

/// The parts of lists within `supports`.
template <int D>
Neighbours within(const Cloud& cloud, const Neighbours& wide, const std::vector<int>& points,
                  const DenseVector& supports, int threads) {
  std::vector<std::vector<int>> lists(points.size());
  parallel_chunks(static_cast<int>(points.size()), 256, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (const int j : wide.of(points[k]))
        if (displacement<D>(cloud, points[k], j).squaredNorm() <
            supports[points[k]] * supports[points[k]])
          lists[k].push_back(j);
  });
  Neighbours near{IndexVector::Zero(cloud.size() + 1), {}, supports, wide.order};
  for (std::size_t k = 0; k < points.size(); ++k)
    near.offsets[points[k] + 1] = static_cast<int>(lists[k].size());
  std::partial_sum(near.offsets.begin(), near.offsets.end(), near.offsets.begin());
  near.indices.resize(near.offsets[cloud.size()]);
  for (std::size_t k = 0; k < points.size(); ++k)
    std::ranges::copy(lists[k], near.indices.begin() + near.offsets[points[k]]);
  return near;
}

}  // namespace

Nearby::Nearby(const Cloud& cloud, int count, int threads)
    : cloud_(cloud),
      threads_(threads),
      supports_((1 + 1e-9) * beyond_last *
                kth_nearest_distances(cloud, std::min(count, cloud.size() - 1), threads)),
      wide_{} {
  supports_ = supports_.cwiseMin(largest_support(cloud));
  std::vector<int> all(cloud.size());
  std::iota(all.begin(), all.end(), 0);
  wide_ = find_neighbours(cloud, supports_, all, threads);
}

/// Makes the lists of these points long enough.
void Nearby::reach(const std::vector<int>& points, int count) {
  constexpr double growth = 1.25;
  const double most = largest_support(cloud_);
  count = std::min(count, cloud_.size() - 1);
  if (std::ranges::any_of(points, [&](int i) { return wide_.count(i) == 0; }))
    wide_ =
        find_neighbours(cloud_, supports_, points, threads_);  // those of other points were kept
  for (;;) {
    bool longer = false;
    for (const int i : points)
      if (wide_.count(i) < count && supports_[i] < most) {
        supports_[i] = std::min(growth * supports_[i], most);
        longer = true;
      }
    if (!longer) return;
    wide_ = find_neighbours(cloud_, supports_, points, threads_);
  }
}

Neighbours Nearby::nearest(const std::vector<int>& points, int count) {
  // Of the points within beyond_last times the distance to the last one none may be missing.
  reach(points, static_cast<int>(std::ceil(count * std::pow(beyond_last, cloud_.dimension()))));
  return dispatch(cloud_.dimension(), [&](auto d) {
    const DenseVector supports = supports_of<d>(cloud_, wide_, points, count, threads_);
    return within<d>(cloud_, wide_, points, supports, threads_);
  });
}

}  // namespace gradpsi
