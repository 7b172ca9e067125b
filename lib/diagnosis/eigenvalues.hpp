#pragma once

#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// All eigenvalues of A (n x n), by a dense method, O(n^3).
/// @throws SolverError  if the iteration does not converge
ComplexVector eigenvalues(const SparseMatrix& A);

/// The same of a matrix that is symmetric when its rows are scaled by volumes: faster and more accurate.
DenseVector eigenvalues(const SparseMatrix& A, const VectorView& volumes);

}  // namespace gradpsi
