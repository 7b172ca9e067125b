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
#include <array>
#include <cmath>
#include <filesystem>
#include <gradpsi/gradpsi.hpp>
#include <iostream>
#include <limits>

#include "common/progress.hpp"
#include "common/study.hpp"
#include "common/timing.hpp"
#include "studies/failures.hpp"
#include "studies/tradeoff_gp.hpp"

namespace gradpsi::apps {

namespace {

using gradpsi::Cloud;
using gradpsi::Derivative;
using gradpsi::Scheme;
using std::filesystem::path;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<const char*, 2> arrangements = {"regular", "irregular"};
constexpr double irregular_jitter = 0.2, wave_number = 4;

/// What is measured of one matrix.
struct Result {
  Scheme scheme;
  int kernel, arrangement;
  double support_ratio;
  int points;
  double entries_per_row = 0, bytes_per_point = 0;
  double l2 = not_a_number, max = not_a_number;                    // of the derivative
  double solution_l2 = not_a_number, solution_max = not_a_number;  // of the Dirichlet problem
  double assemble = 0, product = 0, solve = not_a_number;          // seconds a point
  bool grows = false;  // Laplacians, outermost points held

  bool laplacian() const { return scheme.derivative == Derivative::Laplacian; }
};

std::vector<int> sides(const StudyOptions& options, bool default_kernel) {
  static const std::array<std::vector<int>, 3> full = {
      {{40, 160, 640, 2560}, {20, 40, 80, 160}, {8, 12, 18}}};
  static const std::array<std::vector<int>, 3> quick = {{{40, 160}, {16, 32}, {8, 11}}};
  std::vector<int> all = (options.quick ? quick : full)[options.dimension - 1];
  if (!default_kernel) all.pop_back();
  return all;
}

std::vector<double> support_ratios(const StudyOptions& options) {
  return options.quick ? std::vector{2.5, 3.5} : std::vector{2.0, 2.5, 3.0, 3.5, 4.5};
}

/// Degrees 5 and 6 have 55 and 83 unknowns in 3D: more than the neighbours of all but the widest support.
std::vector<Scheme> studied_schemes(int dimension) {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : gradpsi::schemes())
    if (dimension < 3 || degree(scheme) <= 4) chosen.push_back(scheme);
  return chosen;
}

/// u, its first derivatives (n x d) and its Laplacian.
struct Exact {
  Eigen::VectorXd u;
  Eigen::MatrixXd gradient;
  Eigen::VectorXd laplacian;
};
Exact exact(const gradpsi::Positions& x) {
  Eigen::ArrayXXd phase = wave_number * x.array();
  for (Eigen::Index a = 0; a < x.cols(); ++a) phase.col(a) += 0.5 * static_cast<double>(a + 1);
  const Eigen::ArrayXXd s = phase.sin();
  Exact result{s.rowwise().prod(), Eigen::MatrixXd(x.rows(), x.cols()), {}};
  for (Eigen::Index a = 0; a < x.cols(); ++a) {
    Eigen::ArrayXXd factors = s;
    factors.col(a) = wave_number * phase.col(a).cos();
    result.gradient.col(a) = factors.rowwise().prod();
  }
  result.laplacian = -wave_number * wave_number * static_cast<double>(x.cols()) * result.u;
  return result;
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
  Exact exact;
  std::vector<int> inner;
  gradpsi::FixedValues walls;
};

Scene make_scene(int dimension, int side, int arrangement) {
  Cloud cloud = make_cloud(gradpsi::Lattice{.dimension = dimension,
                                            .points_per_side = side,
                                            .jitter = arrangement == 0 ? 0 : irregular_jitter});
  Scene scene{cloud, exact(cloud.positions()), inner_points(dimension, side), {}};
  for (int i = 0, k = 0; i < cloud.size(); ++i)
    if (k < std::ssize(scene.inner) && scene.inner[k] == i)
      ++k;
    else
      scene.walls.points.push_back(i);
  scene.walls.values = scene.exact.u(scene.walls.points);
  return scene;
}

void measure_derivative(const Scene& scene, const gradpsi::Operator& op, int threads, Result& r) {
  const int n = scene.cloud.size();
  Eigen::MatrixXd derivative;
  r.product = median_seconds(
                  [&] { gradpsi::multiply(op.axes, scene.exact.u, derivative, threads); }, 1e-3) /
              n;
  const Eigen::MatrixXd& known =
      r.laplacian() ? Eigen::MatrixXd(scene.exact.laplacian) : scene.exact.gradient;
  const Eigen::VectorXd error = (derivative - known).rowwise().norm();
  std::tie(r.l2, r.max) = norms(error, scene.inner, known.rowwise().norm().maxCoeff());
}

/// lap u = f with the outermost points held; left out where the matrix is singular.
void measure_solution(const Scene& scene, const gradpsi::Operator& op, int threads, Result& r) {
  Eigen::MatrixXd u = scene.exact.u;
  u(scene.inner, 0).setZero();
  gradpsi::Stopwatch watch;
  try {
    gradpsi::ImplicitDiffusion steady(scene.cloud, op, {.fixed = scene.walls},
                                      {.time_step = std::numeric_limits<double>::infinity(),
                                       .source = -scene.exact.laplacian,
                                       .solver = {.threads = threads}});
    steady.step(u);
  } catch (const std::exception&) {  // singular, or too ill-conditioned to be solved
    return;
  }
  r.solve = watch.lap() / scene.cloud.size();
  std::tie(r.solution_l2, r.solution_max) =
      norms((u.col(0) - scene.exact.u).cwiseAbs(), scene.inner, 1);
}

Result measure(const Scene& scene, const Scheme& scheme, int kernel, int arrangement, double ratio,
               const gradpsi::Neighbours& near, double search_seconds,
               const StudyOptions& options) {
  const int n = scene.cloud.size();
  Result r{scheme, kernel, arrangement, ratio, n};
  const gradpsi::AssemblyOptions assembly{.kernel = gradpsi::kernels()[kernel],
                                          .on_degenerate = gradpsi::OnDegenerate::Widen,
                                          .threads = options.threads};
  gradpsi::Operator op;
  r.assemble = (search_seconds +
                median_seconds([&] { op = assemble(scheme, scene.cloud, near, assembly); }, 0)) /
               n;
  for (const auto& matrix : op.axes)
    r.bytes_per_point += (12.0 * static_cast<double>(matrix.nonZeros()) + 4.0 * n) / n;
  r.entries_per_row = static_cast<double>(op.matrix().nonZeros()) / n;
  measure_derivative(scene, op, options.threads, r);
  if (!r.laplacian()) return r;
  r.grows = forecast(scene.cloud, op.matrix(), scene.inner, op.volumes).grows;
  measure_solution(scene, op, options.threads, r);
  return r;
}

std::vector<Result> study(const StudyOptions& options) {
  const auto schemes = studied_schemes(options.dimension);
  const auto ratios = support_ratios(options);
  const int kernels = options.quick ? 1 : static_cast<int>(gradpsi::kernels().size());
  const auto all_sides = sides(options, true);
  Progress progress(static_cast<int>(2 * all_sides.size() * ratios.size()), "clouds and supports");
  int done = 0;
  std::vector<Result> results;
  for (const int side : all_sides)
    for (int arrangement = 0; arrangement < 2; ++arrangement) {
      const Scene scene = make_scene(options.dimension, side, arrangement);
      for (const double ratio : ratios) {
        gradpsi::Neighbours near;
        const double search = median_seconds(
            [&] { near = find_neighbours(scene.cloud, ratio / side, options.threads); }, 0);
        for (int kernel = 0; kernel < kernels; ++kernel)
          if (kernel == 0 || side != all_sides.back())
            for (const Scheme& scheme : schemes)
              results.push_back(
                  measure(scene, scheme, kernel, arrangement, ratio, near, search, options));
        progress.show(++done);
      }
    }
  return results;
}

std::string csv(const std::vector<Result>& results, int dimension) {
  std::string out =
      "scheme,dimension,kernel,support_ratio,arrangement,points,spacing,entries_per_row,error_l2,"
      "error_max,solution_l2,solution_max,assemble_seconds,product_seconds,solve_seconds,"
      "bytes_per_point,stable,weight,consistency\n";
  for (const Result& r : results) {
    out += name(r.scheme) + ',' + std::to_string(dimension) + ',' +
           std::string(gradpsi::kernels()[r.kernel].name) + ',' + cell(r.support_ratio) + ',' +
           arrangements[r.arrangement] + ',' + std::to_string(r.points) + ',' +
           cell(std::pow(r.points, -1.0 / dimension));
    for (const double x : {r.entries_per_row, r.l2, r.max, r.solution_l2, r.solution_max,
                           r.assemble, r.product, r.solve, r.bytes_per_point})
      out += ',' + cell(x, "%.4g");
    out += r.laplacian() ? (r.grows ? ",0," : ",1,") : ",,";
    out += std::string(name(r.scheme.weight)) + ',' + consistency_name(r.scheme) + '\n';
  }
  return out;
}

/// What a derivative is wanted for: the seconds it takes and the error it has, for the whole cloud.
struct Use {
  const char* key;
  const char* text;
  double (*seconds)(const Result&);
  double Result::*error;
  bool stable_only;
};
constexpr std::array uses = {
    Use{"assemble", "one derivative on new points (search and weights)",
        [](const Result& r) { return r.assemble * r.points; }, &Result::l2, false},
    Use{"product", "one more derivative on the same points (a product)",
        [](const Result& r) { return r.product * r.points; }, &Result::l2, false},
    Use{"solve", "the Dirichlet problem (search, weights, solution)",
        [](const Result& r) { return (r.assemble + r.solve) * r.points; }, &Result::solution_l2,
        true}};

/// Those that nothing else is both cheaper and more accurate than, cheapest first.
std::vector<const Result*> front(const std::vector<Result>& results, const Use& use,
                                 Derivative derivative, int arrangement) {
  std::vector<const Result*> sorted, best;
  for (const Result& r : results)
    if (r.scheme.derivative == derivative && r.arrangement == arrangement &&
        std::isfinite(r.*use.error) && std::isfinite(use.seconds(r)) &&
        !(use.stable_only && r.grows))
      sorted.push_back(&r);
  std::ranges::sort(sorted, {}, [&](const Result* r) { return use.seconds(*r); });
  for (const Result* r : sorted)
    if (best.empty() || r->*use.error < best.back()->*use.error) best.push_back(r);
  return best;
}

std::string front_csv(const std::vector<Result>& results) {
  std::string out = "derivative,use,arrangement,seconds,error,scheme\n";
  for (const Derivative derivative : {Derivative::Gradient, Derivative::Laplacian})
    for (const Use& use : uses)
      for (int arrangement = 0; arrangement < 2; ++arrangement)
        for (const Result* r : front(results, use, derivative, arrangement))
          out += std::string(name(derivative)) + ',' + use.key + ',' + arrangements[arrangement] +
                 ',' + cell(use.seconds(*r)) + ',' + cell(r->*use.error) + ',' + name(r->scheme) +
                 '\n';
  return out;
}

/// How much longer twice the accuracy takes along a front: by the slope of log(time) on log(error).
double price_of_a_factor_2(const std::vector<const Result*>& front, const Use& use) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const Result* r : front) {
    const double lx = std::log(r->*use.error), ly = std::log(use.seconds(*r));
    n += 1, x += lx, y += ly, xx += lx * lx, xy += lx * ly;
  }
  return n < 2 ? not_a_number : std::exp2(-(n * xy - x * y) / (n * xx - x * x));
}

