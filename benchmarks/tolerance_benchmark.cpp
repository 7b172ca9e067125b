// Rows chosen to a tolerance beside single schemes: CSV, a line for each.
//
//     gradpsi_tolerance_benchmark scenes|bounds [--threads N]
//
// scenes: entries a row, rows that miss the tolerance and seconds of assemble_to(), and of the single schemes that
// miss no more rows, or the fewest, with the fewest entries; of these ls-2 to ls-6 are tried with nine supports.
// Between them, the scheme that most rows are by, on as many neighbours as these have: search and weights.
// bounds: certified_errors() over the largest error that random waves have, how many rows are within which ratio.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <complex>
#include <cstdio>
#include <cstring>
#include <gradpsi/gradpsi.hpp>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace {

using namespace gradpsi;

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The least time of three calls.
template <class Call>
double time(const Call& call) {
  double least = 1e300;
  for (int k = 0; k < 3; ++k) {
    const double start = seconds();
    call();
    least = std::min(least, seconds() - start);
  }
  return least;
}

struct Scene {
  std::string name;
  Cloud cloud;
  Derivative derivative;
  double wavelength, tolerance;
  DenseVector L() const { return DenseVector::Constant(1, wavelength); }
};

/// The unit square, spacings ten times as large at one corner as at the other.
Cloud graded() {
  Positions x = make_cloud({.dimension = 2, .points_per_side = 60, .jitter = 0.2}).positions();
  for (double& a : x.reshaped()) a = (std::pow(10, a) - 1) / 9;
  return Cloud(x);
}

std::vector<Scene> scenes() {
  const Cloud square =
      Cloud(make_cloud({.dimension = 2, .points_per_side = 100, .jitter = 0.2}).positions());
  const Cloud cube =
      Cloud(make_cloud({.dimension = 3, .points_per_side = 24, .jitter = 0.2}).positions());
  const Cloud letters = read_cloud("apps/data/letters.csv");
  return {{"square", square, Derivative::Laplacian, 0.5, 0.01},
          {"square", square, Derivative::Laplacian, 0.2, 0.01},
          {"square", square, Derivative::Gradient, 0.2, 0.01},
          {"graded", graded(), Derivative::Laplacian, 0.3, 0.1},
          {"cube", cube, Derivative::Laplacian, 1.0, 0.02},
          {"letters", letters, Derivative::Laplacian, 0.5, 0.05}};
}

struct Outcome {
  double entries = 0, missed = 0, seconds = 0;
};

Outcome outcome(const Operator& op, const DenseVector& errors, double tolerance) {
  const double rows = static_cast<double>(errors.size());
  return {static_cast<double>(op.matrix().nonZeros()) / rows,
          static_cast<double>((errors.array() > tolerance).count()) / rows};
}

void print(const Scene& scene, const std::string& what, const Outcome& found, double largest) {
  std::printf("%s,%s,%g,%g,%s,%.1f,%.2f,%.3g,%.4f\n", scene.name.c_str(),
              std::string(name(scene.derivative)).c_str(), scene.wavelength, scene.tolerance,
              what.c_str(), found.entries, 100 * found.missed, largest, found.seconds);
  std::fflush(stdout);
}

/// One scheme for all rows.
struct Single {
  std::string what;
  Outcome found;  // seconds: of search and weights
  double largest = 0;
};

/// @param ratio  of supports and local spacings
Single single(const Scheme& scheme, const Scene& scene, double ratio, const DenseVector& spacing,
              int threads) {
  Operator op;
  const double took = time([&] {
    op = assemble(scheme, scene.cloud, find_neighbours(scene.cloud, ratio * spacing, threads),
                  {.on_degenerate = OnDegenerate::Zero, .threads = threads});
  });
  const DenseVector errors =
      certified_errors(scene.derivative, scene.cloud, op, scene.L(), threads);
  char what[64];
  std::snprintf(what, sizeof what, "%s %.1f", name(scheme).c_str(), ratio);
  Single result{what, outcome(op, errors, scene.tolerance), errors.maxCoeff()};
  result.found.seconds = took;
  return result;
}

/// The supports on which points have as many neighbours as the rows by that scheme, in local spacings.
double same_neighbours(const Operator& op, const Scheme& scheme, const Scene& scene,
                       const DenseVector& spacing) {
  double neighbours = 0, rows = 0, ratio = 1.6;
  for (int i = 0; i < scene.cloud.size(); ++i)
    if (op.rows.schemes[i] == scheme) neighbours += op.rows.neighbours[i], ++rows;
  const auto usual = [&] {
    const Neighbours near = find_neighbours(scene.cloud, ratio * spacing);
    return static_cast<double>(near.indices.size()) / scene.cloud.size();
  };
  while (usual() < neighbours / rows) ratio += 0.1;
  return ratio;
}

