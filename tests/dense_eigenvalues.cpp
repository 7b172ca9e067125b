#include <Eigen/Eigenvalues>

#include "dense.hpp"

namespace gradpsi {

Eigen::VectorXd dense_eigenvalues(const Eigen::MatrixXd& symmetric) {
  // In one call Eigen's solver instantiates the vectors, too, which takes long to compile.
  const Eigen::Tridiagonalization<Eigen::MatrixXd> tridiagonal(symmetric);
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(tridiagonal.diagonal(), tridiagonal.subDiagonal(),
                                Eigen::EigenvaluesOnly);
  return solver.eigenvalues();
}

}  // namespace gradpsi
