#pragma once

#include <utility>

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace gradpsi {

// The vector code is compiled several times, for W = 2 (any x86-64), 4 (AVX2) and 8 (AVX-512) doubles an
// instruction, each time into functions of its own, all of them templates over W. Files compiled so
// include nothing that defines other functions: the linker would take one copy of those for everyone.

template <int W>
struct LanesOf {
  typedef double Type __attribute__((vector_size(W * sizeof(double))));
};

/// W doubles that are worked on together.
template <int W>
using Lanes = typename LanesOf<W>::Type;

template <int W>
[[gnu::always_inline]] inline Lanes<W> load(const double* from) {
  Lanes<W> v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

template <class V>
[[gnu::always_inline]] inline void store(double* to, V v) {
  __builtin_memcpy(to, &v, sizeof v);
}

/// The first `count` lanes, all of them if that is more.
template <class V>
[[gnu::always_inline]] inline void store_first(double* to, V v, int count) {
  constexpr int lanes = sizeof(V) / sizeof(double);
  if (count >= lanes) return store(to, v);
#if defined(__AVX512F__)
  if constexpr (lanes == 8)
    return _mm512_mask_storeu_pd(to, static_cast<__mmask8>((1 << count) - 1), (__m512d)v);
#endif
  for (int l = 0; l < count; ++l) to[l] = v[l];
}

/// All lanes x; x - 0, as x + 0 would turn -0 into 0.
template <int W>
[[gnu::always_inline]] inline Lanes<W> all(double x) {
  return x - Lanes<W>{};
}

/// x as it is in memory: it does not become part of a multiplication and addition in one step, so that which
/// of two products is rounded is not the compiler's choice.
template <class V>
[[gnu::always_inline]] inline V as_rounded(V x) {
#if defined(__x86_64__)
  asm("" : "+v"(x));
#endif
  return x;
}

/// x rounded to the nearest whole number, for |x| < 2^51.
template <class V>
[[gnu::always_inline]] inline V rounded(V x) {
  constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52
  return (x + shift) - shift;
}

[[gnu::always_inline]] inline double square_root(double x) { return __builtin_sqrt(x); }

template <class V>
[[gnu::always_inline]] inline V square_root(V v) {
  constexpr int lanes = sizeof(V) / sizeof(double);
#if defined(__AVX512F__)
  if constexpr (lanes == 8) return (V)_mm512_sqrt_pd((__m512d)v);
#elif defined(__AVX__)
  if constexpr (lanes == 4) return (V)_mm256_sqrt_pd((__m256d)v);
#endif
  for (int l = 0; l < lanes; ++l) v[l] = __builtin_sqrt(v[l]);
  return v;
}

template <class V>
[[gnu::always_inline]] inline double sum_of_lanes(V v) {
  constexpr int lanes = sizeof(V) / sizeof(double);
  if constexpr (lanes == 2)
    return v[0] + v[1];
  else if constexpr (lanes == 4)
    return sum_of_lanes(__builtin_shufflevector(v, v, 0, 1) + __builtin_shufflevector(v, v, 2, 3));
  else
    return sum_of_lanes(__builtin_shufflevector(v, v, 0, 1, 2, 3) +
                        __builtin_shufflevector(v, v, 4, 5, 6, 7));
}

/// Lane l of the result is, in lanes whose bit `stride` is not set, a[l] + a[l + stride], in the others
/// b[l - stride] + b[l].
template <int W, int stride, int... l>
[[gnu::always_inline]] inline Lanes<W> fold(Lanes<W> a, Lanes<W> b,
                                            std::integer_sequence<int, l...>) {
  return __builtin_shufflevector(a, b, ((l & stride ? W : 0) + (l & ~stride))...) +
         __builtin_shufflevector(a, b, ((l & stride ? W : 0) + (l | stride))...);
}
template <int W, int stride>
[[gnu::always_inline]] inline Lanes<W> fold(Lanes<W> a, Lanes<W> b) {
  return fold<W, stride>(a, b, std::make_integer_sequence<int, W>());
}

/// Lane r of the result is the sum of the lanes of v[r * step], r < W.
template <int W>
[[gnu::always_inline]] inline Lanes<W> sums(const Lanes<W>* v, int step) {
  if constexpr (W == 2) {
    return fold<2, 1>(v[0], v[step]);
  } else if constexpr (W == 4) {
    return fold<4, 2>(fold<4, 1>(v[0], v[step]), fold<4, 1>(v[2 * step], v[3 * step]));
  } else {
    static_assert(W == 8);
    return fold<8, 4>(
        fold<8, 2>(fold<8, 1>(v[0], v[step]), fold<8, 1>(v[2 * step], v[3 * step])),
        fold<8, 2>(fold<8, 1>(v[4 * step], v[5 * step]), fold<8, 1>(v[6 * step], v[7 * step])));
  }
}

}  // namespace gradpsi
