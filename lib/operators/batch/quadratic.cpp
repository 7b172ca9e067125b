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

/// Adds up the weights.
template <int D, int W>
[[gnu::always_inline]] inline Lanes<W> total(Entries<D> row, const double* weight) {
  Lanes<W> sum{};
  for (int k = 0; k < row.padded; k += W) sum += load<W>(weight + k);
  return sum;
}

/// The monomials of some degrees, and where their sums begin.
template <int D>
struct Degrees {
  int low, high, begin;
  constexpr int first() const { return monomials_to(D, low - 1); }
  constexpr int end() const { return begin + (high < low ? 0 : monomials_to(D, high) - first()); }
  constexpr int at(int monomial) const { return begin + monomial - first(); }
};

/// Where a form has its trial functions: whether number l is one of degree 2 that has -W'/r on its diagonal.
template <int D, Form form>
constexpr bool has_trace(int l) {
  for (int a = 0; a < D; ++a)
    if (form == Form::KernelDerivatives && l == D + a * D - a * (a - 1) / 2) return true;
  return false;
}

/// The moments that a form's matrix is made of: with `weight`, with `over`, and if u_i is fitted with W.
template <int D, Form form, int P, bool fitted>
struct Moments {
  static constexpr int M = monomial_count<D, P>;
  static constexpr bool derivatives = form == Form::KernelDerivatives,
                        monomials_only = form == Form::Monomials;
  static constexpr Degrees<D> weight = {derivatives || fitted ? 1 : 2,
                                        monomials_only ? 2 * P
                                        : P == 1       ? 2
                                                       : 3,
                                        0};
  static constexpr Degrees<D> over = {fitted ? 2 : 3, monomials_only || P == 1 ? 0 : 4,
                                      weight.end()};
  static constexpr Degrees<D> kernel = {1, derivatives&& fitted ? P : 0, over.end()};
  static constexpr int totals = kernel.end();  // of W, of `weight`
  static constexpr int count = totals + (!fitted ? 0 : derivatives ? 2 : 1);

  template <int W>
  [[gnu::always_inline]] static void gather(Entries<D> row, Lanes<W>* sums) {
    add_up<weight.low, weight.high, W>(row, row.weight, sums + weight.begin);
    if constexpr (over.high > 0) add_up<over.low, over.high, W>(row, row.over, sums + over.begin);
    if constexpr (kernel.high > 0)
      add_up<kernel.low, kernel.high, W>(row, row.kernel, sums + kernel.begin);
    if constexpr (fitted) sums[totals] = total<D, W>(row, derivatives ? row.kernel : row.weight);
    if constexpr (fitted && derivatives) sums[totals + 1] = total<D, W>(row, row.weight);
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
          result.at[k][l] = !monomials_only && l >= D ? over.at(table.product(k, l))
                                                      : weight.at(table.product(k, l));
      return result;
    }();
    for (int k = 0; k < M; ++k)
      for (int l = 0; l < M; ++l) {
        A(k, l) = moment[index.at[k][l]];
        if (has_trace<D, form>(l)) A(k, l) -= moment[weight.at(k)];
      }
  }

  /// Of the point's own volume and profile, and the sums: the means that are taken away from the functions, of
  /// weighed monomials times `of_w`, and what that does to the matrix; 1 / sum omega W.
  template <class V>
  [[gnu::always_inline]] static V centre(const V* moment, V own_volume, Profile own, V* mean,
                                         V* of_w, LaneMatrix<V, M>& A) {
    const V per_sum = 1 / (moment[totals] + own_volume * own.w);
    for (int l = 0; l < M; ++l) {
      const bool second = !monomials_only && l >= D;
      mean[l] = moment[second ? over.at(l) : weight.at(l)];
      if constexpr (derivatives)
        if (has_trace<D, form>(l)) mean[l] += own_volume * own.d2w - moment[totals + 1];
      mean[l] *= per_sum;
      of_w[l] = moment[derivatives ? kernel.at(l) : weight.at(l)];
    }
    for (int k = 0; k < M; ++k)
      for (int l = 0; l < M; ++l) A(k, l) -= of_w[k] * mean[l];
    return per_sum;
  }

 private:
  template <int low, int high, int W>
  [[gnu::always_inline]] static void add_up(Entries<D> row, const double* with, Lanes<W>* sums) {
    if constexpr (high == 4 && D == 3) {  // all at once would not fit the registers
      accumulate<D, low, 3, W>(row, with, sums);
      accumulate<D, 4, 4, W>(row, with, sums + monomial_count<D, 3> - monomial_count<D, low - 1>);
    } else {
      accumulate<D, low, high, W>(row, with, sums);
    }
  }
};

