// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "operators/batch/batch.hpp"

#include "operators/inverse.hpp"
#include "schemes/monomials.hpp"

namespace gradpsi {
namespace {

/// A row's neighbours and itself, W at a time, as structure of arrays. Entries without a neighbour, the
/// row's own point and those that fill up the last vector, are at q = 1 with volume 0.
template <int D>
struct Entries {
  int count, padded, diagonal;
  double h;
  double *s[D], *q, *volume;  // as in Row
  double *weight, *over;      // omega_j phi, that / q^2
};

constexpr int round_up(int n, int W) { return (n + W - 1) / W * W; }

/// x rounded to the nearest whole number, for |x| < 2^51.
template <class V>
[[gnu::always_inline]] inline V rounded(V x) {
  constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52
  return (x + shift) - shift;
}

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

template <int W>
[[gnu::always_inline]] inline ProfileOf<Lanes<W>> profile(const BatchPoints& points, Lanes<W> q) {
  switch (points.shape) {
    case Shape::WendlandC2: return wendland_c2(q);
    case Shape::WendlandC4: return wendland_c4(q);
    case Shape::WendlandC6: return wendland_c6(q);
    case Shape::CubicSpline: return cubic_spline(q);
    case Shape::QuinticSpline: return quintic_spline(q);
    case Shape::Other: break;
  }
  double w[W], dw_over_q[W], d2w[W];
  for (int l = 0; l < W; ++l) {
    const Profile one = points.profile(q[l]);
    w[l] = one.w;
    dw_over_q[l] = one.dw_over_q;
    d2w[l] = one.d2w;
  }
  return {load<W>(w), load<W>(dw_over_q), load<W>(d2w)};
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
    V phi = c.w * p.w + c.dw_over_q * p.dw_over_q + c.d2w * p.d2w;
    if (divides) {
      const V per_q = 1 / q;
      phi += p.w * per_q * (c.w_over_q + c.w_over_q2 * per_q);
    }
    if (system.least_squares) phi = magnitude(phi);
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

/// Adds weight times the monomials of degree Low to High to `sum`, which has one place for each.
template <int D, int Low, int High, int W>
[[gnu::always_inline]] inline void accumulate(const Entries<D>& row, const double* weight,
                                              Lanes<W>* sum) {
  using V = Lanes<W>;
  constexpr int first = monomial_count<D, Low - 1>, size = monomial_count<D, High>;
  V total[size - first] = {};
  for (int k = 0; k < row.padded; k += W) {
    V m[size];
    monomials<D, High, W>(row, k, m);
    const V w = load<W>(weight + k);
#pragma GCC unroll 40
    for (int c = first; c < size; ++c) total[c - first] += w * m[c];
  }
#pragma GCC unroll 40
  for (int c = first; c < size; ++c) sum[c - first] = total[c - first];
}

template <class V, int M>
struct LaneMatrix {
  V a[M][M];
  [[gnu::always_inline]] V& operator()(int i, int j) { return a[i][j]; }
  [[gnu::always_inline]] const V& operator()(int i, int j) const { return a[i][j]; }
};

/// The moments that a form's matrix is made of: with `weight` degrees 2 to high, with `over` from 3 to 4.
template <int D, Form form>
struct Moments {
  static constexpr int P = form == Form::Linear ? 1 : 2;
  static constexpr int M = monomial_count<D, P>;
  static constexpr int high = form == Form::Linear ? 2 : form == Form::Quadratic ? 4 : 3;
  static constexpr int plain = monomial_count<D, high> - D;
  static constexpr int over =
      form == Form::Directions ? monomial_count<D, 4> - monomial_count<D, 2> : 0;
  static constexpr int count = plain + over;

  template <int W>
  [[gnu::always_inline]] static void gather(const Entries<D>& row, Lanes<W>* sums) {
    if constexpr (high == 4 && D == 3) {  // all at once would not fit the registers
      accumulate<D, 2, 3, W>(row, row.weight, sums);
      accumulate<D, 4, 4, W>(row, row.weight, sums + monomial_count<D, 3> - D);
    } else {
      accumulate<D, 2, high, W>(row, row.weight, sums);
    }
    if constexpr (over > 0) accumulate<D, 3, 4, W>(row, row.over, sums + plain);
  }

  template <class V>
  [[gnu::always_inline]] static void fill(const V* moment, LaneMatrix<V, M>& A) {
    constexpr const auto& table = monomial_table<D, 4>;
    constexpr auto index = [] {
      struct {
        int at[M][M];
      } result{};
      for (int k = 0; k < M; ++k)
        for (int l = 0; l < M; ++l)
          result.at[k][l] = form == Form::Directions && l >= D
                                ? plain + table.product(k, l) - monomial_count<D, 2>
                                : table.product(k, l) - D;
      return result;
    }();
    for (int k = 0; k < M; ++k)
      for (int l = 0; l < M; ++l) A(k, l) = moment[index.at[k][l]];
  }
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
  if constexpr (form == Form::Directions) {
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
    return sound & ((system.least_squares ? scaled : reciprocal) >= system.limit);
  }
}

/// Writes one row of up to D + 1 matrices, c[o] . t(s_j) weighted, and the diagonals.
/// Returns whether all is finite.
template <int D, Form form, int outputs, int W>
[[gnu::always_inline]] inline bool emit(const Entries<D>& row, const double (*c)[9],
                                        double* const* value) {
  using V = Lanes<W>;
  constexpr int M = form == Form::Zoc ? D : Moments<D, form>::M;
  V sum[outputs] = {};
  for (int k = 0; k < row.padded; k += W) {
    V t[M];
    monomials<D, M == D ? 1 : 2, W>(row, k, t);
    const V w = load<W>(row.weight + k);
    for (int l = 0; l < M; ++l)
      t[l] *= form == Form::Directions && l >= D ? load<W>(row.over + k) : w;
#pragma GCC unroll 4
    for (int o = 0; o < outputs; ++o) {
      V a = c[o][0] * t[0];
#pragma GCC unroll 9
      for (int l = 1; l < M; ++l) a += c[o][l] * t[l];
      sum[o] += a;
      if (k + W <= row.count)
        store(value[o] + k, a);
      else
        for (int l = 0; k + l < row.count; ++l) value[o][k + l] = a[l];
    }
  }
  double check = 0;
  for (int o = 0; o < outputs; ++o) {
    const double total = sum_of_lanes(sum[o]);
    value[o][row.diagonal] = 0 - total;
    check += total - total;
  }
  return check == 0;
}

/// The uncorrected Laplacian is phi itself.
template <int D, int W>
[[gnu::always_inline]] inline bool emit_weights(const Entries<D>& row, double factor,
                                                double* value) {
  using V = Lanes<W>;
  V sum{};
  for (int k = 0; k < row.padded; k += W) {
    const V a = factor * load<W>(row.weight + k);
    sum += a;
    if (k + W <= row.count)
      store(value + k, a);
    else
      for (int l = 0; k + l < row.count; ++l) value[k + l] = a[l];
  }
  const double total = sum_of_lanes(sum);
  value[row.diagonal] = 0 - total;
  return total - total == 0;
}

/// Where the rows of a batch go.
template <int W>
struct Batch {
  int rows;
  int first;     // of the call's rows
  int row[W];    // k
  int entry[W];  // outer[k]
};

template <int D, int W>
[[gnu::always_inline]] inline void uncorrected(const BatchSystem& system, const Batch<W>& batch,
                                               const Entries<D>* row) {
  for (int r = 0; r < batch.rows; ++r) {
    const int entry = batch.entry[r], k = batch.row[r];
    double factor = 1;
    for (int n = 0; n > system.zoc_power; --n) factor /= row[r].h;
    bool finite;
    if (system.laplacian) {
      finite = emit_weights<D, W>(row[r], factor, system.laplacian + entry);
    } else {
      double c[D][9] = {};
      double* value[D];
      for (int a = 0; a < D; ++a) c[a][a] = factor, value[a] = system.gradient[a] + entry;
      finite = emit<D, Form::Zoc, D, W>(row[r], c, value);
    }
    system.solved[batch.first + r] = finite && row[r].count > 1;
    system.reciprocal_condition[k] = 1;
  }
}

template <int D, Form form, int W>
[[gnu::always_inline]] inline void corrected(const BatchSystem& system, const Batch<W>& batch,
                                             const Entries<D>* row) {
  using V = Lanes<W>;
  using System = Moments<D, form>;
  constexpr int M = System::M;
  V partial[W][System::count];
  for (int r = 0; r < batch.rows; ++r) System::template gather<W>(row[r], partial[r]);
  for (int r = batch.rows; r < W; ++r)
    for (int c = 0; c < System::count; ++c) partial[r][c] = V{};
  V moment[System::count];
  for (int c = 0; c < System::count; ++c) moment[c] = sums<W>(&partial[0][c], System::count);
  LaneMatrix<V, M> A;
  System::fill(moment, A);
  V reciprocal;
  const auto good = invert<M, form>(system, A, reciprocal);

  V h = V{} + 1;
  for (int r = 0; r < batch.rows; ++r) h[r] = row[r].h;
  const int axes = system.gradient[0] ? D : 0;
  V c[D + 1][9];
  for (int o = 0; o < axes; ++o)
    for (int l = 0; l < M; ++l) c[o][l] = A(l, o) / h;
  if constexpr (M > D)
    for (int l = 0; l < M; ++l) {
      V trace{};
      for (int a = 0; a < D; ++a) trace += A(l, D + a * D - a * (a - 1) / 2);
      c[axes][l] = 2 * trace / (h * h);
    }
  for (int r = 0; r < batch.rows; ++r) {
    const int k = batch.row[r];
    double own[D + 1][9];
    double* value[D + 1];
    for (int o = 0; o < axes; ++o) value[o] = system.gradient[o] + batch.entry[r];
    if (system.laplacian) value[axes] = system.laplacian + batch.entry[r];
    const int outputs = axes + (system.laplacian ? 1 : 0);
    for (int o = 0; o < outputs; ++o)
      for (int l = 0; l < M; ++l) own[o][l] = c[o][l][r];
    // With fewer neighbours than unknowns the matrix is singular, rounding or not.
    bool solved = good[r] && row[r].count > M;
    if (solved)
      solved = outputs == 1   ? emit<D, form, 1, W>(row[r], own, value)
               : outputs == D ? emit<D, form, D, W>(row[r], own, value)
                              : emit<D, form, D + 1, W>(row[r], own, value);
    system.solved[batch.first + r] = solved;
    system.reciprocal_condition[k] = reciprocal[r];
  }
}

/// Columns of memory, each as long as the longest row.
struct Workspace {
  double* memory;
  long room;
  double* column(int c) const { return memory + c * room; }
};

/// The products of two monomials up to degree P in D dimensions: which of the moments each is, and a pair of
/// factors of each.
template <int D, int P>
struct ProductTable {
  static constexpr int M = monomial_count<D, P>, count = monomial_count<D, 2 * P> - D;
  int moment[M][M] = {}, first[count] = {}, second[count] = {};
  constexpr ProductTable() {
    for (int k = 0; k < M; ++k)
      for (int l = 0; l <= k; ++l) {
        const int m = monomial_table<D, 2 * P>.product(k, l) - D;
        moment[k][l] = moment[l][k] = m;
        first[m] = k, second[m] = l;
      }
  }
};

/// The monomials up to degree P in the first columns and, with the weights, in as many behind them.
template <int D, int P, int W>
void fill_monomials(const Entries<D>& row, const Workspace& work, bool weighted) {
  using V = Lanes<W>;
  constexpr const auto& table = monomial_table<D, P>;
  for (int k = 0; k < row.padded; k += W) {
    for (int a = 0; a < D; ++a) store(work.column(a) + k, load<W>(row.s[a] + k));
    for (int c = D; c < table.size; ++c)
      store(work.column(c) + k,
            load<W>(row.s[table.factor[c]] + k) * load<W>(work.column(table.rest[c]) + k));
    if (!weighted) continue;
    const V w = load<W>(row.weight + k);
    for (int c = 0; c < table.size; ++c)
      store(work.column(table.size + c) + k, w * load<W>(work.column(c) + k));
  }
}

/// Sums over the entries, four at a time: of column a[n] times column b[n] for all n < count.
template <int W>
[[gnu::always_inline]] inline void dot_products(int padded, int count, const auto& a, const auto& b,
                                                Lanes<W>* sums) {
  using V = Lanes<W>;
  int n = 0;
  for (; n + 4 <= count; n += 4) {
    V s0{}, s1{}, s2{}, s3{};
    for (int k = 0; k < padded; k += W) {
      s0 += load<W>(a(n) + k) * load<W>(b(n) + k);
      s1 += load<W>(a(n + 1) + k) * load<W>(b(n + 1) + k);
      s2 += load<W>(a(n + 2) + k) * load<W>(b(n + 2) + k);
      s3 += load<W>(a(n + 3) + k) * load<W>(b(n + 3) + k);
    }
    sums[n] = s0, sums[n + 1] = s1, sums[n + 2] = s2, sums[n + 3] = s3;
  }
  for (; n < count; ++n) {
    V sum{};
    for (int k = 0; k < padded; k += W) sum += load<W>(a(n) + k) * load<W>(b(n) + k);
    sums[n] = sum;
  }
}

/// Adds weight times the combination c of the monomials, in the first columns, to `a`.
template <int D, int M, int W>
[[gnu::always_inline]] inline void combine(const Entries<D>& row, const Workspace& work,
                                           const Lanes<W>* c, int lane, double* a) {
  using V = Lanes<W>;
  for (int k = 0; k < row.padded; k += W) {
    V s0{}, s1{};
    int l = 0;
    for (; l + 2 <= M; l += 2) {
      s0 += c[l][lane] * load<W>(work.column(l) + k);
      s1 += c[l + 1][lane] * load<W>(work.column(l + 1) + k);
    }
    if (l < M) s0 += c[l][lane] * load<W>(work.column(l) + k);
    store(a + k, load<W>(a + k) + load<W>(row.weight + k) * (s0 + s1));
  }
}

/// The inverses of the moment matrices of W rows; which of them are good.
template <int D, int P, int W>
[[gnu::always_inline]] inline auto inverse_moments(const BatchSystem& system, const Batch<W>& batch,
                                                   const Entries<D>* row, const Workspace& work,
                                                   LaneMatrix<Lanes<W>, monomial_count<D, P>>& A,
                                                   Lanes<W>& reciprocal) {
  using V = Lanes<W>;
  constexpr int M = monomial_count<D, P>;
  static constexpr ProductTable<D, P> products{};
  V partial[W][products.count];
  for (int r = 0; r < W; ++r) {
    if (r < batch.rows) {
      fill_monomials<D, P, W>(row[r], work, true);
      dot_products<W>(
          row[r].padded, products.count, [&](int n) { return work.column(products.first[n]); },
          [&](int n) { return work.column(M + products.second[n]); }, partial[r]);
    } else {
      for (V& sum : partial[r]) sum = V{};
    }
  }
  V moment[products.count];
  for (int c = 0; c < products.count; ++c) moment[c] = sums<W>(&partial[0][c], products.count);
  for (int k = 0; k < M; ++k)
    for (int l = 0; l < M; ++l) A(k, l) = moment[products.moment[k][l]];
  return invert<M, Form::Monomials>(system, A, reciprocal);
}

/// Row r's weights in one of its matrices.
template <int D, int M>
double* weights(const Workspace& work, int r, int output) {
  return work.column(2 * M + r * (D + 1) + output);
}

/// Weights whose moments are `target`, one column an output: in two rounds, the second for what the moments
/// of the first still lack.
template <int D, int P, int W>
[[gnu::always_inline]] inline void fill_weights(
    const Batch<W>& batch, const Entries<D>* row, const Workspace& work, int outputs,
    const LaneMatrix<Lanes<W>, monomial_count<D, P>>& inverse,
    const Lanes<W> (&target)[D + 1][monomial_count<D, P>]) {
  using V = Lanes<W>;
  constexpr int M = monomial_count<D, P>;
  V lacking[D + 1][M], correction[D + 1][M], own[M];
  for (int o = 0; o < outputs; ++o)
    for (int l = 0; l < M; ++l) lacking[o][l] = target[o][l];
  for (int round = 0; round < 2; ++round) {
    for (int o = 0; o < outputs; ++o)
      for (int k = 0; k < M; ++k) {
        V sum{};
        for (int l = 0; l < M; ++l) sum += inverse(k, l) * lacking[o][l];
        correction[o][k] = sum;
      }
    for (int r = 0; r < batch.rows; ++r) {
      fill_monomials<D, P, W>(row[r], work, false);
      for (int o = 0; o < outputs; ++o) {
        double* const a = weights<D, M>(work, r, o);
        for (int k = 0; round == 0 && k < row[r].padded; ++k) a[k] = 0;
        combine<D, M, W>(row[r], work, correction[o], r, a);
        if (round > 0) continue;
        dot_products<W>(
            row[r].padded, M, [&](int) { return a; }, [&](int n) { return work.column(n); }, own);
        for (int l = 0; l < M; ++l) lacking[o][l][r] = target[o][l][r] - sum_of_lanes(own[l]);
      }
    }
  }
}

/// Copies a row's weights to their place and writes the diagonal. Returns whether all is finite.
template <int D, int W>
[[gnu::always_inline]] inline bool write(const Entries<D>& row, const double* a, double* value) {
  Lanes<W> sum{};
  for (int n = 0; n < row.padded; n += W) sum += load<W>(a + n);
  for (int n = 0; n < row.count; ++n) value[n] = a[n];
  const double total = sum_of_lanes(sum);
  value[row.diagonal] = 0 - total;
  return total - total == 0;
}

/// Row::least_squares() of W rows at a time, always in two rounds.
template <int D, int P, int W>
void least_squares_of_degree(const BatchSystem& system, const Batch<W>& batch,
                             const Entries<D>* row, const Workspace& work) {
  using V = Lanes<W>;
  constexpr int M = monomial_count<D, P>;
  LaneMatrix<V, M> inverse;
  V reciprocal, h = V{} + 1, target[D + 1][M] = {};
  const auto good = inverse_moments<D, P, W>(system, batch, row, work, inverse, reciprocal);
  for (int r = 0; r < batch.rows; ++r) h[r] = row[r].h;
  const int axes = system.gradient[0] ? D : 0, outputs = axes + (system.laplacian ? 1 : 0);
  for (int o = 0; o < axes; ++o) target[o][o] = 1 / h;
  for (int a = 0; a < D; ++a) target[axes][D + a * D - a * (a - 1) / 2] = 2 / (h * h);
  fill_weights<D, P, W>(batch, row, work, outputs, inverse, target);
  for (int r = 0; r < batch.rows; ++r) {
    bool solved = good[r] && row[r].count > M;
    for (int o = 0; o < outputs; ++o) {
      double* const to = o < axes ? system.gradient[o] : system.laplacian;
      solved &= write<D, W>(row[r], weights<D, M>(work, r, o), to + batch.entry[r]);
    }
    system.solved[batch.first + r] = solved;
    system.reciprocal_condition[batch.row[r]] = reciprocal[r];
  }
}

template <int D, int W>
[[gnu::always_inline]] inline void least_squares(const BatchSystem& system, const Batch<W>& batch,
                                                 const Entries<D>* row, const Workspace& work) {
  switch (system.degree) {
    case 3: return least_squares_of_degree<D, 3, W>(system, batch, row, work);
    case 4: return least_squares_of_degree<D, 4, W>(system, batch, row, work);
  }
  if constexpr (highest_batched_degree(D) > 4) switch (system.degree) {
      case 5: return least_squares_of_degree<D, 5, W>(system, batch, row, work);
      case 6: return least_squares_of_degree<D, 6, W>(system, batch, row, work);
    }
}

template <int D, int W>
void solve(const BatchPoints& points, const BatchRows& rows, const int* order, int first, int count,
           const BatchSystem* systems, int system_count, int most_entries, double* memory) {
  const long room = round_up(most_entries, 8);
  Entries<D> row[W];
  for (int r = 0; r < W; ++r) {
    double* at = memory + r * (D + 4) * room;
    for (int a = 0; a < D; ++a) row[r].s[a] = at, at += room;
    row[r].q = at, at += room;
    row[r].volume = at, at += room;
    row[r].weight = at, at += room;
    row[r].over = at;
  }
  const Workspace work{memory + W * (D + 4) * room, room};
  for (int begin = 0; begin < count; begin += W) {
    Batch<W> batch;
    batch.rows = count - begin < W ? count - begin : W;
    batch.first = begin;
    for (int r = 0; r < batch.rows; ++r) {
      const int k = order ? order[begin + r] : first + begin + r;
      batch.row[r] = k;
      batch.entry[r] = rows.outer[k];
      row[r].count = rows.outer[k + 1] - rows.outer[k];
      row[r].padded = round_up(row[r].count, W);
      gather<D>(points, rows.inner + rows.outer[k], rows.points ? rows.points[k] : k, row[r]);
    }
    // Only now: vector loads of what was stored just before, number by number, would have to wait.
    for (int r = 0; r < batch.rows; ++r) scale<D, W>(points, row[r]);
    for (int s = 0; s < system_count; ++s) {
      for (int r = 0; r < batch.rows; ++r) weigh<D, W>(points, systems[s], row[r]);
      switch (systems[s].form) {
        case Form::Zoc: uncorrected<D, W>(systems[s], batch, row); break;
        case Form::Linear: corrected<D, Form::Linear, W>(systems[s], batch, row); break;
        case Form::Quadratic: corrected<D, Form::Quadratic, W>(systems[s], batch, row); break;
        case Form::Directions: corrected<D, Form::Directions, W>(systems[s], batch, row); break;
        case Form::Monomials: least_squares<D, W>(systems[s], batch, row, work); break;
      }
    }
  }
}

template <int D, int W>
void density(const BatchPoints& points, const int* offsets, const int* indices, const int* order,
             int first, int count, double* volumes) {
  using V = Lanes<W>;
  const double self = points.profile(0).w;
  for (int n = 0; n < count; ++n) {
    const int i = order ? order[n] : first + n;
    const int* const neighbour = indices + offsets[i];
    const int size = offsets[i + 1] - offsets[i];
    const double h = points.supports[points.one_support ? 0 : i];
    const double per_h = 1 / h;
    V sum{};
    for (int k = 0; k < size; k += W) {
      V squared{};
      for (int a = 0; a < D; ++a) {
        V r = all<W>(k + W <= size ? 0 : h);  // whoever fills up the last vector is at q >= 1
        for (int l = 0; l < W && k + l < size; ++l)
          r[l] = points.x[static_cast<long>(neighbour[k + l]) * D + a] -
                 points.x[static_cast<long>(i) * D + a];
        if (points.box[a] > 0) r -= points.box[a] * rounded(r / points.box[a]);
        r *= per_h;
        squared += r * r;
      }
      const V q = square_root(squared);
      const V w = profile<W>(points, q < 1 ? q : all<W>(1)).w;
      if (k + W <= size) {
        sum += w;
      } else {
        for (int l = 0; k + l < size; ++l) sum[l] += w[l];
      }
    }
    volumes[i] = 1 / (self + sum_of_lanes(sum));
  }
}

}  // namespace

template <>
BatchKernels batch_kernels<GRADPSI_LANES>() {
  constexpr int W = GRADPSI_LANES;
  return {{solve<1, W>, solve<2, W>, solve<3, W>}, {density<1, W>, density<2, W>, density<3, W>}};
}

}  // namespace gradpsi
