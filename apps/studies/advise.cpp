// gradpsi advise: which scheme and support to take for the points of a file.
//
// Every scheme of the wanted derivative is tried with five supports on the user's own points: on waves of the
// given length, in every direction of a few, at a sample of the points. The cheapest one whose error is at
// most the tolerance, and that is stable where it is to be stepped in time, is named.

#include "studies/advise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <iostream>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>
#include <utility>

#include "common/operator_options.hpp"
#include "common/study.hpp"
#include "common/timing.hpp"

namespace gradpsi::apps {

namespace {

using gradpsi::Derivative;
using gradpsi::Neighbours;
using gradpsi::Scheme;

constexpr std::array support_ratios = {2.0, 2.5, 3.0, 3.5, 4.5};

/// Unit waves on the points and what their derivatives are: a column per wave, and per axis for gradients.
struct Waves {
  Eigen::MatrixXd u;                         // n x waves
  std::vector<Eigen::MatrixXd> derivatives;  // per axis (Laplacian: one), n x waves
  double scale;                              // root mean square of a derivative
};

/// Along the axes and the diagonals, as sine and as cosine; in a periodic box the nearest that fit it.
Waves make_waves(const gradpsi::Cloud& cloud, double wavelength, bool laplacian) {
  const int d = cloud.dimension();
  std::vector<Eigen::VectorXd> directions;
  for (int a = 0; a < d; ++a) directions.push_back(Eigen::VectorXd::Unit(d, a));
  for (int signs = 0; d > 1 && signs < 1 << (d - 1); ++signs) {
    Eigen::VectorXd diagonal = Eigen::VectorXd::Constant(d, 1 / std::sqrt(d));
    for (int a = 1; a < d; ++a)
      if (signs >> (a - 1) & 1) diagonal[a] *= -1;
    directions.push_back(diagonal);
  }
  const auto count = 2 * std::ssize(directions);
  Waves waves{Eigen::MatrixXd(cloud.size(), count), {}, 0};
  waves.derivatives.assign(laplacian ? 1 : d, Eigen::MatrixXd(cloud.size(), count));
  for (Eigen::Index w = 0; w < count; ++w) {
    Eigen::VectorXd k = 2 * std::numbers::pi / wavelength * directions[w / 2];
    for (int a = 0; a < d; ++a)
      if (const double length = cloud.box()[a]; length > 0)
        k[a] =
            std::nearbyint(k[a] * length / (2 * std::numbers::pi)) * 2 * std::numbers::pi / length;
    const Eigen::ArrayXd phase =
        (cloud.positions() * k).array() + (w % 2 == 0 ? 0 : std::numbers::pi / 2);
    waves.u.col(w) = phase.sin();
    if (laplacian)
      waves.derivatives[0].col(w) = -k.squaredNorm() * phase.sin();
    else
      for (int a = 0; a < d; ++a) waves.derivatives[a].col(w) = k[a] * phase.cos();
    waves.scale += (laplacian ? std::pow(k.squaredNorm(), 2) : k.squaredNorm()) / 2;
  }
  waves.scale = std::sqrt(waves.scale / static_cast<double>(count));
  return waves;
}

/// A scheme and a support, and what has been measured of them.
struct Candidate {
  Scheme scheme;
  double ratio;
  double error = 0, worst = 0;       // root mean square and largest over the rows, relative
  double entries = 0;                // a row
  double assemble = 0, product = 0;  // seconds a point
  double step = 0;                   // Laplacians: dt nu that explicit Euler bears, by Gershgorin
  double cost = 0;                   // see cost()
  int zero = 0, widened = 0;         // rows
  bool looked_at =
      false;  // whether errors, rows and step are those of all rows, and `grows` is known
  bool grows = false;

