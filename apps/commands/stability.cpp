// gradpsi stability: its options; studies/stability.cpp is what it does.

#include "studies/stability.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

void add_stability(CLI::App& app) {
  auto* command = app.add_subcommand(
      "stability", "The stability study: where Laplacians grow, by jitter, support and walls.");
  auto options = std::make_shared<StudyOptions>(StudyOptions{.dimension = 2, .threads = 0});
  options->add_to(*command, "unit line, square or cube",
                  "Fewer points, supports, jitters and seeds", "0: as many as there are");
  command->footer("Example: gradpsi stability --quick --out results");
  command->callback([options] { stability(*options); });
}

}  // namespace gradpsi::apps
