#include "dense.hpp"

#include <Eigen/LU>

namespace gradpsi {

Eigen::MatrixXd dense_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) { return A * B; }

Eigen::MatrixXd dense_inverse(const Eigen::MatrixXd& A) { return A.fullPivLu().inverse(); }

Eigen::MatrixXd dense_solution(const Eigen::MatrixXd& A, const Eigen::MatrixXd& b) {
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(A);
  return lu.isInvertible() ? Eigen::MatrixXd(lu.solve(b)) : Eigen::MatrixXd();
}

}  // namespace gradpsi
