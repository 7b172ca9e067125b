#pragma once

#include "base/cpu.hpp"
#include "gradpsi/kernel.hpp"
#include "schemes/forms.hpp"
#include "schemes/kernels.hpp"

namespace gradpsi {

// Rows of second and lower order, several at a time: the vector code behind assemble(). Neighbours are
// worked on W at a time, then the moment systems of W rows together.

/// The highest degree of least squares; beyond it, matrices have over fifty rows.
constexpr int highest_batched_degree(int dimension) { return dimension == 3 ? 4 : 6; }

/// The cloud and its kernel, as plain arrays.
struct BatchPoints {
  const double* x;        // n x D
  const double* volumes;  // n
  double box[3];          // 0: open
  int kernel;             // its number among VectorKernels; -1: only its function is known
  Profile (*profile)(double);
  double normalisation;    // s_d
  const double* supports;  // one, or n
  bool one_support;
  bool have_skin;  // lists: not all that are in them have a weight
};

/// Where the rows of one matrix, or of several on one pattern, are.
struct BatchRows {
  const int* outer;   // row k holds entries outer[k] to outer[k + 1], the diagonal among them
  const int* inner;   // their columns
  const int* points;  // row k is about points[k]; null: k
  int* neighbours;    // written: how many the rows of this call have, in their order
};

/// The most matrices of one system, as many as a value has first and second derivatives, with the value and
/// the Laplacian beside them.
inline constexpr int most_outputs = 11;

/// What is asked of each row: matrices of one system of equations.
struct BatchSystem {
  How how;
  Form form;
  int degree;  // of the form's functions
  Phi phi;
  bool fitted;          // functions are centred, the point's own value among those that count
  int given_power;      // How::Given: weights want h to this power as a factor
  double diagonal;      // what it is times the sum of the others
  double limit;         // least reciprocal condition number of the matrix
  double scaled_limit;  // and of it after scaling its diagonal to 1, where it is definite
  int outputs, term_count;
  double* values[most_outputs];  // of each matrix, entry by entry
  int orders[most_outputs];      // of its derivative; 0: the value, whose rows sum up to 1
  Term terms[2 * most_outputs];
  double* reciprocal_condition;  // one a row, of the matrix as it is
  // Of the rows of this call, in their order, whether the values can be used; others are left half done.
  unsigned char* solved;
};

/// Does what is asked for the rows order[0] .. order[count - 1] (null: first, first + 1, ..).
/// `memory` has room for batch_memory() doubles, aligned to 64 bytes.
using BatchFunction = void (*)(const BatchPoints& points, const BatchRows& rows, const int* order,
                               int first, int count, const BatchSystem* systems, int system_count,
                               int most_entries, double* memory);

/// 1 / sum_j W_ij, j = i included, of rows order[0] .. order[count - 1], in units of h^d / s_d.
using DensityFunction = void (*)(const BatchPoints& points, const int* offsets, const int* indices,
                                 const int* order, int first, int count, double* volumes);

struct BatchKernels {
  BatchFunction solve[3];  // by dimension - 1
  DensityFunction density[3];
};

/// Room for W = 8 rows of up to `most_entries` entries, in columns of that length: each row's own, their
/// weights in all outputs, and the monomials of one of them, up to 34, plain and weighted.
constexpr long batch_memory(int dimension, int most_entries, int outputs) {
  const long row = dimension + 5, weights = outputs;
  return (8 * (row + weights) + 2 * 34) * ((most_entries + 7) / 8 * 8);
}

template <int W>
BatchKernels batch_kernels();
template <>
BatchKernels batch_kernels<2>();
template <>
BatchKernels batch_kernels<4>();
template <>
BatchKernels batch_kernels<8>();

/// Those for this kind of processor.
inline BatchKernels batch_kernels(const Cpu& cpu) {
  return at_width(cpu, [](auto W) { return batch_kernels<W>(); });
}

}  // namespace gradpsi
