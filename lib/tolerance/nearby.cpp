#include "tolerance/nearby.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "cloud/points.hpp"
#include "search/check.hpp"
#include "search/leaf_search.hpp"
#include "tolerance/candidates.hpp"

namespace gradpsi {
namespace {

/// Of all points within beyond_last times the distance to the `count` nearest ones, if they lie evenly.
int with_those_beyond(int count, int dimension) {
  return static_cast<int>(std::ceil(count * std::pow(beyond_last, dimension)));
}

}  // namespace

Nearby::Nearby(const Cloud& cloud, int count, int most, int threads)
    : cloud_(cloud),
      most_(with_those_beyond(most, cloud.dimension())),
      threads_(threads),
      supports_((1 + 1e-9) * beyond_last *
                kth_nearest_distances(cloud, std::min(count, cloud.size() - 1), threads)),
      lists_(cloud.size()) {
  supports_ = supports_.cwiseMin(largest_support(cloud));
  std::vector<int> all(cloud.size());
  std::iota(all.begin(), all.end(), 0);
  Neighbours near = find_neighbours(cloud, supports_, all, threads);
  keep(all, near);
  order_ = std::move(near.order);
}

/// Takes the lists of these points, those of all of them or of others, too.
void Nearby::keep(const std::vector<int>& points, const Neighbours& near) {
  const std::size_t before = indices_.size();
  const bool of_all = near.size() == cloud_.size();
  indices_.insert(indices_.end(), near.indices.begin(), near.indices.end());
  squared_.resize(indices_.size());
  dispatch(cloud_.dimension(), [&](auto d) {
    parallel_chunks(static_cast<int>(points.size()), 256, threads_, [&](int begin, int end) {
      for (int k = begin; k < end; ++k) {
        const int i = points[k], row = of_all ? i : k;
        lists_[i] = {before + near.offsets[row], near.count(row)};
        for (std::size_t e = lists_[i].begin; e < lists_[i].begin + lists_[i].count; ++e)
          squared_[e] = squared_distance<d>(cloud_, i, indices_[e]);
      }
    });
  });
}

/// Makes the lists of these points long enough; of a few, as long as any can want.
void Nearby::reach(const std::vector<int>& points, int count) {
  const double most = largest_support(cloud_);
  const auto is_long = [&](int i) { return lists_[i].count >= count || supports_[i] >= most; };
  count = std::min(count, cloud_.size() - 1);
  std::vector<int> shorter;
  std::ranges::remove_copy_if(points, std::back_inserter(shorter), is_long);
  const bool few = std::ssize(shorter) < cloud_.size() / 8;
  if (few) count = std::min(most_, cloud_.size() - 1);
  while (!shorter.empty()) {
    for (const int i : shorter) {
      // As if points lay evenly, and a bit more.
      const double more = static_cast<double>(count) / std::max(lists_[i].count, 1);
      const double growth = 1.1 * std::pow(more, 1.0 / cloud_.dimension());
      supports_[i] = std::min(std::min(growth, 2.0) * supports_[i], most);
    }
    if (few) {
      if (!around_) around_ = surroundings(cloud_, supports_.maxCoeff(), threads_);
      keep(shorter, around_(shorter, supports_(shorter)));
    } else {
      keep(shorter, find_neighbours(cloud_, supports_, shorter, threads_));
    }
    std::erase_if(shorter, is_long);
  }
}

/// With `count` neighbours, as far as the list is long enough.
double Nearby::support(int i, int count, std::vector<double>& memory) const {
  const auto [begin, size] = lists_[i];
  const double* const first = squared_.data() + begin;
  memory.assign(first, first + size);
  return std::min(supports_[i], beyond_last * std::sqrt(ranked(memory, count)));
}

Neighbours Nearby::nearest(const std::vector<int>& points, int count) {
  // Of the points within beyond_last times the distance to the last one none may be missing.
  reach(points, with_those_beyond(count, cloud_.dimension()));
  const int n = cloud_.size(), some = static_cast<int>(points.size());
  Neighbours near{IndexVector::Zero(n + 1), {}, supports_, order_};
  parallel_chunks(
      some, 256, threads_, [&, memory = std::vector<double>()](int begin, int end) mutable {
        for (int k = begin; k < end; ++k) {
          const int i = points[k];
          const double h = near.supports[i] = support(i, count, memory);
          const double* const squared = squared_.data() + lists_[i].begin;
          near.offsets[i + 1] = static_cast<int>(std::count_if(
              squared, squared + lists_[i].count, [h](double r2) { return r2 < h * h; }));
        }
      });
  std::partial_sum(near.offsets.begin(), near.offsets.end(), near.offsets.begin());
  near.indices.resize(near.offsets[n]);
  parallel_chunks(some, 256, threads_, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = points[k];
      const double h = near.supports[i];
      int* at = near.indices.data() + near.offsets[i];
      for (std::size_t e = lists_[i].begin; e < lists_[i].begin + lists_[i].count; ++e)
        if (squared_[e] < h * h) *at++ = indices_[e];
    }
  });
  return near;
}

}  // namespace gradpsi
