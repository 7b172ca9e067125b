#include "suite.hpp"

#include <omp.h>

namespace {

void add_timed(const std::string& name, const std::function<void(benchmark::State&)>& run) {
  benchmark::RegisterBenchmark(name.c_str(), run)
      ->Unit(benchmark::kMillisecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

}  // namespace

std::vector<int> thread_counts() {
  return omp_get_num_procs() > 1 ? std::vector{1, 2} : std::vector{1};
}

void add(const std::string& what, const Scene& scene, const Run& run,
         const std::vector<int>& threads) {
  for (const int t : threads)
    add_timed(what + "/" + scene.name() + "/threads:" + std::to_string(t),
              [=](benchmark::State& state) {
                Eigen::setNbThreads(t);
                run(state, prepared(scene), t);
              });
}

void add_without_scene(const std::string& what,
                       const std::function<void(benchmark::State& state, int threads)>& run) {
  for (const int t : thread_counts())
    add_timed(what + "/threads:" + std::to_string(t),
              [=](benchmark::State& state) { run(state, t); });
}

void count(benchmark::State& state, const Work& work) {
  using benchmark::Counter;
  constexpr auto per_second = Counter::kIsIterationInvariantRate;
  const auto seconds_per = per_second | Counter::kInvert;
  // In units of 1e9: nanoseconds and gigabytes.
  const auto add_counter = [&](const char* name, double amount, Counter::Flags flags) {
    if (amount > 0) state.counters[name] = Counter(amount * 1e-9, flags);
  };
  add_counter("ns_per_entry", work.entries, seconds_per);
  add_counter("ns_per_point", work.points, seconds_per);
  add_counter("GB_per_s", work.bytes, per_second);
}

void count(benchmark::State& state, const Prepared& scene, Work work) {
  work.points = scene.cloud.size();
  count(state, work);
  state.counters["neighbours"] = scene.neighbours();
}
