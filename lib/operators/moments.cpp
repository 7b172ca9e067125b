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
  return judged(A, factor.solve(Eigen::MatrixXd::Identity(A.rows(), A.cols())));
}

Inverse invert_general(const Eigen::MatrixXd& A) { return judged(A, A.partialPivLu().inverse()); }

Eigen::MatrixXd moments(const Columns& weight, const Columns& p, const Columns& t,
                        Columns weighted) {
  const bool symmetric = p.data() == t.data();
  const Eigen::Index m = t.cols();
  weighted = p.colwise() * weight.col(0);
  Eigen::MatrixXd A(m, m);
  for (Eigen::Index l = 0; l < m; ++l)
    for (Eigen::Index k = 0; k < m; ++k)
      A(k, l) = symmetric && k < l ? A(l, k) : (weighted.col(k) * t.col(l)).sum();
  return A;
}

}  // namespace gradpsi
