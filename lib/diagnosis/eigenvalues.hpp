#pragma once

#include <Eigen/Core>

#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// All eigenvalues of A (n x n), by a dense method, O(n^3).
/// @throws SolverError  if the iteration does not converge
Eigen::VectorXcd eigenvalues(const SparseMatrix& A);

/// The same of a matrix that is symmetric when its rows are scaled by volumes: faster and more accurate.
Eigen::VectorXd eigenvalues(const SparseMatrix& A, const Eigen::VectorXd& volumes);

}  // namespace gradpsi