/// Coefficients of one matrix of a row: of the functions, of W, and what the diagonal has beside their sum.
struct Coefficients {
  double c[9], of_w, constant;
};

/// Writes one row of all matrices, c . t(s_j) weighted, and the diagonals. Returns whether all is finite.
template <int D, Form form, int P, bool fitted, int W>
[[gnu::always_inline]] inline bool emit(const BatchSystem& system, Entries<D> row,
                                        const Coefficients* of, int entry, Workspace work) {
  using V = Lanes<W>;
  constexpr int M = monomial_count<D, P>;
  const auto functions = [&](int k, V* t) __attribute__((always_inline)) {
    monomials<D, P, W>(row, k, t);
    const V w = load<W>(row.weight + k);
    for (int l = 0; l < M; ++l) {
      t[l] *= form != Form::Monomials && l >= D ? load<W>(row.over + k) : w;
      if (has_trace<D, form>(l)) t[l] -= w;
    }
  };
  const double* const kernel = form == Form::KernelDerivatives ? row.kernel : row.weight;
  double check = 0;
  // One matrix after the other: lines of memory that many are written to in turn get into each other's way.
  // weight(c, k) adds up c . t.
  const auto write = [&](int o, const auto& weight) __attribute__((always_inline)) {
    double* const value = system.values[o] + entry;
    double c[M];
    for (int l = 0; l < M; ++l) c[l] = of[o].c[l];
    V sum{};
    for (int k = 0; k < row.padded; k += W) {
      V a = weight(c, k);
      if constexpr (fitted) a += of[o].of_w * load<W>(kernel + k);
      sum += a;
      store_first(value + k, a, row.count - k);
    }
    const double total = sum_of_lanes(sum);
    value[row.diagonal] = of[o].constant + system.diagonal * total;
    check += total - total;
  };
  if (system.outputs == 1) {
    write(
        0, [&](const double* c, int k) __attribute__((always_inline)) {
          V t[M];
          functions(k, t);
          V a = as_rounded(c[0] * t[0]);
#pragma GCC unroll 9
          for (int l = 1; l < M; ++l) a += c[l] * t[l];
          return a;
        });
    return check == 0;
  }
  for (int k = 0; k < row.padded; k += W) {
    V t[M];
    functions(k, t);
    for (int l = 0; l < M; ++l) store(work.column(l) + k, t[l]);
  }
  for (int o = 0; o < system.outputs; ++o)
    write(
        o, [&](const double* c, int k) __attribute__((always_inline)) {
          V a = as_rounded(c[0] * load<W>(work.column(0) + k));
#pragma GCC unroll 9
          for (int l = 1; l < M; ++l) a += c[l] * load<W>(work.column(l) + k);
          return a;
        });
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
    store_first(value + k, a, row.count - k);
  }
  const double total = sum_of_lanes(sum);
  value[row.diagonal] = 0 - total;
  return total - total == 0;
}

}  // namespace

template <int D, int W>
void uncorrected(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row,
                 Workspace work) {
  for (int r = 0; r < batch.rows; ++r) {
    double factor = 1;
    for (int n = 0; n > system.given_power; --n) factor /= row[r].h;
    bool finite;
    if (system.form == Form::Constant) {
      finite = emit_weights<D, W>(row[r], factor, system.values[0] + batch.entry[r]);
    } else {
      Coefficients c[most_outputs] = {};
      for (int t = 0; t < system.term_count; ++t) {
        const Term& term = system.terms[t];
        c[term.output].c[term.monomial] += factor * term.value;
      }
      finite =
          system.form == Form::Monomials
              ? emit<D, Form::Monomials, 1, false, W>(system, row[r], c, batch.entry[r], work)
              : emit<D, Form::Directions, 2, false, W>(system, row[r], c, batch.entry[r], work);
    }
    system.solved[batch.first + r] = finite && row[r].neighbours > 0;
    system.reciprocal_condition[batch.row[r]] = 1;
  }
}

