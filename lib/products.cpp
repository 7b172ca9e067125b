// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "products.hpp"

#include "lanes.hpp"

#if GRADPSI_LANES > 2
#include <immintrin.h>
#endif

namespace gradpsi {
namespace {

constexpr int W = GRADPSI_LANES;
using V = Lanes<W>;

// x at W columns, W values, and the same for the first `count` < W of them, the others being 0.
#if GRADPSI_LANES == 8

[[gnu::always_inline]] inline V gather(const double* x, const int* column) {
  return (V)_mm512_i32gather_pd(_mm256_loadu_si256((const __m256i*)column), x, 8);
}
[[gnu::always_inline]] inline V gather(const double* x, const int* column, int count) {
  const __mmask8 first = (1 << count) - 1;
  return (V)_mm512_mask_i32gather_pd(_mm512_setzero_pd(), first,
                                     _mm256_maskz_loadu_epi32(first, column), x, 8);
}
[[gnu::always_inline]] inline V values(const double* a) { return load<W>(a); }
[[gnu::always_inline]] inline V values(const double* a, int count) {
  return (V)_mm512_maskz_loadu_pd((1 << count) - 1, a);
}
[[gnu::always_inline]] inline V values(const float* a) {
  return (V)_mm512_cvtps_pd(_mm256_loadu_ps(a));
}
[[gnu::always_inline]] inline V values(const float* a, int count) {
  return (V)_mm512_cvtps_pd(_mm256_maskz_loadu_ps((1 << count) - 1, a));
}

#else

[[gnu::always_inline]] inline V gather(const double* x, const int* column) {
#if GRADPSI_LANES == 4
  return (V)_mm256_i32gather_pd(x, _mm_loadu_si128((const __m128i*)column), 8);
#else
  return V{x[column[0]], x[column[1]]};
#endif
}
[[gnu::always_inline]] inline V gather(const double* x, const int* column, int count) {
  V v{};
  for (int l = 0; l < count; ++l) v[l] = x[column[l]];
  return v;
}
template <class Value>
[[gnu::always_inline]] inline V values(const Value* a) {
  V v;
  for (int l = 0; l < W; ++l) v[l] = a[l];
  return v;
}
template <class Value>
[[gnu::always_inline]] inline V values(const Value* a, int count) {
  V v{};
  for (int l = 0; l < count; ++l) v[l] = a[l];
  return v;
}

#endif

/// Two sums for one product, so that additions need not wait for one another.
template <int matrices, int vectors, class Value>
void product(const ProductArguments<Value>& arguments, int begin, int end) {
  constexpr int products = matrices * vectors, sums = products == 1 ? 2 : 1;
  const int* const inner = arguments.inner;
  for (int i = begin; i < end; ++i) {
    V sum[products][sums] = {};
    int k = arguments.outer[i];
    const int stop = arguments.outer[i + 1];
    for (; k + sums * W <= stop; k += sums * W)
      for (int s = 0; s < sums; ++s) {
        V a[matrices];
        for (int m = 0; m < matrices; ++m) a[m] = values(arguments.values[m] + k + s * W);
        for (int v = 0; v < vectors; ++v) {
          const V x = gather(arguments.x[v], inner + k + s * W);
          for (int m = 0; m < matrices; ++m) sum[m * vectors + v][s] += a[m] * x;
        }
      }
    if (sums == 2 && k + W <= stop) {
      sum[0][0] += values(arguments.values[0] + k) * gather(arguments.x[0], inner + k);
      k += W;
    }
    if (k < stop) {
      const int count = stop - k;
      for (int v = 0; v < vectors; ++v) {
        const V x = gather(arguments.x[v], inner + k, count);
        for (int m = 0; m < matrices; ++m)
          sum[m * vectors + v][sums - 1] += values(arguments.values[m] + k, count) * x;
      }
    }
    for (int p = 0; p < products; ++p)
      arguments.y[p][i - begin] =
          sum_of_lanes(sums == 2 ? sum[p][0] + sum[p][sums - 1] : sum[p][0]);
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
