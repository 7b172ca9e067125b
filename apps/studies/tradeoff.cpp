#include "studies/tradeoff.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <gradpsi/gradpsi.hpp>
#include <numbers>
#include <tuple>
#include <utility>

#include "common/columns.hpp"
#include "common/fields.hpp"
#include "common/fit.hpp"

namespace gradpsi::apps::tradeoff {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr auto sine = TestField::Wave::Sine;
constexpr TestField field{0, {{{sine, 4, 0.5}, {sine, 4, 1}, {sine, 4, 1.5}}}};

std::vector<int> sides(const Study& study) {
  static const std::array<std::vector<int>, 3> full = {
      {{40, 160, 640, 2560}, {20, 40, 80, 160}, {8, 12, 18}}};
  static const std::array<std::vector<int>, 3> quick = {{{40, 160}, {16, 32}, {8, 11}}};
  return (study.quick ? quick : full)[study.dimension - 1];
}

std::vector<double> support_ratios(const Study& study) {
  return study.quick ? std::vector{2.5, 3.5} : std::vector{2.0, 2.5, 3.0, 3.5, 4.5};
}

std::vector<double> tolerances(const Study& study) {
  return study.quick ? std::vector{1e-2} : std::vector{1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
}

/// Gradients and Laplacians. Degrees 5 and 6 have 55 and 83 unknowns in 3D: more than the neighbours of all but the widest support.
std::vector<Scheme> studied_schemes(int dimension) {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : schemes())
    if (scheme.derivative <= Derivative::Laplacian && (dimension < 3 || degree(scheme) <= 4))
      chosen.push_back(scheme);
  return chosen;
}

/// Root mean square and maximum over `points`, relative to `scale`.
std::pair<double, double> norms(const Eigen::VectorXd& error, const std::vector<int>& points,
                                double scale) {
  double squares = 0, largest = 0;
  for (const int i : points) {
    squares += error[i] * error[i];
    largest = std::max(largest, error[i]);
  }
  return {std::sqrt(squares / static_cast<double>(points.size())) / scale, largest / scale};
}

/// The points of one resolution and what is known there.
struct Scene {
  Cloud cloud;
  Eigen::VectorXd spacing;  // one, or one a point
  Exact exact;
  std::vector<int> inner;
  FixedValues walls;
};

Scene make_scene(const Study& study, int side, Arrangement arrangement) {
  const int dimension = study.dimension;
  Cloud cloud = make_cloud(Lattice{.dimension = dimension,
                                   .points_per_side = side,
                                   .jitter = jitter(arrangement),
                                   .grading = study.grading});
  // To the bit, where the supports of a lattice end at points.
  const Eigen::VectorXd spacing = study.grading > 1
                                      ? Eigen::VectorXd(local_spacing(cloud, study.threads))
                                      : Eigen::VectorXd::Constant(1, 1.0 / side);
  Scene scene{cloud, spacing, exact(field, cloud.positions()), inner_points(dimension, side), {}};
  scene.walls.points = others(cloud.size(), scene.inner);
  scene.walls.values = scene.exact.u(scene.walls.points);
  return scene;
}

void measure_derivative(const Scene& scene, const Operator& op, int threads, Timer& timer,
                        Result& r) {
  Eigen::MatrixXd derivative;
  r.product = timer.seconds([&] { multiply(op.axes, scene.exact.u, derivative, threads); }, 1e-3) /
              r.points;
  const Eigen::MatrixXd& known =
      r.laplacian() ? Eigen::MatrixXd(scene.exact.laplacian) : scene.exact.gradient;
  const Eigen::VectorXd error = (derivative - known).rowwise().norm();
  std::tie(r.l2, r.max) = norms(error, scene.inner, known.rowwise().norm().maxCoeff());
}

/// lap u = f with the outermost points held; left out where the matrix is singular.
void measure_solution(const Scene& scene, const Operator& op, int threads, Result& r) {
  Eigen::MatrixXd u = scene.exact.u;
  u(scene.inner, 0).setZero();
  Stopwatch watch;
  try {
    ImplicitDiffusion steady(
        scene.cloud, op, {.fixed = scene.walls},
        {.time_step = infinity, .source = -scene.exact.laplacian, .solver = {.threads = threads}});
    steady.step(u);
  } catch (const std::exception&) {  // singular, or too ill-conditioned to be solved
    return;
  }
  r.solve = watch.lap() / r.points;
  std::tie(r.solution_l2, r.solution_max) =
      norms((u.col(0) - scene.exact.u).cwiseAbs(), scene.inner, 1);
}

/// Completes a result that says which matrix it is of.
/// @param assembly_seconds  search and weights
void measure(const Scene& scene, const Operator& op, double assembly_seconds, int threads,
             Timer& timer, Result& r) {
  r.assemble = assembly_seconds / r.points;
  for (const auto& matrix : op.axes)
    r.bytes_per_point +=
        (12.0 * static_cast<double>(matrix.nonZeros()) + 4.0 * r.points) / r.points;
  r.entries_per_row = static_cast<double>(op.matrix().nonZeros()) / r.points;
  measure_derivative(scene, op, threads, timer, r);
  if (!r.laplacian()) return;
  r.grows = forecast(scene.cloud, op.matrix(), scene.inner, op.volumes).grows;
  measure_solution(scene, op, threads, r);
}

/// The results of all schemes and the first so many kernels with one support.
void add_results(const Scene& scene, Arrangement arrangement, double support_ratio,
                 int kernel_count, int threads, Timer& timer, std::vector<Result>& results) {
  Neighbours near;
  const Eigen::VectorXd supports = support_ratio * scene.spacing;
  const double search =
      timer.seconds([&] { near = find_neighbours(scene.cloud, supports, threads); }, 0);
  for (int kernel = 0; kernel < kernel_count; ++kernel)
    for (const Scheme& scheme : studied_schemes(scene.cloud.dimension())) {
      Result& result = results.emplace_back(
          Result{scheme, kernel, arrangement, support_ratio, scene.cloud.size()});
      const AssemblyOptions options{
          .kernel = kernels()[kernel], .on_degenerate = OnDegenerate::Widen, .threads = threads};
      Operator op;
      const double weights =
          timer.seconds([&] { op = assemble(scheme, scene.cloud, near, options); }, 0);
      measure(scene, op, search + weights, threads, timer, result);
    }
}

/// The results of rows chosen to tolerances, for waves as short as the field's. Those that miss one are the best
/// there are.
void add_chosen(const Study& study, const Scene& scene, Arrangement arrangement, Timer& timer,
                std::vector<Result>& results) {
  const int d = scene.cloud.dimension();
  const double shortest = 2 * std::numbers::pi / (field.factors[0].wave_number * std::sqrt(d));
  for (const Scheme scheme : {Scheme("gradient-ls-6"), Scheme("laplacian-ls-6")})
    for (const double tolerance : tolerances(study)) {
      Operator op;
      const double seconds = timer.seconds(
          [&] {
            op = assemble_to({tolerance, DenseVector::Constant(1, shortest)}, scheme.derivative,
                             scene.cloud,
                             {.on_miss = OnDegenerate::Lower, .threads = study.threads});
          },
          0);
      const double ratio = (op.rows.supports.array() / scene.spacing.mean()).mean();
      Result& result = results.emplace_back(
          Result{scheme, 0, arrangement, ratio, scene.cloud.size(), tolerance});
      measure(scene, op, seconds, study.threads, timer, result);
    }
}

bool belongs(const Front& front, const Result& r) {
  return !r.chosen() && r.scheme.derivative == front.derivative &&
         r.arrangement == front.arrangement;
}

}  // namespace

