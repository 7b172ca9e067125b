// The time of every step from points to products, beside the memory's own speed and other ways of doing
// the same.
//
//     gradpsi_benchmarks [--quick] [Google Benchmark's options]
//
// --quick leaves out scenes of more than 100,000 points. bash benchmarks/run.sh runs all and draws figures.

#include <algorithm>
#include <cstring>
#include <fstream>

#include "suite.hpp"

namespace {

const std::string soc = "laplacian-mixed-soc";
const char* const refillable[] = {"laplacian-mixed-zoc", "laplacian-mixed-soc",
                                  "gradient-direct-foc", "gradient-direct-soc"};

void add_schemes(const Scene& scene) {
  for (const char* scheme : refillable) add_weights(scheme, scene);
}

/// What shows how the cost of a point depends on the number of points or neighbours.
void add_chain(const Scene& scene) {
  add_search(scene);
  add_weights(soc, scene);
  add_products(scene, Products::Main);
}

/// What should not depend on how much spacings differ.
void add_graded(bool quick, double grading) {
  for (const auto& [dimension, side] :
       {std::pair(2, 100), {2, 316}, {2, 1000}, {3, 22}, {3, 46}, {3, 100}}) {
    const Scene scene{.dimension = dimension, .points_per_side = side, .grading = grading};
    if (quick && scene.size() > 100'000) continue;
    add_spacing(scene);
    if (grading == 1) continue;  // the rest is in the chains
    add_search(scene);
    add_weights(soc, scene);
  }
}

/// Everything, for one scene in tree order.
void add_all(const Scene& scene) {
  add_search(scene);
  add_rival_searches(scene);
  add_schemes(scene);
  for (const char* scheme : refillable) add_refill(scheme, scene);
  add_forms(scene);
  add_probes(scene);
  add_fused_weights(scene);
  add_fill(scene);
  add_gradient_products(scene);
  add_vector_products(scene);
  add_products(scene, Products::All);
  add_on_the_fly(scene);
}

void add_suite(bool quick) {
  add_roof();
  const Scene plane{2, quick ? 316 : 1000}, space{3, quick ? 46 : 79};
  for (const int side : {1000, 10'000, 100'000, 1'000'000})
    if (!quick || side <= 100'000) add_chain({1, side});
  for (const int side : {32, 100, 316, 1000, 2000})
    if (side == plane.points_per_side)
      add_all(plane);
    else if (!quick || side <= 316)
      add_chain({2, side});
  for (const int side : {10, 22, 46, 79, 100})
    if (side == space.points_per_side)
      add_all(space);
    else if (!quick || side <= 46)
      add_chain({3, side});
  for (Scene scene : {plane, space})
    for (const char* order : {"lattice", "rcm", "random"}) {
      scene.order = order;
      add_products(scene, Products::ByOrder);
    }
  for (const double ratio : {2.0, 4.0, 5.0}) add_chain({2, 316, ratio});
  for (const double grading : {1.0, 10.0, 100.0}) add_graded(quick, grading);
  // Slow ones, and the support they are made for.
  add_weights("laplacian-positive", {2, 316, 2.5});
  add_weights("laplacian-ls-4", {2, 316, 4.5});
  // What other libraries were measured on.
  for (const Scene& scene : {Scene{2, 316, 3.14, "lattice"}, Scene{3, 46, 2.43, "lattice"}}) {
    add_search(scene);
    add_rival_searches(scene);
    add_schemes(scene);
  }
}

void add_context() {
  std::string line;
  for (std::ifstream in("/proc/cpuinfo"); std::getline(in, line);)
    if (line.starts_with("model name")) {
      benchmark::AddCustomContext("cpu", line.substr(std::min(line.find(':') + 2, line.size())));
      break;
    }
  benchmark::AddCustomContext("compiler", __VERSION__);
  benchmark::AddCustomContext("eigen", std::to_string(EIGEN_WORLD_VERSION) + "." +
                                           std::to_string(EIGEN_MAJOR_VERSION) + "." +
                                           std::to_string(EIGEN_MINOR_VERSION));
}

}  // namespace

int main(int argc, char** argv) {
  const auto is_quick = [](const char* argument) { return !std::strcmp(argument, "--quick"); };
  char** const end = std::remove_if(argv + 1, argv + argc, is_quick);
  const bool quick = end != argv + argc;
  argc = static_cast<int>(end - argv);
  argv[argc] = nullptr;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  add_suite(quick);
  add_context();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
