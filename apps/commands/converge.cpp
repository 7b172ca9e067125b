// gradpsi converge: its options; studies/converge.cpp is what it does.

#include "studies/converge.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

void add_converge(CLI::App& app) {
  auto* command = app.add_subcommand("converge",
                                     "The convergence study: error against spacing for the "
                                     "seventeen schemes\nof the paper, with figures.");
  auto options = std::make_shared<ConvergeOptions>(ConvergeOptions{{.dimension = 1, .threads = 0}});
  options->add_to(*command, "domain [-1, 1]^d",
                  "Fewer points: in 1D down to spacing 1e-4 instead of 1e-6",
                  "0: as many as there are");
  command
      ->add_option(
          "--points-max", options->points_max,
          "The most points of a cloud [2e6, 5e5, 7e4 in 1, 2, 3D; --quick: 2e4, 3e4, 2.5e4]")
      ->type_name("N")
      ->check(CLI::Range(1, 2147483646));
  command->footer("Example: gradpsi converge --quick --out results");
  command->callback([options] { converge(*options); });
}

}  // namespace gradpsi::apps
