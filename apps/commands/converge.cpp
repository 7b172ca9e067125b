// gradpsi converge: its options; studies/converge.cpp is what it does.

#include "studies/converge.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

std::function<void()> declare_converge(Options& options) {
  auto study = std::make_shared<ConvergeOptions>(ConvergeOptions{{.dimension = 1, .threads = 0}});
  study->declare(options, "domain [-1, 1]^d",
                 "Fewer points: in 1D down to spacing 1e-4 instead of 1e-6",
                 "0: as many as there are");
  options.count("--points-max", study->points_max, {1, 2147483646}, "N",
                "The most points of a cloud [2e6, 5e5, 7e4 in 1, 2, 3D; --quick: 2e4, 3e4, 2.5e4]");
  options.examples("Example: gradpsi converge --quick --out results");
  return [study] { converge(*study); };
}

}  // namespace gradpsi::apps