std::string front_text(const std::vector<Result>& results, const Use& use, Derivative derivative,
                       int arrangement) {
  const auto best = front(results, use, derivative, arrangement);
  if (best.empty()) return {};
  std::string out = std::string(name(derivative)) + ", " + arrangements[arrangement] + " points, " +
                    use.text + ": the cheapest for an error of\n";
  double uncorrected = 1e300;
  for (const Result& r : results)
    if (r.scheme.derivative == derivative && r.arrangement == arrangement &&
        r.scheme.consistency == gradpsi::Consistency::Zoc && r.*use.error < uncorrected)
      uncorrected = r.*use.error;
  const Result* last = nullptr;
  for (double error = 0.1; error > 1e-12; error /= std::sqrt(10.0)) {
    const auto found = std::ranges::find_if(best, [&](auto* r) { return r->*use.error <= error; });
    if (found == best.end()) break;
    if (*found == last) continue;
    last = *found;
    const std::string scheme = name(last->scheme);
    out += padded(cell(error, "%.0e"), 9) + padded(cell(1e3 * use.seconds(*last), "%.3g"), 10) +
           " ms   " + scheme + std::string(28 - scheme.size(), ' ') + "h/dx " +
           padded(cell(last->support_ratio, "%.1f"), 3) + padded(std::to_string(last->points), 9) +
           " points   " + std::string(gradpsi::kernels()[last->kernel].name) + '\n';
  }
  out += "  twice the accuracy takes " + cell(price_of_a_factor_2(best, use), "%.2g") +
         " times as long; best error without correction " + cell(uncorrected, "%.1e") +
         ", of all " + cell(best.back()->*use.error, "%.1e") + "\n\n";
  return out;
}

}  // namespace

