#include "kernels.hpp"

#include <cmath>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#include <immintrin.h>
#define FOR_EACH_INSTRUCTION_SET \
  [[gnu::target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")]]
#define HAS_GATHER
#else
#define FOR_EACH_INSTRUCTION_SET
#endif

namespace {

// Eight doubles, wherever they start.
typedef double Eight __attribute__((vector_size(64), aligned(8)));

template <int D>
[[gnu::always_inline]] inline void laplacian_rows(const OnTheFly& p, int begin, int end,
                                                  const double* u, double* result) {
  for (int i = begin; i < end; ++i) {
    double own[D];
    for (int a = 0; a < D; ++a) own[a] = p.x[a][i];
    const double ui = u[i], per_support = 1 / p.support;
    double total = 0;
#pragma omp simd reduction(+ : total)
    for (int k = p.offsets[i]; k < p.offsets[i + 1]; ++k) {
      const int j = p.indices[k];
      double squared = 0;
      for (int a = 0; a < D; ++a) squared += (p.x[a][j] - own[a]) * (p.x[a][j] - own[a]);
      const double t = 1 - std::sqrt(squared) * per_support;
      total += p.volumes[j] * t * t * t * (u[j] - ui);
    }
    result[i] = p.factor * total;
  }
}

FOR_EACH_INSTRUCTION_SET
void sell_plain(const SellArrays& A, int first, int last, const double* x, double* y) {
  constexpr int lanes = SellArrays::lanes;
  for (int s = first; s < last; ++s) {
    double sums[lanes] = {};
    for (int k = A.begin[s]; k < A.begin[s + 1]; k += lanes)
      for (int l = 0; l < lanes; ++l) sums[l] += A.values[k + l] * x[A.columns[k + l]];
    for (int l = 0; l < lanes; ++l)
      if (A.row[s * lanes + l] >= 0) y[A.row[s * lanes + l]] = sums[l];
  }
}

#if defined(HAS_GATHER)
[[gnu::target("avx512f,avx512vl")]] void sell_gather(const SellArrays& A, int first, int last,
                                                     const double* x, double* y) {
  for (int s = first; s < last; ++s) {
    __m512d total = _mm512_setzero_pd();
    for (int k = A.begin[s]; k < A.begin[s + 1]; k += 8) {
      const __m256i column = _mm256_loadu_si256((const __m256i*)(A.columns + k));
      const __m512d xs = _mm512_mask_i32gather_pd(_mm512_setzero_pd(), __mmask8(255), column, x, 8);
      total = _mm512_fmadd_pd(_mm512_loadu_pd(A.values + k), xs, total);
    }
    const __m256i row = _mm256_loadu_si256((const __m256i*)(A.row + s * 8));
    const __mmask8 real = _mm256_cmpge_epi32_mask(row, _mm256_setzero_si256());
    _mm512_mask_i32scatter_pd(y, real, row, total, 8);
  }
}
#endif

}  // namespace

FOR_EACH_INSTRUCTION_SET
double sum(const double* a, long n) {
  // Independent sums, so that no addition waits for the one before.
  Eight sums[4] = {};
  long k = 0;
  for (; k + 32 <= n; k += 32)
    for (int s = 0; s < 4; ++s) sums[s] += *(const Eight*)(a + k + 8 * s);
  const Eight together = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  double total = 0;
  for (int l = 0; l < 8; ++l) total += together[l];
  for (; k < n; ++k) total += a[k];
  return total;
}

FOR_EACH_INSTRUCTION_SET
void triad(const double* b, const double* c, double s, double* a, long n) {
#pragma omp simd
  for (long k = 0; k < n; ++k) a[k] = b[k] + s * c[k];
}

void sell_product(const SellArrays& A, int first, int last, const double* x, double* y) {
#if defined(HAS_GATHER)
  // As the library: elsewhere gathers are slower than single loads.
  static const bool gathers = __builtin_cpu_is("intel") && __builtin_cpu_supports("avx512f") &&
                              __builtin_cpu_supports("avx512vl");
  if (gathers) return sell_gather(A, first, last, x, y);
#endif
  sell_plain(A, first, last, x, y);
}

FOR_EACH_INSTRUCTION_SET
void laplacian(const OnTheFly& points, int begin, int end, const double* u, double* result) {
  if (points.dimension == 1) return laplacian_rows<1>(points, begin, end, u, result);
  if (points.dimension == 2) return laplacian_rows<2>(points, begin, end, u, result);
  laplacian_rows<3>(points, begin, end, u, result);
}
