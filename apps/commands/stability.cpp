// gradpsi stability: where discrete Laplacians grow, on ever more disordered points.
//
//     gradpsi stability --quick --out results
//
// assembles every Laplacian on jittered lattices of the unit square (line, cube), with five supports and
// six jitters, in a periodic box, with the outermost layer held, and cut off without any condition. Each
// matrix's eigenvalues say whether du/dt = lap u grows, and are compared with what `gradpsi inspect` would
// have said without them; so are those of graded, random, L-shaped and other points. Expect: uncorrected schemes but direct, and positive stencils, never grow; second
// order by least squares does not either where walls are held, and everything of second or higher order
// does where the points just end.

#include "studies/stability.hpp"

#include <gradpsi/io.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "commands/study_options.hpp"
#include "common/gnuplot.hpp"
#include "common/results.hpp"
#include "studies/failing.hpp"
#include "studies/floor.hpp"
#include "studies/foretold.hpp"
#include "studies/growth.hpp"
#include "studies/orders.hpp"
#include "studies/stability_gp.hpp"

namespace gradpsi::apps {

namespace {

/// The studies of single cases: writes their tables and returns what a person should read of them.
std::string look_closely(const std::filesystem::path& folder, bool quick) {
  const auto failures = failing::results(quick ? 3 : 20);
  write_text(folder / "failure.csv", failing::csv(failures));
  const auto squares = orders::results(quick);
  write_text(folder / "orders.csv", orders::csv(squares));
  const auto spacings = floor::results();
  write_text(folder / "floor.csv", floor::csv(spacings));
  const auto fields = growth::results();
  write_text(folder / "rk4_region.csv", growth::rk4_region_csv());
  write_text(folder / "spectra.csv", growth::spectra_csv(fields));
  write_text(folder / "history.csv", growth::history_csv(fields));
  return failing::table(failures) + '\n' + orders::table(squares) + '\n' + floor::table(spacings) +
         '\n' + growth::summary(fields);
}

void run(const StudyOptions& options) {
  create_folder(options.out);
  const int dimension = options.dimension.value_or(2);
  const std::string suffix = dimension_suffix(dimension, 2);
  const stability::Study study{dimension, options.quick, options.threads};
  Progress progress("matrices");
  const auto show = [&](int done, int total) { progress.show(done, total); };
  const auto found = stability::results(study, show);
  const auto others = foretold::results(study, show);

  const std::string table = "stability" + suffix + ".csv";
  write_text(options.out / table, stability::csv(found, dimension));
  const std::string maps = "stability_map" + suffix + ".csv";
  write_text(options.out / maps, stability::map_csv(found));
  write_text(options.out / ("forecast" + suffix + ".csv"), foretold::csv(others, dimension));
  std::string text = stability::growth_table(found) + '\n' + stability::bound_line(found) + '\n' +
                     foretold::table(others) + '\n';
  // What looks at single cases does not depend on the dimension asked for.
  const bool closely = dimension == 2;
  if (closely) text += look_closely(options.out, options.quick);
  write_text(options.out / ("stability" + suffix + ".txt"),
             provenance(options.threads) + '\n' + text);
  std::cout << text << std::flush;
  draw(options.out / ("stability" + suffix + ".gp"),
       "maps = '" + maps + "'\nsuffix = '" + suffix + "'\nclosely = " + (closely ? "1" : "0") +
           "\n" + stability_gp,
       options.out / table);
  std::cout << "\nResults: " << (options.out / table).string()
            << "\nFigures: " << (options.out / ("stability_map_*" + suffix + ".png")).string();
  if (closely) std::cout << ", spectra.png, history.png, floor.png";
  std::cout << '\n';
}

}  // namespace

std::function<void()> declare_stability(Options& options) {
  auto study = std::make_shared<StudyOptions>(StudyOptions{.threads = 0});
  study->declare(options, "unit line, square or cube [2]",
                 "Fewer points, supports, jitters and seeds", "0: as many as there are");
  options.examples("Example: gradpsi stability --quick --out results");
  return [study] { run(*study); };
}

}  // namespace gradpsi::apps
