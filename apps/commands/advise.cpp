// gradpsi advise: its options; studies/advise.cpp is what it does.

#include "studies/advise.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

void add_advise(CLI::App& app) {
  auto* command = app.add_subcommand(
      "advise", "Name the cheapest scheme and support that is accurate enough on given points.");
  auto options = std::make_shared<AdviseOptions>();
  options->add_points_to(*command);
  command->add_option("--operator", options->derivative, "What is wanted: gradient or laplacian")
      ->type_name("NAME")
      ->check(CLI::IsMember({"gradient", "laplacian"}))
      ->required();
  command
      ->add_option("--tolerance", options->tolerance,
                   "The error allowed: root mean square over the points, relative to that of the\n"
                   "derivative")
      ->type_name("E")
      ->required();
  command
      ->add_option("--wavelength", options->wavelength,
                   "Length of the waves that are to be differentiated [the extent of the points]")
      ->type_name("L");
  command
      ->add_option("--use", options->use,
                   "derivative; or a Laplacian for explicit or implicit time steps, which must\n"
                   "not let fields grow")
      ->type_name("USE")
      ->check(CLI::IsMember({"derivative", "explicit", "implicit"}))
      ->capture_default_str();
  command
      ->add_option("--fixed", options->fixed,
                   "Points where this column is not 0 keep their value: their rows do not count")
      ->type_name("COLUMN");
  command->add_option("--sample", options->sample, "Points to measure at; 0: all")
      ->type_name("N")
      ->check(CLI::Range(0, 2147483647))
      ->capture_default_str();
  command->add_flag("--check", options->check,
                    "Measure every candidate on all points, too, and say what the choice from\n"
                    "the sample costs more");
  command->footer(
      "Example: gradpsi advise points.csv --operator laplacian --tolerance 0.01 --use implicit");
  command->callback([options] { advise(*options); });
}

}  // namespace gradpsi::apps
