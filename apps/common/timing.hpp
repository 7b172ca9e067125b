#pragma once

#include <utility>
#include <vector>

#include "common/median.hpp"
#include "common/stopwatch.hpp"

namespace gradpsi::apps {

/// Seconds that work() takes: the median of at least three runs after a first one, and of `at_least` seconds'
/// worth. What takes over a fifth of a second is run once.
template <class Work>
double median_seconds(const Work& work, double at_least = 0.1) {
  Stopwatch watch;
  work();
  if (const double once = watch.lap(); once > 0.2) return once;
  std::vector<double> seconds;
  for (double total = 0; seconds.size() < 3 || (total < at_least && seconds.size() < 1000);) {
    watch.lap();
    work();
    seconds.push_back(watch.lap());
    total += seconds.back();
  }
  return median(std::move(seconds));
}

}  // namespace gradpsi::apps
