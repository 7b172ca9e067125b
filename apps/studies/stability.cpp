#include "studies/stability.hpp"

#include <algorithm>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <numbers>
#include <numeric>

#include "common/chunks.hpp"
#include "common/columns.hpp"
#include "common/fields.hpp"
#include "studies/lattices.hpp"

namespace gradpsi::apps::stability {

namespace {

std::string_view wall_name(const Result& r) { return wall_names[static_cast<int>(r.of.walls)]; }

/// A periodic box must be at least two supports long.
int points_per_side(const Study& study, double support_ratio) {
  static constexpr std::array full = {60, 20, 7}, quick = {24, 10, 7};
  const int usual = (study.quick ? quick : full)[study.dimension - 1];
  return std::max(usual, static_cast<int>(std::ceil(2 * support_ratio)));
}

std::vector<Case> cases(const Study& study) {
  std::vector<double> ratios = {2, 2.5, 3, 3.5, 4.5}, jitters = {0, 0.1, 0.2, 0.3, 0.4, 0.5};
  if (study.quick) ratios = {2.5, 3.5}, jitters = {0, 0.2, 0.4};
  const int seeds = study.quick ? 1 : study.dimension == 3 ? 1 : 3;
  std::vector<Case> all;
  for (const Scheme& scheme : schemes())
    if (scheme.derivative == Derivative::Laplacian)
      for (const Walls walls : {Walls::Periodic, Walls::Dirichlet, Walls::Truncated})
        for (const double ratio : ratios)
          for (const double jitter : jitters)
            for (int seed = 1; seed <= (jitter == 0 ? 1 : seeds); ++seed)
              all.push_back({scheme, ratio, jitter, walls, seed});
  return all;
}

/// Bounds of the derivatives of cos(2 pi x) cos(2 pi y) .. everywhere: waves with wave vectors
/// (+-2 pi, ..), averaged.
Eigen::MatrixXd wave_bounds(int dimension, int most) {
  const double wave_number = 2 * std::numbers::pi * std::sqrt(static_cast<double>(dimension));
  Eigen::MatrixXd bounds(1, most + 1);
  for (int k = 0; k <= most; ++k) bounds(0, k) = std::pow(wave_number, k);
  return bounds;
}

Cloud points(const Case& c, int dimension, int side) {
  return make_cloud(Lattice{.dimension = dimension,
                            .points_per_side = side,
                            .jitter = c.jitter,
                            .seed = static_cast<std::uint64_t>(c.seed),
                            .periodic = c.walls == Walls::Periodic});
}

/// The points whose value changes, ascending.
std::vector<int> evolving_points(const Case& c, int dimension, int side, int n) {
  if (c.walls == Walls::Dirichlet) return inner_points(dimension, side);
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Conditioning, amplification, errors and their bounds in the rows of these points.
void look_at_rows(const Cloud& cloud, const Operator& op, const std::vector<int>& points,
                  Result& r) {
  const Scheme& scheme = r.of.scheme;
  const RowDiagnosis rows = diagnose(scheme, cloud, op, 1);
  const Exact field = exact(cosines(0, 2 * std::numbers::pi), cloud.positions());
  const Eigen::VectorXd error = (op.matrix() * field.u - field.laplacian).cwiseAbs();
  const Eigen::VectorXd bound =
      error_bound(rows, wave_bounds(cloud.dimension(), std::max(degree(scheme), 2) + 3));
  double squares = 0, negative = 0, weights = 0;
  int computed = 0;
  for (const int i : points) {
    r.worst_amplification = std::max(r.worst_amplification, rows.amplification[i]);
    // A row without a stencil is the boundary's, whose derivative is not computed.
    if (op.rows.outcome[i] == RowOutcome::Zero) continue;
    r.worst_rcond = std::min(r.worst_rcond, op.rows.reciprocal_condition[i]);
    const auto entries = static_cast<double>(op.matrix().row(i).nonZeros() - 1);
    negative += rows.negative_share[i] * entries;
    weights += entries;
    squares += error[i] * error[i];
    ++computed;
    if (error[i] > r.error_max) r.error_max = error[i], r.bound_over_error = bound[i] / error[i];
    r.bound_max = std::max(r.bound_max, bound[i]);
    r.rows_above_bound += error[i] > bound[i];
  }
  r.negative_share = weights > 0 ? negative / weights : 0;
  r.error_l2 = computed > 0 ? std::sqrt(squares / computed) : 0;
}

void look_at_eigenvalues(const Operator& op, const std::vector<int>& points, double spacing_squared,
                         Result& r) {
  const Spectrum values =
      spectrum(principal_part(op.matrix(), points), op.volumes(points), 2000, 1);
  r.max_real = values.rightmost() * spacing_squared;
  r.min_real = values.leftmost() * spacing_squared;
  r.max_imag = values.widest() * spacing_squared;
  r.grows = values.grows();
}

Result result(const Case& c, const Study& study) {
  const int side = points_per_side(study, c.support_ratio);
  const Cloud cloud = points(c, study.dimension, side);
  const auto near = find_neighbours(cloud, c.support_ratio / side, 1);
  const Operator op =
      assemble(c.scheme, cloud, near, {.on_degenerate = OnDegenerate::Widen, .threads = 1});
  const auto evolving = evolving_points(c, study.dimension, side, cloud.size());
  Result r{.of = c, .points = cloud.size(), .forecast = {}};
  look_at_rows(cloud, op, evolving, r);
  look_at_eigenvalues(op, evolving, 1.0 / (side * side), r);
  r.forecast = forecast(cloud, op.matrix(), evolving, op.volumes);
  return r;
}

/// The fastest growth of all seeds.
struct Growth {
  Case of;
  double rate;
};

bool same_place(const Case& a, const Case& b) {
  return a.scheme == b.scheme && a.walls == b.walls && a.support_ratio == b.support_ratio &&
         a.jitter == b.jitter;
}

/// How many matrices of a scheme grow, by walls, and how many were foretold right.
struct Count {
  std::string scheme;
  std::array<int, 3> grow = {}, made = {};
  int certain = 0, right = 0, false_alarms = 0, missed = 0;

  void add(const Result& r) {
    grow[static_cast<int>(r.of.walls)] += r.grows;
    ++made[static_cast<int>(r.of.walls)];
    certain += r.forecast.certain;
    right += r.forecast.grows == r.grows;
    false_alarms += r.forecast.grows && !r.grows;
    missed += !r.forecast.grows && r.grows;
  }
};

/// Scheme by scheme, and of all schemes together, whose matrices are not told apart by walls.
std::vector<Count> counts(const std::vector<Result>& results) {
  std::vector<Count> all;
  Count together{.scheme = "all"};
  for (const Result& r : results) {
    if (all.empty() || all.back().scheme != name(r.of.scheme))
      all.push_back({.scheme = name(r.of.scheme)});
    all.back().add(r);
    together.add(r);
  }
  together.made = {};
  all.push_back(together);
  return all;
}

Column<Count> grow_of_made(Walls walls) {
  const auto w = static_cast<std::size_t>(walls);
  return {std::string(wall_names[w]),
          [w](const Count& c) {
            if (c.made[w] == 0) return std::string();
            return std::to_string(c.grow[w]) + " of " + std::to_string(c.made[w]);
          },
          {.width = 11}};
}

}  // namespace

std::vector<Result> results(const Study& study, const ShowProgress& show) {
  const std::vector<Case> all = cases(study);
  const int total = static_cast<int>(all.size());
  std::vector<std::optional<Result>> found(all.size());
  int done = 0;
  in_chunks(total, 1, study.threads, [&](int k, int) {
    found[k] = result(all[k], study);
#pragma omp critical
    show(++done, total);
  });
  std::vector<Result> results;
  for (auto& r : found) results.push_back(std::move(*r));
  return results;
}

std::string csv(const std::vector<Result>& results, int dimension) {
  const Columns<Result> columns = {{"scheme", [](auto& r) { return name(r.of.scheme); }},
                                   {"dimension", [=](auto&) { return dimension; }},
                                   {"support_ratio", [](auto& r) { return r.of.support_ratio; }},
                                   {"jitter", [](auto& r) { return r.of.jitter; }},
                                   {"walls", wall_name},
                                   {"seed", [](auto& r) { return r.of.seed; }},
                                   {"points", &Result::points},
                                   {"max_real", &Result::max_real},
                                   {"min_real", &Result::min_real},
                                   {"max_imag", &Result::max_imag},
                                   {"worst_rcond", &Result::worst_rcond},
                                   {"worst_amplification", &Result::worst_amplification},
                                   {"negative_share", &Result::negative_share},
                                   {"error_l2", &Result::error_l2},
                                   {"error_max", &Result::error_max},
                                   {"bound_max", &Result::bound_max}};
  return apps::csv(columns, results);
}

std::string map_csv(const std::vector<Result>& results) {
  std::vector<Growth> fastest;
  for (const Result& r : results) {
    if (fastest.empty() || !same_place(fastest.back().of, r.of)) fastest.push_back({r.of, 0});
    if (r.grows) fastest.back().rate = std::max(fastest.back().rate, r.max_real);
  }
  return apps::csv({{"scheme", [](auto& g) { return name(g.of.scheme); }},
                    {"walls", [](auto& g) { return wall_names[static_cast<int>(g.of.walls)]; }},
                    {"support_ratio", [](auto& g) { return g.of.support_ratio; }},
                    {"jitter", [](auto& g) { return g.of.jitter; }},
                    {"growth", &Growth::rate}},
                   fastest);
}

std::string growth_table(const std::vector<Result>& results) {
  // The headings from here on stand two to the right.
  const std::string certain = padded("certain", 11);
  return "Matrices that grow, of those made; and what was foretold without their spectra:\n\n" +
         text_table({{"", &Count::scheme, {.width = -28}},
                     grow_of_made(Walls::Periodic),
                     grow_of_made(Walls::Dirichlet),
                     grow_of_made(Walls::Truncated),
                     {certain, &Count::certain, {.width = 9}},
                     {"right", &Count::right, {.width = 9}},
                     {"false alarm", &Count::false_alarms, {.width = 14}},
                     {"missed", &Count::missed, {.width = 9}}},
                    counts(results));
}

std::string bound_line(const std::vector<Result>& results) {
  long above = 0, matrices = 0;
  double most = 0, least = 1e300;
  for (const Result& r : results) {
    above += r.rows_above_bound;
    // Failing: errors as large as the derivative itself, from rows that are amplified.
    if (degree(r.of.scheme) < 2 || r.worst_amplification < 1000) continue;
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

}  // namespace gradpsi::apps::stability
