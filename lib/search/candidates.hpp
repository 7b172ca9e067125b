#pragma once

#include "base/cpu.hpp"

namespace gradpsi {

// The vector code behind the neighbour search: points as structure of arrays, tested W at a time. What
// is found is written in the order it was in. Loads reach up to 8 elements past the end, where arrays
// must have room (and `select` and `nearest` want points at infinity); so do stores.

/// Copies the points begin to end that lie in [low, high], moved by `shift`; returns how many.
using FilterFunction = int (*)(const double* const* x, const int* number, int begin, int end,
                               const double* low, const double* high, const double* shift,
                               double* const* to_x, int* to_number);

/// Writes the numbers of the points at 0 < r < h from `centre`; adds those at r = 0 to `coincident`.
using SelectFunction = int (*)(const double* const* x, const int* number, int count,
                               const double* centre, double squared_support, int* found,
                               int* coincident);

/// The least squared distance from `centre` to a point other than number `self`; infinity if there is none.
using NearestFunction = double (*)(const double* const* x, const int* number, int count,
                                   const double* centre, int self);

/// The rank-th least of some values, 1 being the least, in count^2 steps; infinity if there are fewer.
/// Infinite ones follow them.
using RankedFunction = double (*)(const double* values, int count, int rank);

/// By dimension - 1.
struct CandidateKernels {
  FilterFunction filter[3];
  SelectFunction select[3];
  NearestFunction nearest[3];
  RankedFunction ranked;  ///< of any dimension
};

template <int W>
CandidateKernels candidate_kernels();
template <>
CandidateKernels candidate_kernels<2>();
template <>
CandidateKernels candidate_kernels<4>();
template <>
CandidateKernels candidate_kernels<8>();

/// Those for this kind of processor.
inline CandidateKernels candidate_kernels(const Cpu& cpu) {
  return at_width(cpu, [](auto W) { return candidate_kernels<W>(); });
}

}  // namespace gradpsi
