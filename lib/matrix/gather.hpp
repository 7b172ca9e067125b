#pragma once

#include "base/lanes.hpp"

namespace gradpsi {

// What vector code over the entries of rows is made of.

/// x at W columns. Processors that are better at single loads than at gathers get W = 4; see base/cpu.cpp.
template <int W>
[[gnu::always_inline]] inline Lanes<W> gather(const double* x, const int* column) {
#if defined(__AVX512F__)
  if constexpr (W == 8)
    return (Lanes<W>)_mm512_i32gather_pd(_mm256_loadu_si256((const __m256i*)column), x, 8);
  else
#endif
      if constexpr (W == 4)
    return Lanes<W>{x[column[0]], x[column[1]], x[column[2]], x[column[3]]};
  else
    return Lanes<W>{x[column[0]], x[column[1]]};
}

template <int W>
using Mask = decltype(Lanes<W>{} < Lanes<W>{});

/// All lanes before `count`, which may be any number.
template <int W>
[[gnu::always_inline]] inline Mask<W> first_lanes(int count) {
  Mask<W> lane;
  for (int l = 0; l < W; ++l) lane[l] = l;
  return lane < count;
}

/// v in these lanes, 0 in the others, whatever is there.
template <int W>
[[gnu::always_inline]] inline Lanes<W> only(Mask<W> lanes, Lanes<W> v) {
  return lanes ? v : Lanes<W>{};
}

}  // namespace gradpsi
