// Time of each stage from points to matrix. Names are data:
// stage:weights/scheme:.../dim:2/n:.../...
//
//     cmake --preset release -DGRADPSI_BUILD_BENCHMARKS=ON && cmake --build --preset release
//     build/release/benchmarks/gradpsi_benchmarks --benchmark_repetitions=7

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <gradpsi/gradpsi.hpp>
#include <map>
#include <random>
#include <string>

namespace {

using gradpsi::Cloud;
using gradpsi::Neighbours;

struct Scene {
  int dimension;
  int points_per_side;
  double support_ratio;
  bool shuffled;

  std::string name() const {
    const int n = static_cast<int>(std::lround(std::pow(points_per_side, dimension)));
    return "dim:" + std::to_string(dimension) + "/n:" + std::to_string(n) +
           "/order:" + (shuffled ? "random" : "lattice");
  }
  Cloud cloud() const {
    Cloud lattice = make_cloud(gradpsi::Lattice{
        .dimension = dimension, .points_per_side = points_per_side, .jitter = 0.2});
    if (!shuffled) return lattice;
    std::vector<int> order(lattice.size());
    for (int i = 0; i < lattice.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), std::mt19937_64(1));
    return Cloud(lattice.positions()(order, Eigen::all), {.volumes = lattice.volumes()});
  }
};

/// The scene's points with their neighbours, made when first asked for.
struct Prepared {
  Cloud cloud;
  Neighbours near;
};
const Prepared& prepared(const Scene& scene) {
  static std::map<std::string, Prepared> all;
  auto found = all.find(scene.name());
  if (found == all.end()) {
    Cloud cloud = scene.cloud();
    Neighbours near = find_neighbours(cloud, scene.support_ratio * cloud.spacing());
    found = all.emplace(scene.name(), Prepared{std::move(cloud), std::move(near)}).first;
  }
  return found->second;
}

void count(benchmark::State& state, const Prepared& scene) {
  const auto entries = static_cast<double>(scene.near.indices.size());
  state.counters["neighbours"] = entries / scene.cloud.size();
  state.counters["ns_per_entry"] = benchmark::Counter(
      entries * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void register_all() {
  // The 316^2 points with 30.3 neighbours are the scene on which other libraries were measured.
  const Scene scenes[] = {{1, 2'000'000, 3.5, false}, {2, 316, 3.14, false}, {2, 316, 3.14, true},
                          {2, 1000, 3.0, false},      {3, 46, 2.43, false},  {3, 46, 2.43, true}};
  const char* schemes[] = {"laplacian-mixed-zoc", "laplacian-mixed-soc", "gradient-direct-foc",
                           "gradient-direct-soc"};
  const auto add = [](const std::string& name, auto run) {
    benchmark::RegisterBenchmark(name.c_str(), run)
        ->Unit(benchmark::kMillisecond)
        ->MeasureProcessCPUTime()
        ->UseRealTime();
  };
  for (const Scene& scene : scenes)
    for (const int threads : {1, 2}) {
      const std::string where = scene.name() + "/threads:" + std::to_string(threads);
      add("stage:search/" + where, [=](benchmark::State& state) {
        const Prepared& p = prepared(scene);
        for (auto _ : state)
          benchmark::DoNotOptimize(find_neighbours(p.cloud, p.near.support(0), threads));
        count(state, p);
      });
      for (const char* scheme : schemes)
        add("stage:weights/scheme:" + std::string(scheme) + "/" + where,
            [=](benchmark::State& state) {
              const Prepared& p = prepared(scene);
              for (auto _ : state)
                benchmark::DoNotOptimize(
                    assemble(scheme, p.cloud, p.near,
                             {.on_degenerate = gradpsi::OnDegenerate::Lower, .threads = threads}));
              count(state, p);
            });
    }
}

}  // namespace

int main(int argc, char** argv) {
  register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
