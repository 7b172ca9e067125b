#pragma once

#include <chrono>
#include <utility>

namespace gradpsi::apps {

/// Seconds since the last call, or since construction.
class Stopwatch {
 public:
  double lap() {
    const auto now = Clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

}  // namespace gradpsi::apps
