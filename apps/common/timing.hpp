#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/median.hpp"
#include "common/stopwatch.hpp"

namespace gradpsi::apps {

/// Whether more than half of these times are within a quarter of their median.
inline bool agree(const std::vector<double>& seconds) {
  const double middle = median(seconds);
  const auto near = std::ranges::count_if(
      seconds, [&](double s) { return std::abs(s - middle) <= 0.25 * middle; });
  return 2 * near > std::ssize(seconds);
}

/// Times work. Runs whose times do not agree are repeated; how often that did not help is remembered.
class Timer {
 public:
  /// Seconds that work() takes: the median of at least three runs after a first one, and of `at_least` seconds'
  /// worth. What takes over a fifth of a second is run twice.
  template <class Work>
  double seconds(const Work& work, double at_least = 0.1) {
    Stopwatch watch;
    return settled(
        [&] {
          watch.lap();
          work();
          return watch.lap();
        },
        at_least);
  }

  /// The same, each run() telling the seconds of one more run.
  template <class Run>
  double settled(const Run& run, double at_least) {
    constexpr int rounds = 3;
    const double first = run();
    const bool slow = first > 0.2;
    std::vector<double> all;
    if (slow) all.push_back(first);
    ++timed_;
    for (int round = 0; round < rounds; ++round) {
      const std::size_t fewest = all.size() + (slow ? 1 : 3), most = all.size() + (slow ? 1 : 1000);
      for (double total = 0; all.size() < fewest || (total < at_least && all.size() < most);) {
        all.push_back(run());
        total += all.back();
      }
      if (agree(all)) return median(std::move(all));
    }
    ++unsettled_;
    return median(std::move(all));
  }

  /// A line for standard error, unless all times agreed at last.
  std::string warning() const {
    if (unsettled_ == 0) return "";
    return "warning: of " + std::to_string(timed_) + " times " + std::to_string(unsettled_) +
           (unsettled_ == 1 ? " differs" : " differ") +
           " by more than a quarter from run to run, however often repeated: the machine is busy, "
           "and they may be too long\n";
  }

 private:
  int timed_ = 0, unsettled_ = 0;
};

}  // namespace gradpsi::apps
