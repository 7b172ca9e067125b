#pragma once

#include "base/cpu.hpp"

namespace gradpsi {

// Bounds of what rows make of waves, W rows at a time: the vector code behind certified_errors(). Lengths are in
// units of 1 / |k|, s = |k| r, weights in units of |k|^q.

/// A monomial s^alpha / alpha!.
struct Monomial {
  int powers[3];     // alpha
  double factorial;  // alpha!
};

/// Those of one degree m.
struct DegreeTable {
  int count;
  const Monomial* monomials;
  const double* asked;          // count x outputs: what the target makes of them
  const double* at_directions;  // directions x count: s^alpha of unit vectors
  double factorial;             // m!
  double slack;  // by how much the worst direction may be worse than these; infinity: nobody knows
};

/// How many degrees there are at most, 0 among them.
inline constexpr int most_degrees = 15;

/// What all rows have in common.
struct BoundTables {
  int order, outputs;  // of the derivative
  int highest;         // degree
  int directions;
  const DegreeTable* degrees;  // 0 to `highest`
};

/// The most outputs that a derivative has, six second ones.
inline constexpr int most_components = 6;

/// Rows of a matrix, or of several on one pattern.
struct BoundRows {
  const double* x;  // n x D
  double box[3];    // 0: open
  const int* outer;
  const int* inner;
  const int* points;  // row k is about points[k]; null: k
  const double* values[most_components];
  const double* wavelengths;  // one, or n
  bool one_wavelength;
  double tolerance;  // see bounded_errors()
};

/// Writes errors[k] of each row k = rows[0] .. rows[count - 1]. `memory` has room for bound_memory() doubles.
using BoundFunction = void (*)(const BoundTables& tables, const BoundRows& op, const int* rows,
                               int count, int most_entries, double* errors, double* memory);

/// By dimension - 1.
struct BoundKernels {
  BoundFunction of[3];
};

/// Room for W = 8 rows of up to `most_entries` entries: powers, weights, lengths, and defects of all degrees.
constexpr long bound_memory(int dimension, const BoundTables& tables, int most_entries) {
  long all = 0;
  for (int m = 0; m <= tables.highest; ++m) all += tables.degrees[m].count;
  return 8 * (most_entries * (dimension * (tables.highest + 1L) + tables.outputs + 2) +
              all * tables.outputs);
}

template <int W>
BoundKernels bound_kernels();
template <>
BoundKernels bound_kernels<2>();
template <>
BoundKernels bound_kernels<4>();
template <>
BoundKernels bound_kernels<8>();

/// Those for this kind of processor.
inline BoundKernels bound_kernels(const Cpu& cpu) {
  return at_width(cpu, [](auto W) { return bound_kernels<W>(); });
}

}  // namespace gradpsi
