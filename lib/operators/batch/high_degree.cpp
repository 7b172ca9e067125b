// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "operators/batch/high_degree.hpp"

#include "operators/batch/inverses.hpp"

namespace gradpsi {
namespace {

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
void fill_monomials(Entries<D> row, Workspace work, bool weighted) {
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

/// The sum over the entries of a column.
template <int W>
[[gnu::always_inline]] inline Lanes<W> column_sum(int padded, const double* a) {
  Lanes<W> sum{};
  for (int k = 0; k < padded; k += W) sum += load<W>(a + k);
  return sum;
}

/// Adds weight times the combination c of the monomials, in the first columns, and of 1 to `a`.
template <int D, int M, int W>
[[gnu::always_inline]] inline void combine(Entries<D> row, Workspace work, const Lanes<W>* c,
                                           Lanes<W> c_of_1, int lane, double* a) {
  using V = Lanes<W>;
  for (int k = 0; k < row.padded; k += W) {
    V s0 = V{} + c_of_1[lane], s1{};
    int l = 0;
    for (; l + 2 <= M; l += 2) {
      s0 += c[l][lane] * load<W>(work.column(l) + k);
      s1 += c[l + 1][lane] * load<W>(work.column(l + 1) + k);
    }
    if (l < M) s0 += c[l][lane] * load<W>(work.column(l) + k);
    store(a + k, load<W>(a + k) + load<W>(row.weight + k) * (s0 + s1));
  }
}

/// What centres the monomials of W rows: their sums, weighed, and 1 / sum omega W.
template <int M, int W>
struct Centre {
  Lanes<W> sum[M] = {}, per_total = {};
};

/// Adds up a row's weights and, from the columns behind the monomials, weighed monomials.
template <int D, int M, int W>
[[gnu::always_inline]] inline void add_up(Entries<D> row, Profile own, Workspace work, int lane,
                                          Centre<M, W>& centre) {
  for (int l = 0; l < M; ++l)
    centre.sum[l][lane] = sum_of_lanes(column_sum<W>(row.padded, work.column(M + l)));
  const double total = sum_of_lanes(column_sum<W>(row.padded, row.weight));
  centre.per_total[lane] = 1 / (total + row.own_volume * own.w);
}

/// The inverses of the moment matrices of W rows; which of them are good.
template <int D, int P, int W>
[[gnu::always_inline]] inline auto inverse_moments(const BatchSystem& system, const Batch<W>& batch,
                                                   const Entries<D>* row, Workspace work,
                                                   LaneMatrix<Lanes<W>, monomial_count<D, P>>& A,
                                                   Centre<monomial_count<D, P>, W>& centre,
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
      if (system.fitted) add_up<D, M, W>(row[r], batch.own, work, r, centre);
    } else {
      for (V& sum : partial[r]) sum = V{};
    }
  }
  V moment[products.count];
  for (int c = 0; c < products.count; ++c) moment[c] = sums<W>(&partial[0][c], products.count);
  for (int k = 0; k < M; ++k)
    for (int l = 0; l < M; ++l) A(k, l) = moment[products.moment[k][l]];
  for (int k = 0; system.fitted && k < M; ++k)
    for (int l = 0; l < M; ++l) A(k, l) -= centre.sum[k] * (centre.sum[l] * centre.per_total);
  return invert<M, Form::Monomials>(system, A, reciprocal);
}

/// Row r's weights in one of its matrices.
template <int M>
double* weights(Workspace work, int outputs, int r, int output) {
  return work.column(2 * M + r * outputs + output);
}

/// Weights whose moments are `target`, one column an output: in two rounds, the second for what the moments
/// of the first still lack. Values begin with the mean; rows without a point of their own must sum up to what they
/// should by themselves.
template <int D, int P, int W>
[[gnu::always_inline]] inline void fill_weights(
    const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row, Workspace work,
    const LaneMatrix<Lanes<W>, monomial_count<D, P>>& inverse,
    const Centre<monomial_count<D, P>, W>& centre,
    const Lanes<W> (&target)[most_outputs][monomial_count<D, P>]) {
  using V = Lanes<W>;
  constexpr int M = monomial_count<D, P>;
  const int outputs = system.outputs;
  V lacking[most_outputs][M], lacking_sum[most_outputs], correction[most_outputs][M],
      of_1[most_outputs], own[M];
  for (int o = 0; o < outputs; ++o) {
    for (int l = 0; l < M; ++l) lacking[o][l] = target[o][l];
    lacking_sum[o] = V{} + (system.orders[o] == 0 ? 1.0 : 0.0);
  }
  for (int round = 0; round < 2; ++round) {
    for (int o = 0; system.fitted && o < outputs; ++o) {
      of_1[o] = lacking_sum[o] * centre.per_total;
      for (int l = 0; l < M; ++l) lacking[o][l] -= centre.sum[l] * of_1[o];
    }
    for (int o = 0; o < outputs; ++o)
      for (int k = 0; k < M; ++k) {
        V sum{};
        for (int l = 0; l < M; ++l) sum += inverse(k, l) * lacking[o][l];
        correction[o][k] = sum;
      }
    for (int o = 0; o < outputs; ++o) {
      if (!system.fitted) of_1[o] = V{};
      for (int l = 0; system.fitted && l < M; ++l)
        of_1[o] -= correction[o][l] * (centre.sum[l] * centre.per_total);
    }
    for (int r = 0; r < batch.rows; ++r) {
      fill_monomials<D, P, W>(row[r], work, false);
      for (int o = 0; o < outputs; ++o) {
        double* const a = weights<M>(work, outputs, r, o);
        for (int k = 0; round == 0 && k < row[r].padded; ++k) a[k] = 0;
        combine<D, M, W>(row[r], work, correction[o], of_1[o], r, a);
        if (round > 0) continue;
        lacking_sum[o][r] = 0;
        if (system.fitted && row[r].own_volume == 0)
          lacking_sum[o][r] =
              (system.orders[o] == 0) - sum_of_lanes(column_sum<W>(row[r].padded, a));
        dot_products<W>(
            row[r].padded, M, [&](int) { return a; }, [&](int n) { return work.column(n); }, own);
        for (int l = 0; l < M; ++l) lacking[o][l][r] = target[o][l][r] - sum_of_lanes(own[l]);
      }
    }
  }
}

/// Copies a row's weights to their place and writes the diagonal. Returns whether all is finite.
template <int D, int W>
[[gnu::always_inline]] inline bool write(Entries<D> row, const double* a, double constant,
                                         double* value) {
  Lanes<W> sum{};
  for (int n = 0; n < row.padded; n += W) sum += load<W>(a + n);
  for (int n = 0; n < row.count; ++n) value[n] = a[n];
  const double total = sum_of_lanes(sum);
  value[row.diagonal] = constant - total;
  return total - total == 0;
}

}  // namespace

