#include <Eigen/QR>

#include "dense.hpp"

namespace gradpsi {

Eigen::VectorXd least_squares_fit(const Eigen::MatrixXd& P, const Eigen::VectorXd& b) {
  return P * P.colPivHouseholderQr().solve(b);
}

}  // namespace gradpsi
