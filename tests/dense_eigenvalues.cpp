#include <Eigen/Eigenvalues>

#include "dense.hpp"

namespace gradpsi {

Eigen::VectorXd dense_eigenvalues(const Eigen::MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(symmetric, Eigen::EigenvaluesOnly)
      .eigenvalues();
}

}  // namespace gradpsi
