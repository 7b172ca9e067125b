// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "operators/batch/quadratic.hpp"

#include "operators/batch/inverses.hpp"

namespace gradpsi {
namespace {

/// Adds weight times the monomials of degree Low to High to `sum`, which has one place for each.
template <int D, int Low, int High, int W>
[[gnu::always_inline]] inline void accumulate(Entries<D> row, const double* weight, Lanes<W>* sum) {
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

/// The moments that a form's matrix is made of: with `weight` degrees 2 to high, with `over` from 3 to 4.
template <int D, Form form, int P>
struct Moments {
  static constexpr int M = monomial_count<D, P>;
  static constexpr int high = form == Form::Directions ? 3 : 2 * P;
  static constexpr int plain = monomial_count<D, high> - D;
  static constexpr int over =
      form == Form::Directions ? monomial_count<D, 4> - monomial_count<D, 2> : 0;
  static constexpr int count = plain + over;

  template <int W>
  [[gnu::always_inline]] static void gather(Entries<D> row, Lanes<W>* sums) {
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

/// Writes one row of up to D + 1 matrices, c[o] . t(s_j) weighted, and the diagonals.
/// Returns whether all is finite.
template <int D, Form form, int P, int outputs, int W>
[[gnu::always_inline]] inline bool emit(Entries<D> row, const double (*c)[9],
                                        double* const* value) {
  using V = Lanes<W>;
  constexpr int M = monomial_count<D, P>;
  V sum[outputs] = {};
  for (int k = 0; k < row.padded; k += W) {
    V t[M];
    monomials<D, P, W>(row, k, t);
    const V w = load<W>(row.weight + k);
    for (int l = 0; l < M; ++l)
      t[l] *= form == Form::Directions && l >= D ? load<W>(row.over + k) : w;
#pragma GCC unroll 4
    for (int o = 0; o < outputs; ++o) {
      // Which of the first two products is rounded before it is summed is as compilers chose when nothing
      // said so: matrices stay the same to the bit.
      const int first = M == 1 ? 0 : M == 2 && outputs == 2 ? 1 - o : 1;
      V a = as_rounded(c[o][first] * t[first]);
      if constexpr (M > 1) a += c[o][1 - first] * t[1 - first];
#pragma GCC unroll 9
      for (int l = 2; l < M; ++l) a += c[o][l] * t[l];
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

/// The weights of Form::Constant are phi itself.
template <int D, int W>
[[gnu::always_inline]] inline bool emit_weights(Entries<D> row, double factor, double* value) {
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

/// Writes all outputs, D + 1 of them in one pass over the entries.
template <int D, Form form, int P, int W>
[[gnu::always_inline]] inline bool emit_all(const BatchSystem& system, Entries<D> row,
                                            const double (*c)[9], int entry) {
  bool finite = true;
  for (int o = 0; o < system.outputs;) {
    const int left = system.outputs - o;
    double* value[D + 1];
    for (int n = 0; n < left && n <= D; ++n) value[n] = system.values[o + n] + entry;
    const auto several = [&]<int count>() __attribute__((always_inline)) {
      finite &= emit<D, form, P, count, W>(row, c + o, value);
      o += count;
    };
    if (left > D)
      several.template operator()<D + 1>();
    else if (left == 1)
      several.template operator()<1>();
    else if (left == 2)
      several.template operator() < D<2 ? 1 : 2>();
    else
      several.template operator() < D<3 ? 1 : 3>();
  }
  return finite;
}

}  // namespace

template <int D, int W>
void uncorrected(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row) {
  for (int r = 0; r < batch.rows; ++r) {
    double factor = 1;
    for (int n = 0; n > system.given_power; --n) factor /= row[r].h;
    bool finite;
    if (system.form == Form::Constant) {
      finite = emit_weights<D, W>(row[r], factor, system.values[0] + batch.entry[r]);
    } else {
      double c[most_outputs][9] = {};
      for (int t = 0; t < system.term_count; ++t) {
        const Term& term = system.terms[t];
        c[term.output][term.monomial] = factor * term.value;
      }
      finite = emit_all<D, Form::Monomials, 1, W>(system, row[r], c, batch.entry[r]);
    }
    system.solved[batch.first + r] = finite && row[r].neighbours > 0;
    system.reciprocal_condition[batch.row[r]] = 1;
  }
}

namespace {

template <int D, Form form, int P, int W>
[[gnu::always_inline]] inline void corrected_by(const BatchSystem& system, const Batch<W>& batch,
                                                const Entries<D>* row) {
  using V = Lanes<W>;
  using System = Moments<D, form, P>;
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
  V c[most_outputs][9];
  for (int o = 0; o < system.outputs; ++o)
    for (int l = 0; l < M; ++l) c[o][l] = -V{};  // -0 + x is x, were it -0
  for (int t = 0; t < system.term_count; ++t) {
    const Term& term = system.terms[t];
    for (int l = 0; l < M; ++l) c[term.output][l] += term.value * A(l, term.monomial);
  }
  for (int o = 0; o < system.outputs; ++o) {
    const V unit = system.orders[o] == 1 ? h : h * h;
    for (int l = 0; l < M; ++l) c[o][l] /= unit;
  }
  for (int r = 0; r < batch.rows; ++r) {
    double own[most_outputs][9];
    for (int o = 0; o < system.outputs; ++o)
      for (int l = 0; l < M; ++l) own[o][l] = c[o][l][r];
    // With fewer neighbours than unknowns the matrix is singular, rounding or not.
    system.solved[batch.first + r] = good[r] && row[r].neighbours >= M &&
                                     emit_all<D, form, P, W>(system, row[r], own, batch.entry[r]);
    system.reciprocal_condition[batch.row[r]] = reciprocal[r];
  }
}

}  // namespace

template <int D, int W>
void corrected(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row) {
  if (system.form == Form::Directions)
    corrected_by<D, Form::Directions, 2, W>(system, batch, row);
  else if (system.degree == 1)
    corrected_by<D, Form::Monomials, 1, W>(system, batch, row);
  else
    corrected_by<D, Form::Monomials, 2, W>(system, batch, row);
}

#define INSTANTIATE(D)                                                                         \
  template void uncorrected<D, GRADPSI_LANES>(const BatchSystem&, const Batch<GRADPSI_LANES>&, \
                                              const Entries<D>*);                              \
  template void corrected<D, GRADPSI_LANES>(const BatchSystem&, const Batch<GRADPSI_LANES>&,   \
                                            const Entries<D>*);
INSTANTIATE(1)
INSTANTIATE(2)
INSTANTIATE(3)
#undef INSTANTIATE

}  // namespace gradpsi
