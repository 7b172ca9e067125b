#pragma once

#include <unistd.h>

#include <functional>
#include <iostream>
#include <string>
#include <utility>

namespace gradpsi::apps {

/// Told how many of how many steps are done, as work proceeds.
using ShowProgress = std::function<void(int done, int total)>;

/// A bar on standard error, if that is a terminal.
class Progress {
 public:
  explicit Progress(std::string unit) : unit_(std::move(unit)) {}

  ~Progress() {
    if (filled_ >= 0 && filled_ < 40) std::cerr << '\n';  // an error goes on a line of its own
  }

  void show(int done, int total) {
    const int filled = static_cast<int>(40.0 * done / total);
    // Steps can take microseconds: the bar is redrawn when it would look different.
    if (!terminal_ || (done < total && filled == filled_)) return;
    filled_ = filled;
    std::cerr << "\r[" << std::string(filled, '#') << std::string(40 - filled, ' ') << "] " << done
              << " of " << total << ' ' << unit_ << (done < total ? "" : "\n") << std::flush;
  }

 private:
  const std::string unit_;
  const bool terminal_ = isatty(STDERR_FILENO) != 0;
  int filled_ = -1;
};

/// A line on standard error of the iteration at hand, if that is a terminal and iterations take long.
class Iterations {
 public:
  void operator()(int iteration, double residual) const {
    if (iteration % 10 == 0 && isatty(STDERR_FILENO) != 0)
      std::cerr << "\riteration " << iteration << ": relative residual " << residual << "    "
                << std::flush;
  }
};

}  // namespace gradpsi::apps
