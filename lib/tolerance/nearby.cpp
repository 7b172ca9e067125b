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

/// Distances squared to the neighbours of `points`.
template <int D>
std::vector<double> squared_distances(const Cloud& cloud, const Neighbours& near,
                                      const std::vector<int>& points, int threads) {
  std::vector<double> squared(near.indices.size());
  parallel_chunks(static_cast<int>(points.size()), 256, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int e = near.offsets[points[k]]; e < near.offsets[points[k] + 1]; ++e)
        squared[e] = displacement<D>(cloud, points[k], near.indices[e]).squaredNorm();
  });
  return squared;
}

/// The supports of `points` with `count` neighbours, as far as their lists are long enough.
DenseVector supports_of(const Neighbours& wide, const std::vector<double>& squared,
                        const std::vector<int>& points, int count, int threads) {
  DenseVector supports = wide.supports;
  parallel_chunks(static_cast<int>(points.size()), 256, threads, [&](int begin, int end) {
    std::vector<double> some;
    for (int k = begin; k < end; ++k) {
      const int i = points[k];
      if (wide.count(i) < count) continue;
      some.assign(squared.begin() + wide.offsets[i], squared.begin() + wide.offsets[i + 1]);
      std::ranges::nth_element(some, some.begin() + count - 1);
      supports[i] = std::min(supports[i], beyond_last * std::sqrt(some[count - 1]));
    }
  });
  return supports;
}

/// The parts of lists within `supports`.
Neighbours within(const Neighbours& wide, const std::vector<double>& squared,
                  const std::vector<int>& points, const DenseVector& supports, int threads) {
  const auto n = static_cast<int>(wide.offsets.size()) - 1, count = static_cast<int>(points.size());
  const auto inside = [&](int i, int e) { return squared[e] < supports[i] * supports[i]; };
  Neighbours near{IndexVector::Zero(n + 1), {}, supports, wide.order};
  parallel_chunks(count, 256, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k)
      for (int i = points[k], e = wide.offsets[i]; e < wide.offsets[i + 1]; ++e)
        near.offsets[i + 1] += inside(i, e);
  });
  std::partial_sum(near.offsets.begin(), near.offsets.end(), near.offsets.begin());
  near.indices.resize(near.offsets[n]);
  parallel_chunks(count, 256, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      int at = near.offsets[points[k]];
      for (int i = points[k], e = wide.offsets[i]; e < wide.offsets[i + 1]; ++e)
        if (inside(i, e)) near.indices[at++] = wide.indices[e];
    }
  });
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
  find(all);
}

void Nearby::find(const std::vector<int>& points) {
  wide_ = find_neighbours(cloud_, supports_, points, threads_);
  squared_ = dispatch(cloud_.dimension(), [&](auto d) {
    return squared_distances<d>(cloud_, wide_, points, threads_);
  });
}

/// Makes the lists of these points long enough.
void Nearby::reach(const std::vector<int>& points, int count) {
  const double most = largest_support(cloud_);
  count = std::min(count, cloud_.size() - 1);
  if (std::ranges::any_of(points, [&](int i) { return wide_.count(i) == 0; }))
    find(points);  // the lists of other points were kept
  for (;;) {
    bool longer = false;
    for (const int i : points)
      if (wide_.count(i) < count && supports_[i] < most) {
        // As if points lay evenly, and a bit more.
        const double more = static_cast<double>(count) / std::max(wide_.count(i), 1);
        const double growth = 1.1 * std::pow(more, 1.0 / cloud_.dimension());
        supports_[i] = std::min(std::min(growth, 2.0) * supports_[i], most);
        longer = true;
      }
    if (!longer) return;
    find(points);
  }
}

Neighbours Nearby::nearest(const std::vector<int>& points, int count) {
  // Of the points within beyond_last times the distance to the last one none may be missing.
  reach(points, static_cast<int>(std::ceil(count * std::pow(beyond_last, cloud_.dimension()))));
  return within(wide_, squared_, points, supports_of(wide_, squared_, points, count, threads_),
                threads_);
}

}  // namespace gradpsi
