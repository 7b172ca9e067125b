#pragma once

#include <unistd.h>

#include <iostream>
#include <string>
#include <utility>

namespace gradpsi::apps {

/// A bar on standard error, if that is a terminal: show(done) as work proceeds, up to the total.
class Progress {
 public:
  Progress(int total, std::string unit) : total_(total), unit_(std::move(unit)) {}

  ~Progress() {
    if (filled_ >= 0 && filled_ < 40) std::cerr << '\n';  // an error goes on a line of its own
  }

  void show(int done) {
    const int filled = static_cast<int>(40.0 * done / total_);
    // Steps can take microseconds: the bar is redrawn when it would look different.
    if (!terminal_ || (done < total_ && filled == filled_)) return;
    filled_ = filled;
    std::cerr << "\r[" << std::string(filled, '#') << std::string(40 - filled, ' ') << "] " << done
              << " of " << total_ << ' ' << unit_ << (done < total_ ? "" : "\n") << std::flush;
  }

 private:
  const int total_;
  const std::string unit_;
  const bool terminal_ = isatty(STDERR_FILENO) != 0;
  int filled_ = -1;
};

}  // namespace gradpsi::apps