std::vector<Result> results(const Study& study, Timer& timer, const ShowProgress& show) {
  const auto ratios = support_ratios(study);
  const auto all_sides = sides(study);
  const int total = static_cast<int>(2 * all_sides.size() * ratios.size());
  int done = 0;
  std::vector<Result> results;
  for (const int side : all_sides)
    for (const Arrangement arrangement : {Arrangement::Regular, Arrangement::Irregular}) {
      const Scene scene = make_scene(study, side, arrangement);
      // The finest points and the quick study: the usual kernel only.
      const bool all_kernels = !study.quick && side != all_sides.back();
      const int kernel_count = all_kernels ? static_cast<int>(kernels().size()) : 1;
      for (const double ratio : ratios) {
        add_results(scene, arrangement, ratio, kernel_count, study.threads, timer, results);
        show(++done, total);
      }
      add_chosen(study, scene, arrangement, timer, results);
    }
  return results;
}

std::string csv(const std::vector<Result>& results, int dimension) {
  constexpr Look measured{"%.4g"};
  const Columns<Result> columns = {
      {"scheme",
       [](auto& r) {
         return r.chosen() ? std::string(name(r.scheme.derivative)) + "-chosen" : name(r.scheme);
       }},
      {"dimension", [=](auto&) { return dimension; }},
      {"kernel", [](auto& r) { return kernels()[r.kernel].name; }},
      {"support_ratio", &Result::support_ratio},
      {"arrangement", [](auto& r) { return name(r.arrangement); }},
      {"points", &Result::points},
      {"spacing", [=](auto& r) { return std::pow(r.points, -1.0 / dimension); }},
      {"entries_per_row", &Result::entries_per_row, measured},
      {"error_l2", &Result::l2, measured},
      {"error_max", &Result::max, measured},
      {"solution_l2", &Result::solution_l2, measured},
      {"solution_max", &Result::solution_max, measured},
      {"assemble_seconds", &Result::assemble, measured},
      {"product_seconds", &Result::product, measured},
      {"solve_seconds", &Result::solve, measured},
      {"bytes_per_point", &Result::bytes_per_point, measured},
      {"stable", [](auto& r) { return !r.laplacian() ? ""
                                      : r.grows      ? "0"
                                                     : "1"; }},
      {"weight", [](auto& r) { return r.chosen() ? "chosen" : name(r.scheme.weight); }},
      {"consistency", [](auto& r) { return r.chosen() ? "chosen" : consistency_name(r.scheme); }},
      {"tolerance", [](auto& r) { return r.chosen() ? cell(r.tolerance, "%.0e") : ""; }}};
  return apps::csv(columns, results);
}