  bool complete() const { return zero == 0; }
};

/// What candidates are ranked by. A derivative: seconds a point for search, weights and a product. Explicit
/// steps: entries of a row over the largest step, the work for a given time. Implicit ones: entries of a
/// row, which filling and solving grow with.
double cost(const Candidate& c, Use use) {
  switch (use) {
    case Use::Derivative: return c.assemble + c.product;
    case Use::Explicit: return c.entries / c.step;
    case Use::Implicit: return c.entries;
  }
  return 0;
}

/// What the candidates are tried on.
struct Trial {
  const AdviseOptions& options;
  const gradpsi::Cloud& cloud;
  double spacing;
  Waves waves;
  std::vector<int> evolving;  // points without a fixed value
  std::vector<int> sample;    // of them

  Use use() const { return options.what_for(); }
  gradpsi::AssemblyOptions assembly() const {
    return {.kernel = gradpsi::kernel(options.kernel),
            .on_degenerate = gradpsi::OnDegenerate::Widen,
            .threads = options.threads};
  }
};

/// So many of the points, at random but always the same, ascending.
std::vector<int> sampled(std::vector<int> points, int count) {
  if (count == 0 || count >= std::ssize(points)) return points;
  std::mt19937_64 generator(1);
  for (int k = 0; k < count; ++k)
    std::swap(points[k], points[k + generator() % (points.size() - k)]);
  points.resize(count);
  std::ranges::sort(points);
  return points;
}

/// Errors, rows and step from the operator's rows of these points, `place[k]` being where points[k] is.
void set_findings(const Trial& trial, const gradpsi::Operator& op, const std::vector<int>& points,
                  const std::vector<int>& place, Candidate& c) {
  Eigen::VectorXd squared = Eigen::VectorXd::Zero(std::ssize(points));
  for (std::size_t a = 0; a < op.axes.size(); ++a) {
    const Eigen::MatrixXd found = op.axes[a] * trial.waves.u;
    squared += (found(place, Eigen::all) - trial.waves.derivatives[a](points, Eigen::all))
                   .rowwise()
                   .squaredNorm();
  }
  squared /= static_cast<double>(trial.waves.u.cols());
  c.error = std::sqrt(squared.mean()) / trial.waves.scale;
  c.worst = std::sqrt(squared.maxCoeff()) / trial.waves.scale;
  c.zero = c.widened = 0;
  double largest = 0;
  for (const int k : place) {
    c.zero += op.rows.outcome[k] == gradpsi::RowOutcome::Zero;
    c.widened += op.rows.outcome[k] == gradpsi::RowOutcome::Widened;
    largest = std::max(largest, op.matrix().row(k).cwiseAbs().sum());
  }
  c.step = 2 / largest;
}

Candidate measured(const Trial& trial, const Scheme& scheme, double ratio, const Neighbours& near,
                   double search_seconds, const std::vector<int>& rows) {
  Candidate c{scheme, ratio};
  gradpsi::AssemblyOptions options = trial.assembly();
  options.rows = rows;
  const auto count = static_cast<double>(rows.size());
  gradpsi::Operator op;
  const double weights =
      median_seconds([&] { op = assemble(scheme, trial.cloud, near, options); }, 0) / count;
  c.assemble = search_seconds / trial.cloud.size() + weights;
  c.entries = static_cast<double>(op.matrix().nonZeros()) / count;
  Eigen::MatrixXd y;
  const Eigen::VectorXd u = trial.waves.u.col(0);
  c.product =
      median_seconds([&] { gradpsi::multiply(op.axes, u, y, options.threads); }, 1e-3) / count;
  std::vector<int> place(rows.size());
  std::iota(place.begin(), place.end(), 0);
  set_findings(trial, op, rows, place, c);
  c.cost = cost(c, trial.use());
  return c;
}

std::vector<Candidate> all_candidates(const Trial& trial, const std::vector<int>& rows) {
  std::vector<Candidate> all;
  for (const double ratio : support_ratios) {
    Neighbours near;
    const double search = median_seconds(
        [&] { near = find_neighbours(trial.cloud, ratio * trial.spacing, trial.options.threads); },
        0);
    for (const Scheme& scheme : gradpsi::schemes())
      if (trial.options.laplacian() == (scheme.derivative == Derivative::Laplacian) &&
          (trial.cloud.dimension() < 3 || degree(scheme) <= 4))
        all.push_back(measured(trial, scheme, ratio, near, search, rows));
  }
  std::ranges::stable_sort(all, {}, &Candidate::cost);
  return all;
}

/// Looks at all rows, once: what a sample says may just miss the truth.
void look_at(const Trial& trial, Candidate& c) {
  if (std::exchange(c.looked_at, true)) return;
  const auto near = find_neighbours(trial.cloud, c.ratio * trial.spacing, trial.options.threads);
  const auto op = assemble(c.scheme, trial.cloud, near, trial.assembly());
  set_findings(trial, op, trial.evolving, trial.evolving, c);
  if (trial.use() != Use::Derivative)
    c.grows = forecast(trial.cloud, op.matrix(), trial.evolving, op.volumes).grows;
}

bool fit(const Trial& trial, Candidate& c) {
  if (!c.complete()) return false;
  look_at(trial, c);
  return c.complete() && !c.grows;
}

/// The first that is complete, stable where it has to be, and accurate enough; null: none.
Candidate* cheapest(const Trial& trial, std::vector<Candidate>& by_cost) {
  for (Candidate& c : by_cost)
    if (c.error <= trial.options.tolerance && fit(trial, c) && c.error <= trial.options.tolerance)
      return &c;
  return nullptr;
}

/// The most accurate that is complete, and stable where it has to be.
Candidate* most_accurate(const Trial& trial, std::vector<Candidate>& all) {
  std::vector<Candidate*> by_error;
  for (Candidate& c : all) by_error.push_back(&c);
  std::ranges::sort(by_error, {}, [](const Candidate* c) { return c->error; });
  const auto found = std::ranges::find_if(by_error, [&](Candidate* c) { return fit(trial, *c); });
  return found == by_error.end() ? nullptr : *found;
}

/// The order of the error on disordered points.
int order(const Scheme& scheme) {
  return degree(scheme) - (scheme.derivative == Derivative::Laplacian ? 1 : 0);
}

std::string described(const Candidate& c) {
  return name(c.scheme) + " with --support-ratio " + text(c.ratio);
}

std::string stable(const Candidate& c, Use use) {
  if (!c.looked_at || use == Use::Derivative) return "-";
  return c.grows ? "no" : "yes";
}

std::string table(const std::vector<Candidate>& all, const Candidate* chosen, const Trial& trial) {
  const bool laplacian = trial.options.laplacian();
  std::string out =
      "   scheme                       h/dx   entries   error rms     worst   ns a point";
  out += laplacian ? "   dt nu/dx^2   stable   rows\n" : "   rows\n";
  const double unit = trial.spacing * trial.spacing;
  for (const Candidate& c : all) {
    const std::string scheme = name(c.scheme);
    out += (&c == chosen                         ? "=> "
            : c.error <= trial.options.tolerance ? " + "
                                                 : "   ") +
           scheme + padded("", 29 - static_cast<int>(scheme.size())) +
           padded(cell(c.ratio, "%.1f"), 4) + padded(cell(c.entries, "%.1f"), 10) +
           padded(cell(c.error, "%.1e"), 12) + padded(cell(c.worst, "%.1e"), 10) +
           padded(cell(1e9 * (c.assemble + c.product), "%.4g"), 13);
    if (laplacian)
      out += padded(cell(c.step / unit, "%.3g"), 13) + padded(stable(c, trial.use()), 9);
    out += c.zero > 0      ? "   " + std::to_string(c.zero) + " cannot be computed"
           : c.widened > 0 ? "   " + std::to_string(c.widened) + " widened"
                           : "";
    out += '\n';
  }
  return out;
}

/// The command line that uses the advice, with the options that say what the points are.
std::string command(const Trial& trial, const Candidate& c, const gradpsi::Table& table) {
  const AdviseOptions& options = trial.options;
  std::string field = "COLUMN";
  for (const auto& column : table.names)
    if (column != "x" && column != "y" && column != "z" && column != "volume" &&
        column != options.fixed) {
      field = column;
      break;
    }
  const bool steps = trial.use() == Use::Implicit;
  std::string out = std::string("gradpsi ") +
                    (steps                          ? "diffuse "
                     : trial.use() == Use::Explicit ? "assemble "
                                                    : "derive ") +
                    options.points.string();
  if (trial.use() != Use::Explicit) out += " --field " + field;
  out += " --scheme " + name(c.scheme) + " --support-ratio " + text(c.ratio);
  if (options.kernel != gradpsi::kernels().front().name) out += " --kernel " + options.kernel;
  if (options.volume) out += " --volume " + text(*options.volume);
  if (std::ranges::any_of(options.periodic, [](double l) { return l > 0; })) {
    out += " --periodic ";
    for (int a = 0; a < trial.cloud.dimension(); ++a)
      out += (a > 0 ? "," : "") + text(options.periodic[a]);
  }
  if (options.duplicates != "error") out += " --duplicates " + options.duplicates;
  if (c.widened > 0 || c.scheme.consistency == gradpsi::Consistency::Positive)
    out += " --on-degenerate widen";
  if (steps && !options.fixed.empty()) out += " --fixed " + options.fixed;
  if (steps) out += " --time-step DT --steps N";
  return out + (trial.use() == Use::Explicit ? " -o OUT.mtx" : " -o OUT.vtu");
}

/// Which spacing would do: errors fall with the order, so the coarsest is that of the scheme that needs least.
std::string which_spacing(const Trial& trial, std::vector<Candidate>& all) {
  const Candidate* best = nullptr;
  double coarsest = 0;
  for (Candidate& c : all) {
    // An order can be counted on where waves are resolved, and not over many powers of ten.
    if (order(c.scheme) < 1 || !fit(trial, c) || c.error > 0.5) continue;
    const double spacing =
        trial.spacing * std::pow(trial.options.tolerance / c.error, 1.0 / order(c.scheme));
    if (spacing > coarsest) coarsest = spacing, best = &c;
  }
  if (!best || coarsest < 0.01 * trial.spacing) return "";
  return "A spacing of about " + cell(coarsest, "%.2g") + " would (now " +
         cell(trial.spacing, "%.2g") + "), with " + described(*best) +
         ", whose error is of order " + std::to_string(order(best->scheme)) + ".\n";
}

/// The same choice from all rows of all candidates, and what the sample's choice costs more.
void check_choice(const Trial& trial, const Candidate* chosen) {
  std::vector<Candidate> all = all_candidates(trial, trial.evolving);
  Candidate* const best = cheapest(trial, all);
  std::cout << "\nBrute force, " << all.size() << " candidates on all " << trial.evolving.size()
            << " rows: ";
  if (!best || !chosen) {
    std::cout << (best ? "the choice would be " + described(*best) : "nothing meets the tolerance")
              << (chosen ? "" : "; the sample found nothing") << '\n';
    return;
  }
  const auto same = std::ranges::find_if(all, [&](const Candidate& c) {
    return c.scheme == chosen->scheme && c.ratio == chosen->ratio;
  });
  std::cout << described(*best) << "; the choice from the sample has an error of "
            << cell(same->error, "%.2g") << " there and a regret of "
            << cell(100 * (same->cost / best->cost - 1), "%.1f") << " %\n";
}

void check(const AdviseOptions& options, const Problem& problem) {
  if (!(options.tolerance > 0 && std::isfinite(options.tolerance)))
    throw gradpsi::InvalidInput("--tolerance must be > 0 and finite, not " +
                                text(options.tolerance));
  if (problem.table.has("support"))
    throw gradpsi::InvalidInput(options.points.string() +
                                " has a column 'support': there is no support left to choose");
  if (problem.cloud.size() < 2) throw gradpsi::InvalidInput("advice needs two points at least");
}

/// As asked for, or the extent of the points, that of the box where it is periodic.
double wavelength(const AdviseOptions& options, const gradpsi::Cloud& cloud, double spacing) {
  double extent = 0;
  for (int a = 0; a < cloud.dimension(); ++a) {
    const auto x = cloud.positions().col(a);
    const double period = cloud.box()[a];
    extent = std::max(extent, period > 0 ? period : x.maxCoeff() - x.minCoeff());
  }
  const double length = options.wavelength.value_or(extent);
  if (!(length > 0 && std::isfinite(length)))
    throw gradpsi::InvalidInput("--wavelength must be > 0 and finite, not " + text(length));
  if (length < 2 * spacing)
    throw gradpsi::InvalidInput("waves of length " + text(length) +
                                " are shorter than two spacings, " + text(2 * spacing) +
                                ": these points cannot tell them from longer ones");
  return length;
}

Trial make_trial(const AdviseOptions& options, const Problem& problem) {
  const gradpsi::Cloud& cloud = problem.cloud;
  const double spacing = cloud.spacing(options.threads);
  const double length = wavelength(options, cloud, spacing);
  Trial trial{options, cloud, spacing, make_waves(cloud, length, options.laplacian()), {}, {}};
  if (!(std::isnormal(trial.waves.scale) && std::isnormal(std::pow(trial.waves.scale, 2))))
    throw gradpsi::InvalidInput("derivatives of waves of length " + text(length) +
                                " vanish or are beyond the range of a double");
  const Eigen::VectorXd fixed = options.fixed.empty()
                                    ? Eigen::VectorXd(Eigen::VectorXd::Zero(cloud.size()))
                                    : finite_column(problem.table, problem.cloud, options.fixed);
  for (int i = 0; i < cloud.size(); ++i)
    if (fixed[i] == 0) trial.evolving.push_back(i);
  if (trial.evolving.empty()) throw gradpsi::InvalidInput("all points are fixed");
  trial.sample = sampled(trial.evolving, options.sample);
  std::cout << cloud.size() << " points in " << cloud.dimension() << "D, spacing "
            << text(trial.spacing) << "; waves of length " << text(length) << " ("
            << cell(length / trial.spacing, "%.4g") << " spacings), at " << trial.sample.size()
            << " points\n";
  return trial;
}

/// What to take, or why there is nothing.
std::string advice(const Trial& trial, std::vector<Candidate>& all, const Candidate* chosen,
                   const gradpsi::Table& table) {
  if (chosen) {
    std::string out = "Take " + described(*chosen) + ": error " + cell(chosen->error, "%.2g") +
                      " (root mean square, relative; worst row " + cell(chosen->worst, "%.2g") +
                      ")\n\n    " + command(trial, *chosen, table) + '\n';
    if (trial.use() == Use::Explicit)
      out += "\nExplicit Euler steps are stable up to dt nu = " + text(chosen->step) + ".\n";
    return out;
  }
  if (const Candidate* best = most_accurate(trial, all))
    return "Nothing meets " + text(trial.options.tolerance) + ". The best is " + described(*best) +
           ": error " + cell(best->error, "%.2g") + ".\n" + which_spacing(trial, all);
  return std::string("Nothing can be ") +
         (trial.use() == Use::Derivative ? "computed" : "stepped in time") + " on these points.\n";
}

}  // namespace

void advise(const AdviseOptions& options) {
  if (!options.laplacian() && options.what_for() != Use::Derivative)
    throw BadUsage("--use", "explicit and implicit are about Laplacians");
  const Problem problem = read_points(options);
  check(options, problem);
  const Trial trial = make_trial(options, problem);
  std::vector<Candidate> all = all_candidates(trial, trial.sample);
  const Candidate* chosen = cheapest(trial, all);
  const bool steps = trial.use() != Use::Derivative;
  std::cout << '\n'
            << advice(trial, all, chosen, problem.table) << "\nIn the order of their cost ("
            << (!steps                         ? "search, weights and a product"
                : trial.use() == Use::Explicit ? "entries over the stable step"
                                               : "entries")
            << "); + meets the tolerance" << (steps ? ", - not looked at" : "") << ":\n\n"
            << table(all, chosen, trial);
  if (options.check) check_choice(trial, chosen);
}

}  // namespace gradpsi::apps
