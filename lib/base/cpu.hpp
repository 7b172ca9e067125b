#pragma once

#include <span>
#include <type_traits>

namespace gradpsi {

/// A width of the vector code, and the instructions that it is compiled for.
struct Cpu {
  const char* name;  // "sse2", "avx2", "avx512"
  int lanes;         // doubles an instruction, W of lanes.hpp: 2, 4, 8
};

/// What this processor can run, narrowest first.
std::span<const Cpu> runnable_cpus();

/// The widest.
const Cpu& cpu();

/// The best for code that is limited by gathers.
const Cpu& gathering_cpu();

/// f(W), W a compile-time constant: the way to a room's functions of that width.
template <class F>
auto at_width([[maybe_unused]] const Cpu& cpu, const F& f) {
#if defined(__x86_64__)
  if (cpu.lanes == 8) return f(std::integral_constant<int, 8>{});
  if (cpu.lanes == 4) return f(std::integral_constant<int, 4>{});
#endif
  return f(std::integral_constant<int, 2>{});
}

}  // namespace gradpsi