double Front::price_of_a_factor_2() const {
  std::vector<double> errors, seconds;
  for (const Result* r : best) {
    errors.push_back(r->*use.error);
    seconds.push_back(use.seconds(*r));
  }
  return std::exp2(-log_slope(errors, seconds));
}

Front front(const std::vector<Result>& results, Derivative derivative, const Use& use,
            Arrangement arrangement) {
  Front front{derivative, use, arrangement, {}};
  std::vector<const Result*> sorted;
  for (const Result& r : results) {
    if (!belongs(front, r)) continue;
    if (r.scheme.consistency == Consistency::Zoc && r.*use.error < front.uncorrected)
      front.uncorrected = r.*use.error;
    if (std::isfinite(r.*use.error) && std::isfinite(use.seconds(r)) &&
        !(use.stable_only && r.grows))
      sorted.push_back(&r);
  }
  std::ranges::sort(sorted, {}, [&](const Result* r) { return use.seconds(*r); });
  for (const Result* r : sorted)
    if (front.best.empty() || r->*use.error < front.best.back()->*use.error)
      front.best.push_back(r);
  return front;
}

std::string front_csv(const std::vector<Result>& results) {
  std::vector<std::pair<const Front*, const Result*>> rows;
  std::vector<Front> fronts;
  for (const Derivative derivative : {Derivative::Gradient, Derivative::Laplacian})
    for (const Use& use : uses)
      for (const Arrangement arrangement : {Arrangement::Regular, Arrangement::Irregular})
        fronts.push_back(front(results, derivative, use, arrangement));
  for (const Front& front : fronts)
    for (const Result* r : front.best) rows.emplace_back(&front, r);
  return apps::csv({{"derivative", [](auto& row) { return name(row.first->derivative); }},
                    {"use", [](auto& row) { return row.first->use.key; }},
                    {"arrangement", [](auto& row) { return name(row.first->arrangement); }},
                    {"seconds", [](auto& row) { return row.first->use.seconds(*row.second); }},
                    {"error", [](auto& row) { return row.second->*(row.first->use.error); }},
                    {"scheme", [](auto& row) { return name(row.second->scheme); }}},
                   rows);
}

}  // namespace gradpsi::apps::tradeoff
