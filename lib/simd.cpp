#include "simd.hpp"

#include <vector>

namespace gradpsi {
namespace {

template <int W>
Simd compiled(const char* name) {
  return {name, batch_kernels<W>(), candidate_kernels<W>(), product_kernels<W>()};
}

std::vector<Simd> runnable() {
  std::vector<Simd> all = {compiled<2>("sse2")};
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2) all.push_back(compiled<4>("avx2"));
  if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    all.push_back(compiled<8>("avx512"));
#endif
  return all;
}

Simd best() {
  Simd best = runnable_simd().back();
#if defined(__x86_64__)
  // Gathers are made of many small steps elsewhere: on a Zen 4, 0.64 ns an entry in the cache instead of
  // 0.37 with single loads.
  if (runnable_simd().size() > 2 && !__builtin_cpu_is("intel"))
    best.products = product_kernels<4>();
#endif
  return best;
}

}  // namespace

std::span<const Simd> runnable_simd() {
  static const std::vector<Simd> all = runnable();
  return all;
}

const Simd& simd() {
  static const Simd chosen = best();
  return chosen;
}

BatchPoints batch_points(const Cloud& cloud, const Neighbours& near, const Kernel& kernel,
                         const Eigen::VectorXd& volumes) {
  return {cloud.positions().data(),
          volumes.data(),
          {cloud.box()[0], cloud.box()[1], cloud.box()[2]},
          shape(kernel),
          kernel.profile,
          kernel.normalisation[cloud.dimension() - 1],
          near.supports.data(),
          near.supports.size() == 1};
}

}  // namespace gradpsi
