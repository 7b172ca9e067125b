// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "matrix/products.hpp"

#include "base/lanes.hpp"

namespace gradpsi {
namespace {

constexpr int W = GRADPSI_LANES;
using V = Lanes<W>;

/// x at W columns. Processors that are better at single loads than at gathers get W = 4; see base/cpu.cpp.
[[gnu::always_inline]] inline V gather(const double* x, const int* column) {
#if GRADPSI_LANES == 8
  return (V)_mm512_i32gather_pd(_mm256_loadu_si256((const __m256i*)column), x, 8);
#elif GRADPSI_LANES == 4
  return V{x[column[0]], x[column[1]], x[column[2]], x[column[3]]};
#else
  return V{x[column[0]], x[column[1]]};
#endif
}

[[gnu::always_inline]] inline V values(const double* a) { return load<W>(a); }
[[gnu::always_inline]] inline V values(const float* a) {
  typedef float Single __attribute__((vector_size(W * sizeof(float))));
  Single v;
  __builtin_memcpy(&v, a, sizeof v);
  return __builtin_convertvector(v, V);
}

using Mask = decltype(V{} < V{});

/// All lanes before `count`, which may be any number.
[[gnu::always_inline]] inline Mask first_lanes(int count) {
  Mask lane;
  for (int l = 0; l < W; ++l) lane[l] = l;
  return lane < count;
}

template <int matrices, int vectors, class Value>
void product(const ProductArguments<Value>& arguments, int begin, int end) {
  constexpr int products = matrices * vectors;
  constexpr int sums = products == 1 ? 2 : 1;  // so that additions need not wait for one another
  constexpr int step = sums * W;
  const int* const inner = arguments.inner;
  for (int i = begin; i < end; ++i) {
    V sum[sums][products] = {};
    int k = arguments.outer[i];
    const int stop = arguments.outer[i + 1];
    for (; k + step <= stop; k += step)
      for (int s = 0; s < sums; ++s)
        for (int v = 0; v < vectors; ++v) {
          const V x = gather(arguments.x[v], inner + k + s * W);
          for (int m = 0; m < matrices; ++m)
            sum[s][m * vectors + v] += values(arguments.values[m] + k + s * W) * x;
        }
    // The rest at once, together with what follows and does not count: a loop over it would end at
    // another place in each row, which no processor can foresee.
    const bool at_once = k < stop && k + step <= arguments.entries;
    for (int s = 0; at_once && s < sums; ++s)
      for (int v = 0; v < vectors; ++v) {
        const Mask counts = first_lanes(stop - k - s * W);
        const V x = gather(arguments.x[v], inner + k + s * W);
        for (int m = 0; m < matrices; ++m) {
          const V a = values(arguments.values[m] + k + s * W);
          sum[s][m * vectors + v] += (counts ? a : V{}) * (counts ? x : V{});
        }
      }
    for (int p = 0; p < products; ++p) {
      double total = sum_of_lanes(sums == 2 ? sum[0][p] + sum[sums - 1][p] : sum[0][p]);
      if (!at_once)
        for (int l = k; l < stop; ++l)
          total += arguments.values[p / vectors][l] * arguments.x[p % vectors][inner[l]];
      arguments.y[p][i - begin] = total;
    }
  }
}

}  // namespace

template <>
ProductKernels product_kernels<GRADPSI_LANES>() {
  return {
      {product<1, 1, double>, product<1, 2, double>, product<1, 3, double>, product<1, 4, double>},
      {product<1, 1, double>, product<2, 1, double>, product<3, 1, double>},
      product<1, 1, float>};
}

}  // namespace gradpsi
