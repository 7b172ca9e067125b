#pragma once

// Vector code; see lanes.hpp.

#include "operators/batch/batch.hpp"
#include "operators/inverse.hpp"

namespace gradpsi {

template <class V, int M>
struct LaneMatrix {
  V a[M][M];
  [[gnu::always_inline]] V& operator()(int i, int j) { return a[i][j]; }
  [[gnu::always_inline]] const V& operator()(int i, int j) const { return a[i][j]; }
};

template <class V>
[[gnu::always_inline]] inline V least(V a, V b) {
  return b < a ? b : a;
}

/// Inverts the matrices of W rows, in place. Gives their reciprocal condition numbers and whether they
/// are good enough.
template <int M, Form form, class V>
[[gnu::always_inline]] inline auto invert(const BatchSystem& system, LaneMatrix<V, M>& A,
                                          V& reciprocal) {
  const V norm = one_norm<M>(A);
  if constexpr (form != Form::Monomials) {
    const auto sound = invert_general<M>(A);
    reciprocal = least(1 / (norm * one_norm<M>(A)), V{} + 1);
    return sound & (reciprocal >= system.limit);
  } else {
    V scale[M];
    for (int k = 0; k < M; ++k) scale[k] = 1 / square_root(A(k, k));
    for (int k = 0; k < M; ++k)
      for (int l = 0; l < M; ++l) A(k, l) *= scale[k] * scale[l];
    const V scaled_norm = one_norm<M>(A);
    const auto sound = invert_definite<M>(A);
    const V scaled = 1 / (scaled_norm * one_norm<M>(A));
    for (int k = 0; k < M; ++k)
      for (int l = 0; l < M; ++l) A(k, l) *= scale[k] * scale[l];
    reciprocal = least(1 / (norm * one_norm<M>(A)), V{} + 1);
    return sound & (reciprocal >= system.limit) & (scaled >= system.scaled_limit);
  }
}

}  // namespace gradpsi
