#pragma once

// Vector code; see lanes.hpp.

#include "base/lanes.hpp"
#include "operators/batch/batch.hpp"

namespace gradpsi {

template <int W, class... K>
[[gnu::always_inline]] inline ProfileOf<Lanes<W>> profile(KernelList<K...>, int kernel,
                                                          Lanes<W> q) {
  ProfileOf<Lanes<W>> result;
  int k = 0;
  static_cast<void>(((kernel == k++ && (result = K::profile(q), true)) || ...));
  return result;
}

template <int W>
[[gnu::always_inline]] inline ProfileOf<Lanes<W>> profile(const BatchPoints& points, Lanes<W> q) {
  if (points.kernel >= 0) return profile<W>(VectorKernels(), points.kernel, q);
  double w[W], dw_over_q[W], d2w[W];
  for (int l = 0; l < W; ++l) {
    const Profile one = points.profile(q[l]);
    w[l] = one.w;
    dw_over_q[l] = one.dw_over_q;
    d2w[l] = one.d2w;
  }
  return {load<W>(w), load<W>(dw_over_q), load<W>(d2w)};
}

}  // namespace gradpsi
