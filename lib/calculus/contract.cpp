// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "calculus/contract.hpp"

#include <utility>

#include "matrix/gather.hpp"

namespace gradpsi {
namespace {

constexpr int W = GRADPSI_LANES;
using V = Lanes<W>;

template <int what, int dimension>
struct Contract {
  static constexpr const Contraction& table =
      vector_operator_rows[what].by_dimension[dimension - 1];
  static constexpr int sums =
      table.results == 1 ? 2 : 1;  // additions need not wait for one another
  static constexpr int step = sums * W;

  /// sum += the terms of W entries, or of one.
  template <class Number, int... t>
  [[gnu::always_inline]] static void add_terms(Number* sum, const Number* a, const Number* x,
                                               std::integer_sequence<int, t...>) {
    ((sum[table.terms[t].result] +=
      table.terms[t].factor * a[table.terms[t].matrix] * x[table.terms[t].component]),
     ...);
  }
  template <class Number>
  [[gnu::always_inline]] static void add(Number* sum, const Number* a, const Number* x) {
    add_terms(sum, a, x, std::make_integer_sequence<int, table.count>());
  }

  static void rows(const ContractionArguments& arguments, int begin, int end) {
    const int* const inner = arguments.inner;
    V a[table.matrices], x[table.components];
    for (int i = begin; i < end; ++i) {
      V sum[sums][table.results] = {};
      int k = arguments.outer[i];
      const int stop = arguments.outer[i + 1];
      for (; k + step <= stop; k += step)
        for (int s = 0; s < sums; ++s) {
          for (int c = 0; c < table.components; ++c)
            x[c] = gather<W>(arguments.x[c], inner + k + s * W);
          for (int m = 0; m < table.matrices; ++m) a[m] = load<W>(arguments.values[m] + k + s * W);
          add(sum[s], a, x);
        }
      // The rest at once, together with what follows and does not count; see products.cpp.
      const bool at_once = k < stop && k + step <= arguments.entries;
      for (int s = 0; at_once && s < sums; ++s) {
        const auto counts = first_lanes<W>(stop - k - s * W);
        for (int c = 0; c < table.components; ++c)
          x[c] = only<W>(counts, gather<W>(arguments.x[c], inner + k + s * W));
        for (int m = 0; m < table.matrices; ++m)
          a[m] = only<W>(counts, load<W>(arguments.values[m] + k + s * W));
        add(sum[s], a, x);
      }
      double total[table.results];
      for (int r = 0; r < table.results; ++r)
        total[r] = sum_of_lanes(sums == 2 ? sum[0][r] + sum[sums - 1][r] : sum[0][r]);
      if (!at_once) add_one_by_one(total, arguments, k, stop);
      for (int r = 0; r < table.results; ++r) arguments.y[r][i - begin] = total[r];
    }
  }

  /// Entries k to stop.
  [[gnu::always_inline]] static void add_one_by_one(double* total,
                                                    const ContractionArguments& arguments, int k,
                                                    int stop) {
    double a[table.matrices], x[table.components];
    for (; k < stop; ++k) {
      for (int c = 0; c < table.components; ++c) x[c] = arguments.x[c][arguments.inner[k]];
      for (int m = 0; m < table.matrices; ++m) a[m] = arguments.values[m][k];
      add(total, a, x);
    }
  }
};

template <int what, int dimension>
constexpr ContractionFunction function() {
  if constexpr (vector_operator_rows[what].by_dimension[dimension - 1].results == 0)
    return nullptr;
  else
    return Contract<what, dimension>::rows;
}

template <int... what>
ContractionKernels all(std::integer_sequence<int, what...>) {
  return {{{function<what, 1>(), function<what, 2>(), function<what, 3>()}...}};
}

}  // namespace

template <>
ContractionKernels contraction_kernels<GRADPSI_LANES>() {
  return all(std::make_integer_sequence<int, vector_operator_count>());
}

}  // namespace gradpsi
