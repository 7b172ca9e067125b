// gradpsi advise: which scheme and support to take for the points of a file.
//
// Every scheme of the wanted derivative is tried with five supports on the user's own points: on waves of the
// given length, in every direction of a few, at a sample of the points. The cheapest one whose error is at
// most the tolerance, and that is stable where it is to be stepped in time, is named.

#include <algorithm>
#include <cmath>
#include <gradpsi/error.hpp>
#include <gradpsi/neighbours.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "commands/advice.hpp"
#include "common/anisotropy.hpp"
#include "common/columns.hpp"
#include "common/points.hpp"
#include "studies/candidates.hpp"

namespace gradpsi::apps {

namespace {

using namespace candidates;

void check(const AdviseOptions& options, const Points& points) {
  if (!(options.tolerance > 0 && std::isfinite(options.tolerance)))
    throw InvalidInput("--tolerance must be > 0 and finite, not " + text(options.tolerance));
  if (points.cloud.size() < 2) throw InvalidInput("advice needs two points at least");
}

/// As asked for, or the extent of the points, that of the box where it is periodic.
double wavelength(const AdviseOptions& options, const Cloud& cloud, double spacing) {
  const double length = options.wavelength.value_or(longest_wave(cloud));
  if (!(length > 0 && std::isfinite(length)))
    throw InvalidInput("--wavelength must be > 0 and finite, not " + text(length));
  if (length < 2 * spacing)
    throw InvalidInput("waves of length " + text(length) + " are shorter than two spacings, " +
                       text(2 * spacing) + ": these points cannot tell them from longer ones");
  return length;
}

Trial make_trial(const AdviseOptions& options, const Points& points) {
  const Cloud& cloud = points.cloud;
  const double spacing = cloud.spacing(options.threads);
  const double length = wavelength(options, cloud, spacing);
  Trial trial{.derivative = options.which(),
              .use = options.what_for(),
              .tolerance = options.tolerance,
              .cloud = cloud,
              .spacing = spacing,
              .spacings = local_spacing(cloud, options.threads),
              .supports = {},
              .waves = waves(cloud, length, options.which()),
              .evolving = evolving_points(points, options.fixed),
              .sample = {},
              .assembly = {.kernel = kernel(options.kernel),
                           .on_degenerate = OnDegenerate::Widen,
                           .threads = options.threads}};
  if (points.table.has("support")) trial.supports = points.table.column("support");
  if (trial.evolving.empty()) throw InvalidInput("all points are fixed");
  if (!(std::isnormal(trial.waves.scale) && std::isnormal(std::pow(trial.waves.scale, 2))))
    throw InvalidInput("derivatives of waves of length " + text(length) +
                       " vanish or are beyond the range of a double");
  trial.sample = sampled(trial.evolving, options.sample);
  std::cout << cloud.size() << " points in " << cloud.dimension() << "D, spacing "
            << spacing_text(trial.spacings) << "; waves of length " << text(length) << " ("
            << cell(length / spacing, "%.4g") << " spacings), at " << trial.sample.size()
            << " points\n";
  return trial;
}

void run(const AdviseOptions& options) {
  if (options.which() != Derivative::Laplacian && options.what_for() != Use::Derivative)
    throw BadUsage("--use", "explicit and implicit are about Laplacians");
  const Points points = read_points(options);
  for (const std::string& note : points.notes) std::cerr << "warning: " << note << '\n';
  check(options, points);
  const Trial trial = make_trial(options, points);
  const Neighbours near = find_neighbours(points.cloud, trial.supports_of(3), options.threads);
  if (const auto found = anisotropy(points.cloud, near, options.threads))
    std::cerr
        << "warning: " << words(*found, points.axes)
        << (trial.supports.size() > 0
                ? ""
                : "; with a column 'support' of two or three of the largest, advice is on that")
        << '\n';
  Timer timer;
  std::vector<Candidate> all = candidates::candidates(trial, trial.sample, timer);
  const Candidate* chosen = cheapest(trial, all);
  std::cout << '\n'
            << advice(trial, all, chosen, chosen ? command_line(options, points, *chosen) : "")
            << '\n'
            << table(trial, all, chosen);
  if (options.check) std::cout << '\n' << comparison(trial, chosen, timer);
  if (trial.use == Use::Derivative) std::cerr << timer.warning();  // others do not cost time
}

}  // namespace

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
  return [wanted] { run(*wanted); };
}

}  // namespace gradpsi::apps