namespace {

template <int D, Form form, int P, bool fitted, int W>
[[gnu::always_inline]] inline void corrected_by(const BatchSystem& system, const Batch<W>& batch,
                                                const Entries<D>* row, Workspace work) {
  using V = Lanes<W>;
  using System = Moments<D, form, P, fitted>;
  constexpr int M = System::M;
  V partial[W][System::count];
  for (int r = 0; r < batch.rows; ++r) System::template gather<W>(row[r], partial[r]);
  for (int r = batch.rows; r < W; ++r)
    for (int c = 0; c < System::count; ++c) partial[r][c] = V{};
  V moment[System::count];
  for (int c = 0; c < System::count; ++c) moment[c] = sums<W>(&partial[0][c], System::count);
  LaneMatrix<V, M> A;
  System::fill(moment, A);
  if (system.how == How::Normalized)
    for (int k = 0; k < M; ++k)
      for (int l = 0; l < M; ++l)
        if (k != l) A(k, l) = V{};
  V h = V{} + 1, own_volume = V{} + 1;
  for (int r = 0; r < batch.rows; ++r) h[r] = row[r].h, own_volume[r] = row[r].own_volume;
  const V per_h = 1 / h;
  V mean[M], of_w[M], per_sum;
  if constexpr (fitted) per_sum = System::centre(moment, own_volume, batch.own, mean, of_w, A);
  V reciprocal;
  const auto good = invert<M, form>(system, A, reciprocal);

  V c[most_outputs][M], c_of_w[most_outputs];
  for (int o = 0; o < system.outputs; ++o)
    for (int l = 0; l < M; ++l) c[o][l] = -V{};  // -0 + x is x, were it -0
  for (int t = 0; t < system.term_count; ++t) {
    const Term& term = system.terms[t];
    for (int l = 0; l < M; ++l) c[term.output][l] += term.value * A(l, term.monomial);
  }
  for (int o = 0; o < system.outputs; ++o) {
    const bool value = system.orders[o] == 0;
    if constexpr (fitted)
      for (int k = 0; value && k < M; ++k)  // what the mean, with which it begins, is off
        for (int l = 0; l < M; ++l) c[o][l] -= A(l, k) * (of_w[k] * per_sum);
    const V per_unit = value ? V{} + 1 : system.orders[o] == 1 ? per_h : per_h * per_h;
    for (int l = 0; l < M; ++l) c[o][l] *= per_unit;
    if constexpr (fitted) {
      c_of_w[o] = value ? per_sum : V{};
      for (int l = 0; l < M; ++l) c_of_w[o] -= c[o][l] * mean[l];
    }
  }
  for (int r = 0; r < batch.rows; ++r) {
    Coefficients own[most_outputs];
    for (int o = 0; o < system.outputs; ++o) {
      for (int l = 0; l < M; ++l) own[o].c[l] = c[o][l][r];
      if constexpr (fitted) own[o].of_w = c_of_w[o][r];
      own[o].constant = system.orders[o] == 0;
    }
    // With fewer neighbours than unknowns the matrix is singular, rounding or not.
    system.solved[batch.first + r] =
        good[r] && row[r].neighbours >= M &&
        emit<D, form, P, fitted, W>(system, row[r], own, batch.entry[r], work);
    system.reciprocal_condition[batch.row[r]] = reciprocal[r];
  }
}

}  // namespace

template <int D, int W>
void corrected(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row,
               Workspace work) {
  const bool linear = system.degree == 1;
  if (system.form == Form::Directions)
    corrected_by<D, Form::Directions, 2, false, W>(system, batch, row, work);
  else if (system.form == Form::KernelDerivatives && linear)
    corrected_by<D, Form::KernelDerivatives, 1, true, W>(system, batch, row, work);
  else if (system.form == Form::KernelDerivatives && system.fitted)
    corrected_by<D, Form::KernelDerivatives, 2, true, W>(system, batch, row, work);
  else if (system.form == Form::KernelDerivatives)
    corrected_by<D, Form::KernelDerivatives, 2, false, W>(system, batch, row, work);
  else if (system.fitted && linear)
    corrected_by<D, Form::Monomials, 1, true, W>(system, batch, row, work);
  else if (system.fitted)
    corrected_by<D, Form::Monomials, 2, true, W>(system, batch, row, work);
  else if (linear)
    corrected_by<D, Form::Monomials, 1, false, W>(system, batch, row, work);
  else
    corrected_by<D, Form::Monomials, 2, false, W>(system, batch, row, work);
}

#define INSTANTIATE(D)                                                                         \
  template void uncorrected<D, GRADPSI_LANES>(const BatchSystem&, const Batch<GRADPSI_LANES>&, \
                                              const Entries<D>*, Workspace);                   \
  template void corrected<D, GRADPSI_LANES>(const BatchSystem&, const Batch<GRADPSI_LANES>&,   \
                                            const Entries<D>*, Workspace);
INSTANTIATE(1)
INSTANTIATE(2)
INSTANTIATE(3)
#undef INSTANTIATE

}  // namespace gradpsi
