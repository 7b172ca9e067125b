// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "products.hpp"

#include "lanes.hpp"

#if GRADPSI_LANES == 8
#include <immintrin.h>
#endif

namespace gradpsi {
namespace {

constexpr int W = GRADPSI_LANES;
using V = Lanes<W>;

/// x at W columns. Processors that are better at single loads than at gathers get W = 4; see simd.cpp.
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

template <int matrices, int vectors, class Value>
void product(const ProductArguments<Value>& arguments, int begin, int end) {
  constexpr int products = matrices * vectors;
  constexpr int sums = products == 1 ? 2 : 1;  // so that additions need not wait for one another
  const int* const inner = arguments.inner;
  for (int i = begin; i < end; ++i) {
    V sum[sums][products] = {};
    const auto add = [&](int s, int k) __attribute__((always_inline)) {
      for (int v = 0; v < vectors; ++v) {
        const V x = gather(arguments.x[v], inner + k);
        for (int m = 0; m < matrices; ++m)
          sum[s][m * vectors + v] += values(arguments.values[m] + k) * x;
      }
    };
    int k = arguments.outer[i];
    const int stop = arguments.outer[i + 1];
    for (; k + sums * W <= stop; k += sums * W)
      for (int s = 0; s < sums; ++s) add(s, k + s * W);
    if (sums == 2 && k + W <= stop) add(0, k), k += W;
    double total[products];
    for (int p = 0; p < products; ++p)
      total[p] = sum_of_lanes(sums == 2 ? sum[0][p] + sum[sums - 1][p] : sum[0][p]);
    for (; k < stop; ++k)
      for (int v = 0; v < vectors; ++v) {
        const double x = arguments.x[v][inner[k]];
        for (int m = 0; m < matrices; ++m) total[m * vectors + v] += arguments.values[m][k] * x;
      }
    for (int p = 0; p < products; ++p) arguments.y[p][i - begin] = total[p];
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
