// gradpsi stability: where discrete Laplacians grow, on ever more disordered points.
//
//     gradpsi stability --quick --out results
//
// assembles every Laplacian on jittered lattices of the unit square (line, cube), with five supports and
// six jitters, in a periodic box, with the outermost layer held, and cut off without any condition. Each
// matrix's eigenvalues say whether du/dt = lap u grows, and are compared with what `gradpsi inspect` would
// have said without them. Expect: uncorrected schemes but direct, and positive stencils, never grow; second
// order by least squares does not either where walls are held, and everything of second or higher order
// does where the points just end.

#include "studies/stability.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <gradpsi/gradpsi.hpp>
#include <iostream>

#include "../../lib/base/parallel.hpp"
#include "common/progress.hpp"
#include "common/study.hpp"
#include "studies/failures.hpp"
#include "studies/stability_gp.hpp"

namespace gradpsi::apps {

namespace {

using gradpsi::Cloud;
using gradpsi::Lattice;
using gradpsi::Scheme;
using std::filesystem::path;

enum class Walls { Periodic, Dirichlet, Truncated };
constexpr std::array<const char*, 3> wall_names = {"periodic", "dirichlet", "truncated"};

/// One matrix of the study.
struct Case {
  Scheme scheme;
  double support_ratio, jitter;
  Walls walls;
  int seed;
};

struct Result {
  int points = 0;
  double max_real = 0, min_real = 0, max_imag = 0;  // times dx^2
  double worst_rcond = 1, worst_amplification = 0, negative_share = 0;
  double error_l2 = 0, error_max = 0, bound_max = 0;
  double bound_over_error = 0;  // at the point of the largest error
  int rows_above_bound = 0;
  bool grows = false;
  gradpsi::Forecast forecast;
};

/// A periodic box must be at least two supports long.
int points_per_side(const StudyOptions& options, double support_ratio) {
  static constexpr std::array full = {60, 20, 7}, quick = {24, 10, 7};
  const int usual = (options.quick ? quick : full)[options.dimension - 1];
  return std::max(usual, static_cast<int>(std::ceil(2 * support_ratio)));
}

std::vector<Case> cases(const StudyOptions& options) {
  std::vector<double> ratios = {2, 2.5, 3, 3.5, 4.5}, jitters = {0, 0.1, 0.2, 0.3, 0.4, 0.5};
  if (options.quick) ratios = {2.5, 3.5}, jitters = {0, 0.2, 0.4};
  const int seeds = options.quick ? 1 : options.dimension == 3 ? 1 : 3;
  std::vector<Case> all;
  for (const Scheme& scheme : gradpsi::schemes())
    if (scheme.derivative == gradpsi::Derivative::Laplacian)
      for (const Walls walls : {Walls::Periodic, Walls::Dirichlet, Walls::Truncated})
        for (const double ratio : ratios)
          for (const double jitter : jitters)
            for (int seed = 1; seed <= (jitter == 0 ? 1 : seeds); ++seed)
              all.push_back({scheme, ratio, jitter, walls, seed});
  return all;
}

Result result(const Case& c, const StudyOptions& options) {
  const int side = points_per_side(options, c.support_ratio), d = options.dimension;
  const Cloud cloud = make_cloud(Lattice{.dimension = d,
                                         .points_per_side = side,
                                         .jitter = c.jitter,
                                         .seed = static_cast<std::uint64_t>(c.seed),
                                         .periodic = c.walls == Walls::Periodic});
  const auto near = find_neighbours(cloud, c.support_ratio / side, 1);
  const gradpsi::Operator op = assemble(
      c.scheme, cloud, near, {.on_degenerate = gradpsi::OnDegenerate::Widen, .threads = 1});
  std::vector<int> points = inner_points(d, side);
  if (c.walls != Walls::Dirichlet) {
    points.resize(cloud.size());
    for (int i = 0; i < cloud.size(); ++i) points[i] = i;
  }

  Result r;
  r.points = cloud.size();
  const auto rows = diagnose(c.scheme, cloud, op, 1);
  const Field field = periodic_field(cloud.positions(), std::max(degree(c.scheme), 2) + 3);
  const Eigen::VectorXd error = (op.matrix() * field.u - field.laplacian).cwiseAbs();
  const Eigen::VectorXd bound = error_bound(rows, field.bounds);
  double squares = 0, negative = 0, weights = 0;
  int evolving = 0;
  for (const int i : points) {
    r.worst_amplification = std::max(r.worst_amplification, rows.amplification[i]);
    // A row without a stencil is the boundary's, whose derivative is not computed.
    if (op.rows.outcome[i] == gradpsi::RowOutcome::Zero) continue;
    r.worst_rcond = std::min(r.worst_rcond, op.rows.reciprocal_condition[i]);
    const auto entries = static_cast<double>(op.matrix().row(i).nonZeros() - 1);
    negative += rows.negative_share[i] * entries;
    weights += entries;
    squares += error[i] * error[i];
    ++evolving;
    if (error[i] > r.error_max) r.error_max = error[i], r.bound_over_error = bound[i] / error[i];
    r.bound_max = std::max(r.bound_max, bound[i]);
    r.rows_above_bound += error[i] > bound[i];
  }
  r.negative_share = weights > 0 ? negative / weights : 0;
  r.error_l2 = evolving > 0 ? std::sqrt(squares / evolving) : 0;
  const auto values =
      gradpsi::spectrum(gradpsi::principal_part(op.matrix(), points), op.volumes(points), 2000, 1);
  const double unit = 1.0 / (side * side);  // dx^2
  r.max_real = values.rightmost() * unit;
  r.min_real = values.leftmost() * unit;
  r.max_imag = values.widest() * unit;
  r.grows = values.grows();
  r.forecast = forecast(cloud, op.matrix(), points, op.volumes);
  return r;
}

std::string csv(const std::vector<Case>& cases, const std::vector<Result>& results, int dimension) {
  std::string out =
      "scheme,dimension,support_ratio,jitter,walls,seed,points,max_real,min_real,max_imag,"
      "worst_rcond,worst_amplification,negative_share,error_l2,error_max,bound_max\n";
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Case& c = cases[k];
    const Result& r = results[k];
    out += name(c.scheme) + ',' + std::to_string(dimension) + ',' + cell(c.support_ratio) + ',' +
           cell(c.jitter) + ',' + wall_names[static_cast<int>(c.walls)] + ',' +
           std::to_string(c.seed) + ',' + std::to_string(r.points);
    for (const double x : {r.max_real, r.min_real, r.max_imag, r.worst_rcond, r.worst_amplification,
                           r.negative_share, r.error_l2, r.error_max, r.bound_max})
      out += ',' + cell(x);
    out += '\n';
  }
  return out;
}

/// For the maps: the fastest growth of all seeds, 0 where none grows.
std::string map_csv(const std::vector<Case>& cases, const std::vector<Result>& results) {
  std::string out = "scheme,walls,support_ratio,jitter,growth\n";
  const auto same = [](const Case& a, const Case& b) {
    return a.scheme == b.scheme && a.walls == b.walls && a.support_ratio == b.support_ratio &&
           a.jitter == b.jitter;
  };
  for (std::size_t k = 0; k < cases.size();) {
    double growth = 0;
    const Case& c = cases[k];
    for (; k < cases.size() && same(c, cases[k]); ++k)
      if (results[k].grows) growth = std::max(growth, results[k].max_real);
    out += name(c.scheme) + ',' + wall_names[static_cast<int>(c.walls)] + ',' +
           cell(c.support_ratio) + ',' + cell(c.jitter) + ',' + cell(growth) + '\n';
  }
  return out;
}

std::string growth_table(const std::vector<Case>& cases, const std::vector<Result>& results) {
  std::string out =
      "Matrices that grow, of those made; and what was foretold without their spectra:\n\n"
      "                               periodic  dirichlet  truncated    certain    right"
      "   false alarm   missed\n";
  std::array<int, 4> sums{};
  for (const Scheme& scheme : gradpsi::schemes()) {
    std::array<int, 3> grows{}, count{};
    std::array<int, 4> told{};  // certain, right, false alarm, missed
    for (std::size_t k = 0; k < cases.size(); ++k) {
      if (!(cases[k].scheme == scheme)) continue;
      const Result& r = results[k];
      grows[static_cast<int>(cases[k].walls)] += r.grows;
      ++count[static_cast<int>(cases[k].walls)];
      told[0] += r.forecast.certain;
      told[1] += r.forecast.grows == r.grows;
      told[2] += r.forecast.grows && !r.grows;
      told[3] += !r.forecast.grows && r.grows;
    }
    if (count[0] == 0) continue;
    out += name(scheme) + padded("", 28 - static_cast<int>(name(scheme).size()));
    for (int w = 0; w < 3; ++w)
      out += padded(std::to_string(grows[w]) + " of " + std::to_string(count[w]), 11);
    for (int k = 0; k < 4; ++k)
      sums[k] += told[k], out += padded(std::to_string(told[k]), k == 2 ? 14 : 9);
    out += '\n';
  }
  out += "all" + padded("", 58);
  for (int k = 0; k < 4; ++k) out += padded(std::to_string(sums[k]), k == 2 ? 14 : 9);
  return out + '\n';
}

std::string bound_line(const std::vector<Case>& cases, const std::vector<Result>& results) {
  long above = 0, matrices = 0;
  double most = 0, least = 1e300;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Result& r = results[k];
    above += r.rows_above_bound;
    // Failing: errors as large as the derivative itself, from rows that are amplified.
    if (degree(cases[k].scheme) < 2 || r.worst_amplification < 1000) continue;
    ++matrices;
    most = std::max(most, r.bound_over_error);
    least = std::min(least, r.bound_over_error);
  }
  std::string out =
      "Rows whose error is above its bound, in all matrices: " + std::to_string(above) + '\n';
  if (matrices > 0)
    out += "Bound over error at the worst point of the " + std::to_string(matrices) +
           " second- and higher-order matrices with a row amplified over 1000 times: " +
           cell(least, "%.2g") + " to " + cell(most, "%.2g") + '\n';
  return out;
}

}  // namespace