template <int D, int P, int W>
void least_squares(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row,
                   Workspace work) {
  using V = Lanes<W>;
  constexpr int M = monomial_count<D, P>;
  const int outputs = system.outputs;
  LaneMatrix<V, M> inverse;
  Centre<M, W> centre;
  V reciprocal, h = V{} + 1, target[most_outputs][M] = {};
  const auto good = inverse_moments<D, P, W>(system, batch, row, work, inverse, centre, reciprocal);
  for (int r = 0; r < batch.rows; ++r) h[r] = row[r].h;
  for (int t = 0; t < system.term_count; ++t) {
    const Term& term = system.terms[t];
    target[term.output][term.monomial] = term.value / (system.orders[term.output] == 1 ? h : h * h);
  }
  fill_weights<D, P, W>(system, batch, row, work, inverse, centre, target);
  for (int r = 0; r < batch.rows; ++r) {
    bool solved = good[r] && row[r].neighbours >= M;
    for (int o = 0; o < outputs; ++o)
      solved &= write<D, W>(row[r], weights<M>(work, outputs, r, o), system.orders[o] == 0,
                            system.values[o] + batch.entry[r]);
    system.solved[batch.first + r] = solved;
    system.reciprocal_condition[batch.row[r]] = reciprocal[r];
  }
}

#define INSTANTIATE(D, P)                           \
  template void least_squares<D, P, GRADPSI_LANES>( \
      const BatchSystem&, const Batch<GRADPSI_LANES>&, const Entries<D>*, Workspace);
INSTANTIATE(1, 3)
INSTANTIATE(1, 4)
INSTANTIATE(1, 5)
INSTANTIATE(1, 6)
INSTANTIATE(2, 3)
INSTANTIATE(2, 4)
INSTANTIATE(2, 5)
INSTANTIATE(2, 6)
INSTANTIATE(3, 3)
INSTANTIATE(3, 4)
#undef INSTANTIATE

}  // namespace gradpsi
