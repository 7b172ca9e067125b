#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "search/check.hpp"
#include "search/within.hpp"

namespace gradpsi {
namespace {

constexpr int points_per_chunk = 16384;

/// How far a point has moved since it was looked up, in units of half the skin, beyond which lists no longer
/// hold: a point that was outside two of them could be inside the support by now.
template <int D>
double moved(const Cloud& cloud, const Neighbours& near, int i) {
  const auto at = std::ptrdiff_t{i} * D;
  return (displacement<D>(near.places.data() + at, cloud.positions().data() + at, cloud.box()) /
          (near.skin / 2))
      .norm();
}

void check_sizes(const Cloud& cloud, const Neighbours& near) {
  if (near.size() != cloud.size())
    throw InvalidInput("the neighbours are of " + std::to_string(near.size()) +
                       " points, the cloud has " + std::to_string(cloud.size()));
  if (near.supports.size() != 1 && near.supports.size() != near.size())
    throw InvalidInput("the neighbours have " + std::to_string(near.supports.size()) +
                       " supports for " + std::to_string(near.size()) + " points");
  if (near.skin > 0 &&
      (near.places.rows() != near.size() || near.places.cols() != cloud.dimension()))
    throw InvalidInput("the neighbours were found among points of " +
                       std::to_string(near.places.cols()) + " coordinates, not " +
                       std::to_string(cloud.dimension()));
}

bool has_moved_too_far(const Neighbours& near, const Cloud& cloud, int threads) {
  std::atomic<bool> found = false;
  dispatch(cloud.dimension(), [&](auto d) {
    parallel_chunks(cloud.size(), points_per_chunk, threads, [&](int begin, int end) {
      for (int i = begin; i < end; ++i)
        if (moved<d>(cloud, near, i) > 1) {
          found = true;
          return;
        }
    });
  });
  return found;
}

[[noreturn]] void throw_stale(const Cloud& cloud, const Neighbours& near) {
  int furthest = 0;
  double most = 0;
  dispatch(cloud.dimension(), [&](auto d) {
    for (int i = 0; i < cloud.size(); ++i)
      if (const double far = moved<d>(cloud, near, i); far > most) most = far, furthest = i;
  });
  throw InvalidInput("point " + std::to_string(cloud.number(furthest)) + " has moved by " +
                     shortest(most * near.skin / 2) +
                     " since its neighbours were found, more than half of their skin, " +
                     shortest(near.skin) + ": find them again");
}

}  // namespace

bool is_stale(const Neighbours& near, const Cloud& cloud, int threads) {
  checked_threads(threads);
  check_sizes(cloud, near);
  if (!(near.skin > 0))
    throw InvalidInput("neighbours without a skin do not tell whether points have moved");
  return has_moved_too_far(near, cloud, threads);
}

void check_match(const Cloud& cloud, const Neighbours& near, int threads) {
  check_sizes(cloud, near);
  if (near.skin > 0 && has_moved_too_far(near, cloud, threads)) throw_stale(cloud, near);
}

std::span<const int> within_support(const Cloud& cloud, const Neighbours& near, int i,
                                    std::vector<int>& memory) {
  if (near.skin == 0) return near.of(i);
  const double per_h = 1 / near.support(i);  // as the vector code has it
  memory.clear();
  dispatch(cloud.dimension(), [&](auto d) {
    std::ranges::copy_if(near.of(i), std::back_inserter(memory), [&](int j) {
      return (displacement<decltype(d)::value>(cloud, i, j) * per_h).squaredNorm() < 1;
    });
  });
  return memory;
}

}  // namespace gradpsi