void stability(const StudyOptions& options) {
  create_folder(options.out);
  const std::string suffix =
      options.dimension == 2 ? "" : "_" + std::to_string(options.dimension) + "d";
  const std::vector<Case> all = cases(options);
  std::vector<Result> results(all.size());
  Progress progress(static_cast<int>(all.size()), "matrices");
  int done = 0;
  gradpsi::parallel_chunks(static_cast<int>(all.size()), 1, options.threads, [&](int begin, int) {
    results[begin] = result(all[begin], options);
#pragma omp critical
    progress.show(++done);
  });

  const std::string table = "stability" + suffix + ".csv";
  gradpsi::write_text(options.out / table, csv(all, results, options.dimension));
  const std::string maps = "stability_map" + suffix + ".csv";
  gradpsi::write_text(options.out / maps, map_csv(all, results));
  std::string text = growth_table(all, results) + '\n' + bound_line(all, results) + '\n';
  // What looks at single cases does not depend on the dimension asked for.
  const bool closely = options.dimension == 2;
  if (closely)
    text += failing_cases(options.out, options.quick) + '\n' +
            orders_of_least_squares(options.out, options.quick) + '\n' +
            cancellation_floor(options.out) + '\n' + growth_and_cure(options.out);
  gradpsi::write_text(options.out / ("stability" + suffix + ".txt"),
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

}  // namespace gradpsi::apps
