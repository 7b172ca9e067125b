// gradpsi tradeoff: its options; studies/tradeoff.cpp is what it does.

#include "studies/tradeoff.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

std::function<void()> declare_tradeoff(Options& options) {
  auto study = std::make_shared<StudyOptions>(StudyOptions{.dimension = 2, .threads = 1});
  study->declare(options, "unit line, square or cube", "Two resolutions, two supports, one kernel",
                 "Whose times are measured; 0: as many as there are");
  options.examples("Example: gradpsi tradeoff --quick --out results");
  return [study] { tradeoff(*study); };
}

}  // namespace gradpsi::apps
