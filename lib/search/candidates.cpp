// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "search/candidates.hpp"

#include "base/lanes.hpp"

namespace gradpsi {
namespace {

using V = Lanes<GRADPSI_LANES>;
using Mask = decltype(V{} < V{});
constexpr int W = GRADPSI_LANES;

// Kept<W>: which lanes to keep. Each packs doubles or ints to the front and says how many there are.
#if GRADPSI_LANES == 8

struct Kept {
  explicit Kept(Mask which) : bits(_mm512_movepi64_mask((__m512i)which)) {}
  int count() const { return __builtin_popcount(bits); }
  void pack(V from, double* to) const {
    store(to, (V)_mm512_maskz_compress_pd(bits, (__m512d)from));
  }
  void pack(const int* from, int* to) const {
    const __m256i all = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_maskz_compress_epi32(bits, all));
  }
  __mmask8 bits;
};

#elif GRADPSI_LANES == 4

/// For each set of lanes, where the ints of the packed doubles come from.
struct PackingTable {
  alignas(32) int of_doubles[16][8];
  alignas(16) signed char of_ints[16][16];
  constexpr PackingTable() : of_doubles{}, of_ints{} {
    for (int bits = 0; bits < 16; ++bits) {
      int to = 0;
      for (int lane = 0; lane < 4; ++lane) {
        if (!(bits >> lane & 1)) continue;
        for (int half = 0; half < 2; ++half) of_doubles[bits][2 * to + half] = 2 * lane + half;
        for (int byte = 0; byte < 4; ++byte)
          of_ints[bits][4 * to + byte] = static_cast<signed char>(4 * lane + byte);
        ++to;
      }
    }
  }
};
constexpr PackingTable packing;

struct Kept {
  explicit Kept(Mask which) : bits(_mm256_movemask_pd((__m256d)which)) {}
  int count() const { return __builtin_popcount(bits); }
  void pack(V from, double* to) const {
    const __m256i lanes =
        _mm256_load_si256(reinterpret_cast<const __m256i*>(packing.of_doubles[bits]));
    store(to, (V)_mm256_permutevar8x32_epi32((__m256i)from, lanes));
  }
  void pack(const int* from, int* to) const {
    const __m128i all = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
    const __m128i bytes = _mm_load_si128(reinterpret_cast<const __m128i*>(packing.of_ints[bits]));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm_shuffle_epi8(all, bytes));
  }
  int bits;
};

#else

struct Kept {
  explicit Kept(Mask which) : which(which) {}
  int count() const {
    int sum = 0;
    for (int l = 0; l < W; ++l) sum -= static_cast<int>(which[l]);
    return sum;
  }
  template <class From, class To>
  void pack(const From& from, To* to) const {
    for (int l = 0; l < W; ++l) {
      *to = from[l];
      to -= which[l];
    }
  }
  Mask which;
};

#endif

/// All lanes before `count`.
[[gnu::always_inline]] inline Mask first_lanes(int count) {
  Mask which;
  for (int l = 0; l < W; ++l) which[l] = l < count ? -1 : 0;
  return which;
}

template <int D>
int filter(const double* const* x, const int* number, int begin, int end, const double* low,
           const double* high, const double* shift, double* const* to_x, int* to_number) {
  int count = 0;
  for (int k = begin; k < end; k += W) {
    Mask inside = end - k < W ? first_lanes(end - k) : ~Mask{};
    for (int a = 0; a < D; ++a) {
      const V c = load<W>(x[a] + k);
      inside = inside & (c >= low[a]) & (c <= high[a]);
    }
    const Kept kept(inside);
    for (int a = 0; a < D; ++a) kept.pack(load<W>(x[a] + k) + shift[a], to_x[a] + count);
    kept.pack(number + k, to_number + count);
    count += kept.count();
  }
  return count;
}

template <int D>
[[gnu::always_inline]] inline V squared_distances(const double* const* x, int k,
                                                  const double* centre) {
  V squared{};
  for (int a = 0; a < D; ++a) {
    const V r = load<W>(x[a] + k) - centre[a];
    squared += r * r;
  }
  return squared;
}

template <int D>
int select(const double* const* x, const int* number, int count, const double* centre,
           double squared_support, int* found, int* coincident) {
  int size = 0, zeros = 0;
  for (int k = 0; k < count; k += W) {
    const V squared = squared_distances<D>(x, k, centre);
    const Kept near((squared < squared_support) & (squared > 0));
    near.pack(number + k, found + size);
    size += near.count();
    zeros += Kept(squared == 0).count();
  }
  *coincident += zeros;
  return size;
}

template <int D>
double nearest(const double* const* x, const int* number, int count, const double* centre,
               int self) {
  double least = __builtin_inf();
  for (int k = 0; k < count; k += W) {
    const V squared = squared_distances<D>(x, k, centre);
    for (int l = 0; l < W && k + l < count; ++l)
      if (number[k + l] != self && squared[l] < least) least = squared[l];
  }
  return least;
}

/// By how many are below each of them, which has no branches to mispredict.
double ranked(const double* values, int count, int rank) {
  for (int i = 0; i < count; ++i) {
    int below = 0, up_to = 0;
    for (int k = 0; k < count; k += W) {
      const V v = load<W>(values + k);
      below += Kept(v < values[i]).count();
      up_to += Kept(v <= values[i]).count();
    }
    if (below < rank && rank <= up_to) return values[i];
  }
  return __builtin_inf();
}

}  // namespace

template <>
CandidateKernels candidate_kernels<GRADPSI_LANES>() {
  return {{filter<1>, filter<2>, filter<3>},
          {select<1>, select<2>, select<3>},
          {nearest<1>, nearest<2>, nearest<3>},
          ranked};
}

}  // namespace gradpsi
