#pragma once

#include "base/cpu.hpp"
#include "calculus/contractions.hpp"

namespace gradpsi {

// The vector code behind operators on vectors.

struct ContractionArguments {
  const int* outer;
  const int* inner;
  int entries;              // of a whole matrix, beyond which nothing is read
  const double* values[6];  // of the matrices
  const double* x[3];       // the components
  double* y[9];             // the results
};

/// Rows begin to end; y[..][0] is row `begin`.
using ContractionFunction = void (*)(const ContractionArguments& arguments, int begin, int end);

/// By the place in vector_operator_rows and the dimension less one; null where there is no such operator.
struct ContractionKernels {
  ContractionFunction of[vector_operator_count][3];
};

template <int W>
ContractionKernels contraction_kernels();
template <>
ContractionKernels contraction_kernels<2>();
template <>
ContractionKernels contraction_kernels<4>();
template <>
ContractionKernels contraction_kernels<8>();

/// Those for this kind of processor.
inline ContractionKernels contraction_kernels(const Cpu& cpu) {
  return at_width(cpu, [](auto W) { return contraction_kernels<W>(); });
}

}  // namespace gradpsi
