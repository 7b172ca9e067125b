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
//
//     gradpsi converge --cited --out results
//
// has the schemes up to degree 4 on irregular points of two spacings instead, errors inside and at the wall apart.

#include "studies/converge.hpp"

#include <array>
#include <cmath>
#include <gradpsi/error.hpp>
#include <gradpsi/io.hpp>
#include <iostream>
#include <memory>
#include <optional>

#include "commands.hpp"
#include "commands/study_options.hpp"
#include "common/gnuplot.hpp"
#include "common/results.hpp"
#include "studies/cited.hpp"
#include "studies/cited_gp.hpp"
#include "studies/converge_summary.hpp"
#include "studies/convergence_gp.hpp"

namespace gradpsi::apps {

namespace {

struct ConvergeOptions : StudyOptions {
  bool cited = false;
  std::optional<int> points_max = {};

  /// @param quick_points, full_points  in 1, 2, 3 dimensions
  int most_points(int of_dimension, const std::array<int, 3>& quick_points,
                  const std::array<int, 3>& full_points) const {
    return points_max.value_or((quick ? quick_points : full_points)[of_dimension - 1]);
  }
};

/// Where a study's text goes: into a file of its name and onto the screen.
void tell(const std::string& text, const std::filesystem::path& file, int threads,
          std::uint64_t seed) {
  write_text(file, provenance(threads) + "# seed: " + std::to_string(seed) + "\n\n" + text);
  std::cout << text << std::flush;
}

InvalidInput too_few_points(int most_points, int smallest) {
  return InvalidInput("--points-max " + std::to_string(most_points) +
                      " is less than the smallest cloud has: " + std::to_string(smallest));
}

void study_classified(const ConvergeOptions& options) {
  static constexpr std::array smallest = {20, 196, 2744};
  const int dimension = options.dimension.value_or(1);
  const int most_points =
      options.most_points(dimension, {20'000, 30'000, 25'000}, {2'000'000, 500'000, 70'000});
  if (converge::sides(dimension, most_points).empty())
    throw too_few_points(most_points, smallest[dimension - 1]);
  create_folder(options.out);
  const std::string suffix = dimension_suffix(dimension, 1);
  const auto in_out = [&](const std::string& name) { return options.out / name; };

  Progress progress("clouds and supports");
  const auto found = converge::results({dimension, most_points, options.threads},
                                       [&](int done, int total) { progress.show(done, total); });
  const std::string table = "convergence" + suffix + ".csv";
  write_text(in_out(table), converge::csv(found, dimension));
  tell(converge::summary(found, dimension), in_out("convergence" + suffix + ".txt"),
       options.threads, converge::seed);
  draw(in_out("convergence" + suffix + ".gp"),
       "csv = '" + table + "'\nsuffix = '" + suffix + "'\n" +
           (dimension == 1 ? "error_column = 6\nerror_name = 'L2 error'\n"
                           : "error_column = 9\nerror_name = 'L2 error, interior'\n") +
           convergence_gp,
       in_out(table));
  std::cout << "\nResults: " << in_out(table).string()
            << "\nFigures: " << in_out("figure1" + suffix + ".png").string() << ", "
            << in_out("figure2" + suffix + ".png").string() << " (and .svg)\n";
}

void study_cited(const ConvergeOptions& options) {
  static constexpr int smallest_side = 10;
  const int dimension = options.dimension.value_or(2);
  const int most_points =
      options.most_points(dimension, {40, 40 * 40, 12 * 12 * 12}, {80, 80 * 80, 16 * 16 * 16});
  // Even, since the coarser points are half as many a side.
  int side = smallest_side;
  while (std::pow(side + 2, dimension) <= most_points) side += 2;
  if (std::pow(side, dimension) > most_points)
    throw too_few_points(most_points, static_cast<int>(std::pow(side, dimension)));
  create_folder(options.out);
  const std::string suffix = dimension_suffix(dimension, 2);
  const auto in_out = [&](const std::string& name) { return options.out / name; };

  Progress progress("supports");
  const auto found = cited::results(dimension, side, options.threads,
                                    [&](int done, int total) { progress.show(done, total); });
  const std::string table = "cited" + suffix + ".csv";
  write_text(in_out(table), cited::csv(found));
  tell(cited::summary(found), in_out("cited" + suffix + ".txt"), options.threads, cited::seed);
  draw(in_out("cited" + suffix + ".gp"),
       "csv = '" + table + "'\nsuffix = '" + suffix + "'\n" + cited_gp, in_out(table));
  std::cout << "\nResults: " << in_out(table).string()
            << "\nFigures: " << in_out("cited_gradient" + suffix + ".png").string() << ", "
            << in_out("cited_laplacian" + suffix + ".png").string() << " (and .svg)\n";
}

}  // namespace

std::function<void()> declare_converge(Options& options) {
  auto study = std::make_shared<ConvergeOptions>(ConvergeOptions{{.threads = 0}});
  study->declare(options, "domain [-1, 1]^d [1; --cited: (0, 1)^d, 2]",
                 "Fewer points: in 1D down to spacing 1e-4 instead of 1e-6",
                 "0: as many as there are");
  options.flag(
      "--cited", study->cited,
      "Schemes up to degree 4, those of the systems that the paper cites beside its own, inside\n"
      "and at the wall; irregular points of two spacings. Blank: it needs a larger support");
  options.count("--points-max", study->points_max, {1, 2147483646}, "N",
                "The most points of a cloud [2e6, 5e5, 7e4 in 1, 2, 3D; --quick: 2e4, 3e4, 2.5e4;\n"
                "--cited: 80, 6400, 4096; both: 40, 1600, 1728]");
  options.examples("Example: gradpsi converge --quick --out results");
  return [study] { study->cited ? study_cited(*study) : study_classified(*study); };
}

}  // namespace gradpsi::apps
