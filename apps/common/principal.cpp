#include "common/principal.hpp"

#include <Eigen/Eigenvalues>

namespace gradpsi::apps {

PrincipalAxes principal_axes(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace gradpsi::apps
