// gradpsi advise: its options; studies/advise.cpp is what it does.

#include "studies/advise.hpp"

#include <memory>

#include "commands.hpp"

namespace gradpsi::apps {

std::function<void()> declare_advise(Options& options) {
  auto wanted = std::make_shared<AdviseOptions>();
  wanted->declare_points(options);
  options
      .choice("--operator", wanted->derivative, {"gradient", "laplacian"}, "NAME",
              "What is wanted: gradient or laplacian")
      .required();
  options
      .number("--tolerance", wanted->tolerance, "E",
              "The error allowed: root mean square over the points, relative to that of the\n"
              "derivative")
      .required();
  options.number("--wavelength", wanted->wavelength, "L",
                 "Length of the waves that are to be differentiated [the extent of the points]");
  options.choice("--use", wanted->use, {"derivative", "explicit", "implicit"}, "USE",
                 "derivative; or a Laplacian for explicit or implicit time steps, which must\n"
                 "not let fields grow");
  options.text("--fixed", wanted->fixed, "COLUMN",
               "Points where this column is not 0 keep their value: their rows do not count");
  options.count("--sample", wanted->sample, {0, 2147483647}, "N", "Points to measure at; 0: all");
  options.flag("--check", wanted->check,
               "Measure every candidate on all points, too, and say what the choice from\n"
               "the sample costs more");
  options.examples(
      "Example: gradpsi advise points.csv --operator laplacian --tolerance 0.01 --use implicit");
  return [wanted] { advise(*wanted); };
}

}  // namespace gradpsi::apps
