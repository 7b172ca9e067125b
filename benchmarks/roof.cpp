// What the memory allows: every other benchmark's bytes per second are compared with these.

#include "kernels.hpp"
#include "parallel.hpp"
#include "suite.hpp"

namespace {

constexpr int doubles = 1 << 25;  // 256 MB, far more than caches hold
constexpr int chunk = 1 << 16;

Eigen::VectorXd array(int size) {
  Eigen::VectorXd a(size);
  prefer_large_pages(a.data(), sizeof(double) * size);
  a.setOnes();
  return a;
}

void read_array(benchmark::State& state, int threads) {
  const Eigen::VectorXd a = array(doubles);
  std::vector<double> sums(doubles / chunk);
  for (auto _ : state) {
    parallel_chunks(doubles, chunk, threads, [&](int begin, int end) {
      sums[begin / chunk] = sum(a.data() + begin, end - begin);
    });
    benchmark::DoNotOptimize(sums.data());
    benchmark::ClobberMemory();
  }
  count(state, {.bytes = 8.0 * doubles});
}

void add_arrays(benchmark::State& state, int threads) {
  constexpr int size = doubles / 3;
  Eigen::VectorXd a = array(size), b = array(size), c = array(size);
  for (auto _ : state) {
    parallel_chunks(size, chunk, threads, [&](int begin, int end) {
      triad(b.data() + begin, c.data() + begin, 3, a.data() + begin, end - begin);
    });
    benchmark::ClobberMemory();
  }
  count(state, {.bytes = 24.0 * size});
}

}  // namespace

void add_roof() {
  add_without_scene("op:roof/impl:read", read_array);
  add_without_scene("op:roof/impl:triad", add_arrays);
}
