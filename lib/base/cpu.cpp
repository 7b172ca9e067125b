#include "base/cpu.hpp"

#include <vector>

namespace gradpsi {
namespace {

std::vector<Cpu> runnable() {
  std::vector<Cpu> all = {{"sse2", 2}};
#if defined(__x86_64__)
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (avx2) all.push_back({"avx2", 4});
  if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    all.push_back({"avx512", 8});
#endif
  return all;
}

/// Gathers are made of many small steps elsewhere: on a Zen 4, 0.64 ns an entry in the cache instead of
/// 0.37 with single loads.
bool gathers_fast() {
#if defined(__x86_64__)
  return __builtin_cpu_is("intel");
#else
  return false;
#endif
}

}  // namespace

std::span<const Cpu> runnable_cpus() {
  static const std::vector<Cpu> all = runnable();
  return all;
}

const Cpu& cpu() { return runnable_cpus().back(); }

const Cpu& gathering_cpu() {
  static const Cpu& chosen = cpu().lanes < 8 || gathers_fast() ? cpu() : runnable_cpus()[1];
  return chosen;
}

}  // namespace gradpsi