/// The scheme that most rows are by.
Scheme commonest(const Operator& op) {
  std::map<std::string, int> rows;
  for (const auto& scheme : op.rows.schemes) ++rows[name(*scheme)];
  return Scheme(std::ranges::max_element(rows, {}, [](const auto& r) { return r.second; })->first);
}

void compare(const Scene& scene, int threads) {
  const ToleranceOptions options{.on_miss = OnDegenerate::Lower, .threads = threads};
  Operator op;
  const double took = time([&] {
    op = assemble_to({scene.tolerance, scene.L()}, scene.derivative, scene.cloud, options);
  });
  Outcome chosen = outcome(op, op.rows.errors, scene.tolerance);
  chosen.seconds = took;
  print(scene, "chosen", chosen, op.rows.errors.maxCoeff());
  const Scheme most = commonest(op);
  const DenseVector spacing = local_spacing(scene.cloud, threads);
  const Single base =
      single(most, scene, same_neighbours(op, most, scene, spacing), spacing, threads);
  print(scene, "most rows: " + base.what, base.found, base.largest);
  std::vector<Single> singles;
  for (int P = 2; P <= 6; ++P)
    for (double ratio = 1.6; ratio < 5.8; ratio += 0.5)
      singles.push_back(
          single(Scheme(std::string(name(scene.derivative)) + "-ls-" + std::to_string(P)), scene,
                 ratio, spacing, threads));
  const auto fewest =
      std::ranges::min_element(singles, {}, [](const Single& s) { return s.found.missed; });
  const double bar = std::max(fewest->found.missed, chosen.missed);
  const Single* best = nullptr;
  for (const Single& s : singles)
    if (s.found.missed <= bar && (!best || s.found.entries < best->found.entries)) best = &s;
  print(scene, "best single: " + best->what, best->found, best->largest);
}

/// The largest error of row i among random waves of the shortest length, and longer ones.
double sampled(const Scene& scene, const Operator& op, int i, std::mt19937& random) {
  const int d = scene.cloud.dimension();
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> part(0.5, 1);
  double worst = 0;
  for (int w = 0; w < 400; ++w) {
    Eigen::Vector3d k = Eigen::Vector3d::Zero();
    for (int a = 0; a < d; ++a) k[a] = normal(random);
    k *= 2 * std::numbers::pi / scene.wavelength / k.norm() * (w % 4 == 0 ? part(random) : 1);
    double squares = 0;
    for (int o = 0; o < std::ssize(op.axes); ++o) {
      std::complex<double> sum = 0;
      for (SparseMatrix::InnerIterator a(op.axes[o], i); a; ++a) {
        const auto r =
            scene.cloud.positions().row(static_cast<int>(a.col())) - scene.cloud.positions().row(i);
        sum += a.value() * std::polar(1.0, k.head(d).dot(r.transpose()));
      }
      squares += std::norm(op.axes.size() > 1 ? sum - std::complex<double>(0, k[o])
                                              : sum + k.squaredNorm());
    }
    worst = std::max(worst, std::sqrt(squares));
  }
  return worst / std::pow(2 * std::numbers::pi / scene.wavelength, order(scene.derivative));
}

void bounds(const Scene& scene, int threads) {
  const Operator op = assemble_to({scene.tolerance, scene.L()}, scene.derivative, scene.cloud,
                                  {.on_miss = OnDegenerate::Lower, .threads = threads});
  std::mt19937 random(1);
  const double edges[] = {1, 1.05, 1.1, 1.2, 1.3, 1.4, 1.5, 2};
  std::vector<int> within(std::size(edges) + 1);
  for (int i = 0; i < scene.cloud.size(); i += 5) {
    const double ratio = op.rows.errors[i] / sampled(scene, op, i, random);
    ++within[std::ranges::lower_bound(edges, ratio) - std::begin(edges)];
  }
  std::printf("%s,%s,%g", scene.name.c_str(), std::string(name(scene.derivative)).c_str(),
              scene.wavelength);
  for (const int count : within) std::printf(",%d", count);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string study = argc > 1 ? argv[1] : "";
  const int threads = argc > 3 && std::strcmp(argv[2], "--threads") == 0 ? std::atoi(argv[3]) : 1;
  if (study != "scenes" && study != "bounds") {
    std::fprintf(stderr, "usage: %s scenes|bounds [--threads N]\n", argv[0]);
    return 2;
  }
  std::printf("%s\n",
              study == "scenes"
                  ? "scene,derivative,wavelength,tolerance,rows,entries a row,missed %,largest "
                    "error,seconds"
                  : "scene,derivative,wavelength,broken,to 1.05,1.1,1.2,1.3,1.4,1.5,2,more");
  for (const Scene& scene : scenes()) (study == "scenes" ? compare : bounds)(scene, threads);
}
