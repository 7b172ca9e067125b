#pragma once

// Vector code; see lanes.hpp.

#include "base/lanes.hpp"
#include "operators/batch/batch.hpp"
#include "operators/batch/profiles.hpp"
#include "operators/inverse.hpp"
#include "schemes/monomials.hpp"

namespace gradpsi {

/// Where the rows of a batch go.
template <int W>
struct Batch {
  int rows;
  int first;     // of the call's rows
  int row[W];    // k
  int entry[W];  // outer[k]
  Profile own;   // the kernel's at q = 0
};

/// A row's neighbours and itself, W at a time, as structure of arrays. Entries without a neighbour, the
/// row's own point and those that fill up the last vector, are at q = 1 with volume 0.
template <int D>
struct Entries {
  int count, padded, diagonal;
  int neighbours;  // within the support
  double h;
  double *s[D], *q, *volume, own_volume;  // as in Row
  // omega_j phi, that / q^2, unused; of kernel derivatives -omega w'/q, omega (w'' - w'/q) / q^2, omega w
  double *weight, *over, *kernel;
};

constexpr int round_up(int n, int W) { return (n + W - 1) / W * W; }

/// Copies a row's neighbours together, r_ij into s and omega_j into the volume.
template <int D>
[[gnu::always_inline]] inline void gather(const BatchPoints& points, const int* columns, int i,
                                          Entries<D>& row) {
  const double* const x = points.x;
  double own[D];
  for (int a = 0; a < D; ++a) own[a] = x[static_cast<long>(i) * D + a];
  int before = 0;
  for (int k = 0; k < row.count; ++k) {
    const long j = columns[k];
    for (int a = 0; a < D; ++a) row.s[a][k] = x[j * D + a] - own[a];
    row.volume[k] = points.volumes[j];
    before += columns[k] < i;
  }
  row.diagonal = before;
  row.h = points.supports[points.one_support ? 0 : i];
  row.own_volume = points.volumes[i];
  const auto is_nobody = [&](int k) __attribute__((always_inline)) {
    row.s[0][k] = row.h;
    for (int a = 1; a < D; ++a) row.s[a][k] = 0;
    row.volume[k] = 0;
  };
  is_nobody(row.diagonal);
  for (int k = row.count; k < row.padded; ++k) is_nobody(k);
}

/// To units of h, as Row has them.
template <int D, int W>
[[gnu::always_inline]] inline void scale(const BatchPoints& points, Entries<D>& row) {
  using V = Lanes<W>;
  const double per_h = 1 / row.h;
  for (int a = 0; a < D; ++a) row.own_volume *= per_h;
  row.own_volume *= points.normalisation;
  for (int k = 0; k < row.padded; k += W) {
    V squared{};
    V volume = load<W>(row.volume + k);
    for (int a = 0; a < D; ++a) {
      V r = load<W>(row.s[a] + k);
      if (points.box[a] > 0) r -= points.box[a] * rounded(r / points.box[a]);
      r *= per_h;
      store(row.s[a] + k, r);
      squared += r * r;
      volume *= per_h;  // one h at a time: 1 / h^d may be beyond a double where omega / h^d is not
    }
    const V q = square_root(squared);
    store(row.q + k, q < 1 ? q : all<W>(1));  // rounding can lift a neighbour past the support
    store(row.volume + k, volume * points.normalisation);
  }
}

template <int D, int W>
[[gnu::always_inline]] inline void weigh(const BatchPoints& points, const BatchSystem& system,
                                         Entries<D>& row) {
  using V = Lanes<W>;
  const Phi& c = system.phi;
  const bool divides = c.w_over_q != 0 || c.w_over_q2 != 0;
  for (int k = 0; k < row.padded; k += W) {
    const V q = load<W>(row.q + k);
    const auto p = profile<W>(points, q);
    if (system.form == Form::KernelDerivatives) {
      const V volume = load<W>(row.volume + k);
      store(row.weight + k, -volume * p.dw_over_q);
      store(row.over + k, volume * (p.d2w - p.dw_over_q) / (q * q));
      store(row.kernel + k, volume * p.w);
      continue;
    }
    V phi = c.w * p.w + c.dw_over_q * p.dw_over_q + c.d2w * p.d2w;
    if (divides) {
      const V per_q = 1 / q;
      phi += p.w * per_q * (c.w_over_q + c.w_over_q2 * per_q);
    }
    if (c.damping != 0) phi *= q * q / (q * q + c.damping);
    if (system.how == How::LeastSquares) phi = magnitude(phi);
    const V weight = phi * load<W>(row.volume + k);
    store(row.weight + k, weight);
    if (system.form == Form::Directions) store(row.over + k, weight / (q * q));
  }
}

/// The monomials of degree 1 to P at entries k to k + W.
template <int D, int P, int W>
[[gnu::always_inline]] inline void monomials(const Entries<D>& row, int k, Lanes<W>* m) {
  constexpr const auto& table = monomial_table<D, P>;
  for (int a = 0; a < D; ++a) m[a] = load<W>(row.s[a] + k);
#pragma GCC unroll 40
  for (int c = D; c < table.size; ++c) m[c] = m[table.factor[c]] * m[table.rest[c]];
}

/// Columns of memory, each as long as the longest row.
struct Workspace {
  double* memory;
  long room;
  double* column(int c) const { return memory + c * room; }
};

}  // namespace gradpsi
