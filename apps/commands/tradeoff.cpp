// gradpsi tradeoff: accuracy against cost, for every scheme.
//
//     gradpsi tradeoff --quick --out results
//
// differentiates u, a product of sin(4x + 1/2), sin(4y + 1), .. on the unit square (line, cube), by every
// scheme, five supports, six kernels, on regular and jittered lattices of several resolutions, and solves
// the Dirichlet problem lap u = f whose outermost points are held. Errors are relative to the largest value
// of the derivative or the solution; times are of one thread unless told otherwise. Expect: uncorrected
// schemes are cheap and stop at a few per cent; second order goes on from there; higher degrees are the
// cheapest way to anything below 1e-3, where they are stable.

#include "studies/tradeoff.hpp"

#include <algorithm>
#include <cmath>
#include <gradpsi/io.hpp>
#include <gradpsi/kernel.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "commands/study_options.hpp"
#include "common/columns.hpp"
#include "common/gnuplot.hpp"
#include "common/results.hpp"
#include "studies/tradeoff_gp.hpp"

namespace gradpsi::apps {

namespace {

using namespace tradeoff;

/// The cheapest result for an error.
struct Cheapest {
  double error;
  const Result* result;
};

/// For ever smaller errors, as far as the front goes; each result once.
std::vector<Cheapest> cheapest(const Front& front) {
  std::vector<Cheapest> steps;
  for (double error = 0.1; error > 1e-12; error /= std::sqrt(10.0)) {
    const auto found =
        std::ranges::find_if(front.best, [&](auto* r) { return r->*front.use.error <= error; });
    if (found == front.best.end()) break;
    if (steps.empty() || *found != steps.back().result) steps.push_back({error, *found});
  }
  return steps;
}

std::string front_text(const Front& front) {
  if (front.best.empty()) return {};
  const Use& use = front.use;
  const Columns<Cheapest> columns = {
      {"", &Cheapest::error, {"%.0e", 9}},
      {"", [&](auto& c) { return 1e3 * use.seconds(*c.result); }, {"%.3g", 10}},
      {"", [](auto& c) { return " ms   " + name(c.result->scheme); }, {.width = -(6 + 28)}},
      {"", [](auto& c) { return "h/dx " + cell(c.result->support_ratio, "%.1f"); }},
      {"", [](auto& c) { return c.result->points; }, {.width = 9}},
      {"", [](auto& c) { return " points   " + std::string(kernels()[c.result->kernel].name); }}};
  return std::string(name(front.derivative)) + ", " + std::string(name(front.arrangement)) +
         " points, " + use.text + ": the cheapest for an error of\n" +
         text_lines(columns, cheapest(front)) + "  twice the accuracy takes " +
         cell(front.price_of_a_factor_2(), "%.2g") +
         " times as long; best error without correction " + cell(front.uncorrected, "%.1e") +
         ", of all " + cell(front.best.back()->*use.error, "%.1e") + "\n\n";
}

std::string summary(const std::vector<Result>& results) {
  std::string text;
  for (const Derivative derivative : {Derivative::Gradient, Derivative::Laplacian})
    for (const Use& use : uses)
      for (const Arrangement arrangement : {Arrangement::Irregular, Arrangement::Regular})
        text += front_text(front(results, derivative, use, arrangement));
  return text;
}

struct TradeoffOptions : StudyOptions {
  double grading = 1;
};

void run(const TradeoffOptions& options) {
  create_folder(options.out);
  const int dimension = options.dimension.value_or(2);
  const std::string suffix =
      dimension_suffix(dimension, 2) + (options.grading != 1 ? "_graded" : "");
  const auto in_out = [&](const std::string& file) { return options.out / file; };
  Progress progress("clouds and supports");
  Timer timer;
  const auto found = results({dimension, options.quick, options.threads, options.grading}, timer,
                             [&](int done, int total) { progress.show(done, total); });
  const std::string table = "tradeoff" + suffix + ".csv",
                    fronts = "tradeoff_front" + suffix + ".csv";
  write_text(in_out(table), csv(found, dimension));
  write_text(in_out(fronts), front_csv(found));
  const std::string text = summary(found);
  write_text(in_out("tradeoff" + suffix + ".txt"), provenance(options.threads) + '\n' + text);
  std::cout << text << std::flush;
  std::cerr << timer.warning();
  draw(in_out("tradeoff" + suffix + ".gp"),
       "csv = '" + table + "'\nfronts = '" + fronts + "'\nsuffix = '" + suffix +
           "'\ndefault_kernel = '" + std::string(kernels().front().name) + "'\n" + tradeoff_gp,
       in_out(table));
  std::cout << "Results: " << in_out(table).string()
            << "\nFigures: " << in_out("tradeoff_gradient" + suffix + ".png").string() << ", "
            << in_out("tradeoff_laplacian" + suffix + ".png").string() << " (and .svg)\n";
}

}  // namespace

std::function<void()> declare_tradeoff(Options& options) {
  auto study = std::make_shared<TradeoffOptions>();
  study->threads = 1;
  study->declare(options, "unit line, square or cube [2]",
                 "Two resolutions, two supports, one kernel",
                 "Whose times are measured; 0: as many as there are");
  options.number("--grading", study->grading, "G",
                 "Points are drawn together towards the centre, where spacings are so many times\n"
                 "smaller than along the faces; supports are multiples of the local spacing");
  options.examples("Example: gradpsi tradeoff --quick --out results");
  return [study] { run(*study); };
}

}  // namespace gradpsi::apps
