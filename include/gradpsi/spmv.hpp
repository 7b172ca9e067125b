#pragma once

#include <span>

#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// @name Sparse products
/// They are limited by the reading of the matrix: 12 bytes an entry, for the operators of many points, and
/// by how far apart in memory neighbours are (see reorder()). All results are bitwise the same with any
/// number of threads. Matrices must be compressed, as assemble() makes them, x finite for a finite result;
/// nothing is allocated once results have their size. `threads` 0: as many as OpenMP offers.
///
/// @throws InvalidInput  (all of them) if sizes disagree, a matrix is not compressed, `threads` is out of
///   range, or a result is an argument at the same time
/// @{

/// y = A x.
void multiply(const SparseMatrix& A, const VectorView& x, Result<1> y, int threads = 0);

/// Y = A X, several right-hand sides (n x k, one a column) with one reading of the matrix per four.
void multiply(const SparseMatrix& A, const MatrixView& X, Result<Eigen::Dynamic> Y,
              int threads = 0);

/// Column a of Y = axes[a] x (n x axes): matrices that share their pattern, as those of a gradient or a
/// Hessian do, with one reading of the pattern per three.
/// @throws InvalidInput  if the matrices have different numbers of entries or rows
void multiply(std::span<const SparseMatrix> axes, const VectorView& x, Result<Eigen::Dynamic> Y,
              int threads = 0);

/// Values of single precision, 8 bytes an entry: what A.cast<float>() gives.
using SingleSparseMatrix = Eigen::SparseMatrix<float, Eigen::RowMajor, int>;

/// y = A x with values of single precision and sums of double: an error of 6e-8 of sum |a| |x| a row.
void multiply(const SingleSparseMatrix& A, const VectorView& x, Result<1> y, int threads = 0);

/// y = A x for a symmetric A of which `upper` holds the upper triangle, with the diagonal: half the
/// bytes. Allocates, since each part of the rows adds to later rows of the others: 8 bytes times the
/// rows that the part reaches to, which is much for points in random order.
void multiply_symmetric(const SparseMatrix& upper, const VectorView& x, Result<1> y,
                        int threads = 0);

/// @}

}  // namespace gradpsi
#pragma GCC visibility pop
