// gradpsi stability: its options; studies/stability.cpp is what it does.

#include "studies/stability.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

std::function<void()> declare_stability(Options& options) {
  auto study = std::make_shared<StudyOptions>(StudyOptions{.dimension = 2, .threads = 0});
  study->declare(options, "unit line, square or cube", "Fewer points, supports, jitters and seeds",
                 "0: as many as there are");
  options.examples("Example: gradpsi stability --quick --out results");
  return [study] { stability(*study); };
}

}  // namespace gradpsi::apps
