// gradpsi converge: the convergence study of the paper (its Figs. 1 and 2).
//
//     gradpsi converge --quick --out results
//
// differentiates u = 1 + cos(pi x) (in d dimensions 1 + the product of the cosines) on [-1, 1]^d
// with each of the seventeen schemes, three support ratios, on regular and jittered points of ever smaller spacing,
// with supports truncated at the boundary. Expect, in 1D: no convergence without correction, and
// second derivatives on irregular points that get worse; order 1 to 2 with first-, 2 with
// second-order consistency; and at spacings below 1e-4 the rounding of u, magnified by 1/dx^2, in
// the second ones.

#include "studies/converge.hpp"

#include <array>
#include <gradpsi/error.hpp>
#include <gradpsi/io.hpp>
#include <iostream>
#include <memory>
#include <optional>

#include "commands.hpp"
#include "commands/study_options.hpp"
#include "common/gnuplot.hpp"
#include "common/results.hpp"
#include "studies/converge_summary.hpp"
#include "studies/convergence_gp.hpp"

namespace gradpsi::apps {

namespace {

using namespace converge;

struct ConvergeOptions : StudyOptions {
  std::optional<int> points_max = {};

  int most_points() const {
    static constexpr std::array quick_points = {20'000, 30'000, 25'000};
    static constexpr std::array full_points = {2'000'000, 500'000, 70'000};
    return points_max.value_or((quick ? quick_points : full_points)[dimension - 1]);
  }
};

void run(const ConvergeOptions& options) {
  static constexpr std::array smallest = {20, 196, 2744};
  const int most_points = options.most_points();
  if (sides(options.dimension, most_points).empty())
    throw InvalidInput(
        "--points-max " + std::to_string(most_points) +
        " is less than the smallest cloud has: " + std::to_string(smallest[options.dimension - 1]));
  create_folder(options.out);
  const std::string suffix = dimension_suffix(options.dimension, 1);
  const auto in_out = [&](const std::string& name) { return options.out / name; };

  Progress progress("clouds and supports");
  const auto found = results({options.dimension, most_points, options.threads},
                             [&](int done, int total) { progress.show(done, total); });
  const std::string table = "convergence" + suffix + ".csv";
  write_text(in_out(table), csv(found, options.dimension));

  const std::string text = summary(found, options.dimension);
  write_text(in_out("convergence" + suffix + ".txt"),
             provenance(options.threads) + "# seed: " + std::to_string(seed) + "\n\n" + text);
  std::cout << text << std::flush;

  draw(in_out("convergence" + suffix + ".gp"),
       "csv = '" + table + "'\nsuffix = '" + suffix + "'\n" +
           (options.dimension == 1 ? "error_column = 6\nerror_name = 'L2 error'\n"
                                   : "error_column = 9\nerror_name = 'L2 error, interior'\n") +
           convergence_gp,
       in_out(table));
  std::cout << "\nResults: " << in_out(table).string()
            << "\nFigures: " << in_out("figure1" + suffix + ".png").string() << ", "
            << in_out("figure2" + suffix + ".png").string() << " (and .svg)\n";
}

}  // namespace

std::function<void()> declare_converge(Options& options) {
  auto study = std::make_shared<ConvergeOptions>(ConvergeOptions{{.dimension = 1, .threads = 0}});
  study->declare(options, "domain [-1, 1]^d",
                 "Fewer points: in 1D down to spacing 1e-4 instead of 1e-6",
                 "0: as many as there are");
  options.count("--points-max", study->points_max, {1, 2147483646}, "N",
                "The most points of a cloud [2e6, 5e5, 7e4 in 1, 2, 3D; --quick: 2e4, 3e4, 2.5e4]");
  options.examples("Example: gradpsi converge --quick --out results");
  return [study] { run(*study); };
}

}  // namespace gradpsi::apps
