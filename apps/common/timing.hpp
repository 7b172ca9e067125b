#pragma once

#include <vector>

#include "../../lib/base/median.hpp"
#include "../../lib/base/stopwatch.hpp"

namespace gradpsi::apps {

/// Seconds that work() takes: the median of at least three runs after a first one, and of `at_least` seconds'
/// worth. What takes over a fifth of a second is run once.
template <class Work>
double median_seconds(const Work& work, double at_least = 0.1) {
  gradpsi::Stopwatch watch;
  work();
  if (const double once = watch.lap(); once > 0.2) return once;
  std::vector<double> seconds;
  for (double total = 0; seconds.size() < 3 || (total < at_least && seconds.size() < 1000);) {
    watch.lap();
    work();
    seconds.push_back(watch.lap());
    total += seconds.back();
  }
  return gradpsi::median(Eigen::Map<Eigen::VectorXd>(seconds.data(), std::ssize(seconds)));
}

}  // namespace gradpsi::apps
