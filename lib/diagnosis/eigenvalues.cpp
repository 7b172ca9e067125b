#include "diagnosis/eigenvalues.hpp"

#include <Eigen/Eigenvalues>

#include "gradpsi/error.hpp"

namespace gradpsi {

ComplexVector eigenvalues(const SparseMatrix& A) {
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(Eigen::MatrixXd(A), false);
  if (solver.info() != Eigen::Success) throw SolverError("the eigenvalues did not converge");
  return solver.eigenvalues();
}

DenseVector eigenvalues(const SparseMatrix& A, const VectorView& volumes) {
  // diag(v)^(1/2) A diag(v)^(-1/2) has the eigenvalues of A.
  const DenseVector root = volumes.cwiseSqrt();
  const Eigen::MatrixXd symmetric =
      root.asDiagonal() * Eigen::MatrixXd(A) * root.cwiseInverse().asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

}  // namespace gradpsi
