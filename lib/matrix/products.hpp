#pragma once

#include "base/cpu.hpp"

namespace gradpsi {

// The vector code behind the sparse products.

/// Up to three matrices of one pattern, and up to four vectors.
template <class Value>
struct ProductArguments {
  const int* outer;
  const int* inner;
  int entries;  // of the whole matrix, beyond which nothing is read
  const Value* values[3];
  const double* x[4];
  double* y[4];  // of several matrices and one vector, or of one matrix and several vectors
};

/// Rows begin to end of the products; y[..][0] is row `begin`.
template <class Value>
using ProductFunction = void (*)(const ProductArguments<Value>& arguments, int begin, int end);

struct ProductKernels {
  ProductFunction<double> vectors[4];   // one matrix, 1 to 4 vectors
  ProductFunction<double> matrices[3];  // 1 to 3 matrices, one vector
  ProductFunction<float> single;        // one matrix, one vector
};

template <int W>
ProductKernels product_kernels();
template <>
ProductKernels product_kernels<2>();
template <>
ProductKernels product_kernels<4>();
template <>
ProductKernels product_kernels<8>();

/// Those for this kind of processor.
inline ProductKernels product_kernels(const Cpu& cpu) {
  return at_width(cpu, [](auto W) { return product_kernels<W>(); });
}

}  // namespace gradpsi
