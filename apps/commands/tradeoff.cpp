// gradpsi tradeoff: its options; studies/tradeoff.cpp is what it does.

#include "studies/tradeoff.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

void add_tradeoff(CLI::App& app) {
  auto* command = app.add_subcommand(
      "tradeoff", "Accuracy against cost: every scheme, support and kernel, with figures.");
  auto options = std::make_shared<StudyOptions>(StudyOptions{.dimension = 2, .threads = 1});
  options->add_to(*command, "unit line, square or cube",
                  "Two resolutions, two supports, one kernel",
                  "Whose times are measured; 0: as many as there are");
  command->footer("Example: gradpsi tradeoff --quick --out results");
  command->callback([options] { tradeoff(*options); });
}

}  // namespace gradpsi::apps
