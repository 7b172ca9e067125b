#include "diagnosis/eigenvalues.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "gradpsi/error.hpp"

// Eigen's solvers in one call instantiate the vectors, too, which takes three quarters of the time to compile.
namespace gradpsi {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

void require_converged(Eigen::ComputationInfo info) {
  if (info != Eigen::Success) throw SolverError("the eigenvalues did not converge");
}

/// Divides by the largest entry, so that no square of one overflows.
double scale(MatrixXd& A) {
  const double largest = A.cwiseAbs().maxCoeff();
  if (largest < std::numeric_limits<double>::min()) return 1;
  A /= largest;
  return largest;
}

/// Of a real Schur form: numbers on the diagonal, and pairs in blocks of two rows.
ComplexVector of_blocks(const MatrixXd& T) {
  ComplexVector values(T.rows());
  for (Index i = 0; i < T.rows(); ++i) {
    if (i + 1 == T.rows() || T(i + 1, i) == 0) {
      values[i] = T(i, i);
      continue;
    }
    const double half = (T(i, i) - T(i + 1, i + 1)) / 2;
    const double width = std::sqrt(std::abs(half * half + T(i, i + 1) * T(i + 1, i)));
    values[i] = {T(i + 1, i + 1) + half, width};
    values[i + 1] = std::conj(values[i]);
    ++i;
  }
  return values;
}

}  // namespace

ComplexVector eigenvalues(const SparseMatrix& A) {
  MatrixXd scaled(A);
  const double unit = scale(scaled);
  const MatrixXd hessenberg = Eigen::HessenbergDecomposition<MatrixXd>(scaled).matrixH();
  Eigen::RealSchur<MatrixXd> schur(A.rows());
  schur.computeFromHessenberg(hessenberg, MatrixXd(), false);
  require_converged(schur.info());
  return unit * of_blocks(schur.matrixT());
}

DenseVector eigenvalues(const SparseMatrix& A, const VectorView& volumes) {
  // diag(v)^(1/2) A diag(v)^(-1/2) has the eigenvalues of A.
  const DenseVector root = volumes.cwiseSqrt();
  MatrixXd symmetric = root.asDiagonal() * MatrixXd(A) * root.cwiseInverse().asDiagonal();
  const double unit = scale(symmetric);
  const Eigen::Tridiagonalization<MatrixXd> tridiagonal(symmetric);
  Eigen::SelfAdjointEigenSolver<MatrixXd> solver;
  solver.computeFromTridiagonal(tridiagonal.diagonal(), tridiagonal.subDiagonal(),
                                Eigen::EigenvaluesOnly);
  require_converged(solver.info());
  return unit * solver.eigenvalues();
}

}  // namespace gradpsi
