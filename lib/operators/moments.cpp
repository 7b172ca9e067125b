#include "operators/moments.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace gradpsi {
namespace {

Inverse judged(const Eigen::MatrixXd& A, Eigen::MatrixXd inverse) {
  const double condition = one_norm(A) * one_norm(inverse);
  return {std::move(inverse), std::isfinite(condition) ? std::min(1 / condition, 1.0) : 0};
}

}  // namespace

double one_norm(const Eigen::MatrixXd& A) {
  double norm = 0;
  for (Eigen::Index k = 0; k < A.cols(); ++k) {
    const double sum = A.col(k).cwiseAbs().sum();
    if (!(sum <= norm)) norm = sum;  // NaN, too
  }
  return norm;
}

Inverse invert_definite(const Eigen::MatrixXd& A) {
  const Eigen::LLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) return {{}, 0};
  // Of A = L L^T the inverse is L^-T L^-1, of which half is enough.
  const Eigen::MatrixXd half =
      factor.matrixL().solve(Eigen::MatrixXd::Identity(A.rows(), A.cols()));
  Eigen::MatrixXd inverse(A.rows(), A.cols());
  inverse.triangularView<Eigen::Lower>() = half.transpose() * half;
  inverse.triangularView<Eigen::StrictlyUpper>() = inverse.transpose();
  return judged(A, std::move(inverse));
}

Inverse invert_general(const Eigen::MatrixXd& A) { return judged(A, A.partialPivLu().inverse()); }

Eigen::MatrixXd moments(const Columns& weight, const Columns& p, const Columns& t,
                        Columns weighted) {
  weighted = p.colwise() * weight.col(0);
  if (p.data() != t.data()) return weighted.matrix().transpose().lazyProduct(t.matrix());
  Eigen::MatrixXd A(t.cols(), t.cols());
  A.triangularView<Eigen::Lower>() = weighted.matrix().transpose() * t.matrix();
  A.triangularView<Eigen::StrictlyUpper>() = A.transpose();
  return A;
}

}  // namespace gradpsi
