// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "matrix/products.hpp"

#include "matrix/gather.hpp"

namespace gradpsi {
namespace {

constexpr int W = GRADPSI_LANES;
using V = Lanes<W>;

[[gnu::always_inline]] inline V values(const double* a) { return load<W>(a); }
[[gnu::always_inline]] inline V values(const float* a) {
  typedef float Single __attribute__((vector_size(W * sizeof(float))));
  Single v;
  __builtin_memcpy(&v, a, sizeof v);
  return __builtin_convertvector(v, V);
}

template <int matrices, int vectors, class Value>
void product(const ProductArguments<Value>& arguments, int begin, int end) {
  constexpr int products = matrices * vectors;
  constexpr int sums = products == 1 ? 2 : 1;  // so that additions need not wait for one another
  constexpr int step = sums * W;
  const int* const inner = arguments.inner;
  for (int i = begin; i < end; ++i) {
    V sum[sums][products] = {};
    int k = arguments.outer[i];
    const int stop = arguments.outer[i + 1];
    for (; k + step <= stop; k += step)
      for (int s = 0; s < sums; ++s)
        for (int v = 0; v < vectors; ++v) {
          const V x = gather<W>(arguments.x[v], inner + k + s * W);
          for (int m = 0; m < matrices; ++m)
            sum[s][m * vectors + v] += values(arguments.values[m] + k + s * W) * x;
        }
    // The rest at once, together with what follows and does not count: a loop over it would end at
    // another place in each row, which no processor can foresee.
    const bool at_once = k < stop && k + step <= arguments.entries;
    for (int s = 0; at_once && s < sums; ++s)
      for (int v = 0; v < vectors; ++v) {
        const auto counts = first_lanes<W>(stop - k - s * W);
        const V x = gather<W>(arguments.x[v], inner + k + s * W);
        for (int m = 0; m < matrices; ++m) {
          const V a = values(arguments.values[m] + k + s * W);
          sum[s][m * vectors + v] += only<W>(counts, a) * only<W>(counts, x);
        }
      }
    for (int p = 0; p < products; ++p) {
      double total = sum_of_lanes(sums == 2 ? sum[0][p] + sum[sums - 1][p] : sum[0][p]);
      if (!at_once)
        for (int l = k; l < stop; ++l)
          total += arguments.values[p / vectors][l] * arguments.x[p % vectors][inner[l]];
      arguments.y[p][i - begin] = total;
    }
  }
}

}  // namespace

template <>
ProductKernels product_kernels<GRADPSI_LANES>() {
  return {
      {product<1, 1, double>, product<1, 2, double>, product<1, 3, double>, product<1, 4, double>},
      {product<1, 1, double>, product<2, 1, double>, product<3, 1, double>},
      product<1, 1, float>};
}

}  // namespace gradpsi