void tradeoff(const StudyOptions& options) {
  create_folder(options.out);
  const std::vector<Result> results = study(options);
  const std::string suffix =
      options.dimension == 2 ? "" : "_" + std::to_string(options.dimension) + "d";
  const auto in_out = [&](const std::string& file) { return options.out / file; };
  const std::string table = "tradeoff" + suffix + ".csv",
                    fronts = "tradeoff_front" + suffix + ".csv";
  gradpsi::write_text(in_out(table), csv(results, options.dimension));
  gradpsi::write_text(in_out(fronts), front_csv(results));
  std::string text;
  for (const Derivative derivative : {Derivative::Gradient, Derivative::Laplacian})
    for (const Use& use : uses)
      for (const int arrangement : {1, 0})
        text += front_text(results, use, derivative, arrangement);
  gradpsi::write_text(in_out("tradeoff" + suffix + ".txt"),
                      provenance(options.threads) + '\n' + text);
  std::cout << text << std::flush;
  draw(in_out("tradeoff" + suffix + ".gp"),
       "csv = '" + table + "'\nfronts = '" + fronts + "'\nsuffix = '" + suffix +
           "'\ndefault_kernel = '" + std::string(gradpsi::kernels().front().name) + "'\n" +
           tradeoff_gp,
       in_out(table));
  std::cout << "Results: " << in_out(table).string()
            << "\nFigures: " << in_out("tradeoff_gradient" + suffix + ".png").string() << ", "
            << in_out("tradeoff_laplacian" + suffix + ".png").string() << " (and .svg)\n";
}

}  // namespace gradpsi::apps
