#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "basis.hpp"

namespace gradpsi {

/// sum_j weight_j p_k(j) t_l(j) for each column k of p and l of t, which are the same if Symmetric.
/// `weighted` is memory for weight times p.
template <bool Symmetric, int M>
Eigen::Matrix<double, M, M> moments(const Columns& weight, const Columns& p, const Columns& t,
                                    Columns weighted) {
  weighted = p.colwise() * weight.col(0);
  Eigen::Matrix<double, M, M> A;
  for (int l = 0; l < M; ++l)
    for (int k = 0; k < M; ++k)
      A(k, l) = Symmetric && k < l ? A(l, k) : (weighted.col(k) * t.col(l)).sum();
  return A;
}

template <int M>
struct Inverse {
  Eigen::Matrix<double, M, M> matrix;
  double reciprocal_condition;  // 1-norm; 0 if singular
};

template <class Matrix>
double one_norm(const Matrix& A) {
  return A.cwiseAbs().colwise().sum().maxCoeff();
}

/// The inverse of a moment matrix, by Cholesky if Definite (symmetric positive definite unless it
/// is singular), else by LU with partial pivoting. Solutions are columns of the inverse or sums of
/// them, and its norm gives the condition number exactly, so that one elimination serves both.
template <bool Definite, int M>
Inverse<M> invert(const Eigen::Matrix<double, M, M>& A) {
  using Matrix = Eigen::Matrix<double, M, M>;
  Inverse<M> result{Matrix::Identity(), 0};
  if constexpr (Definite) {
    const Eigen::LLT<Matrix> cholesky(A);
    if (cholesky.info() != Eigen::Success) return result;
    cholesky.solveInPlace(result.matrix);
  } else {
    result.matrix = Eigen::PartialPivLU<Matrix>(A).solve(Matrix::Identity());
  }
  const double condition = one_norm(A) * one_norm(result.matrix);
  if (std::isfinite(condition)) result.reciprocal_condition = std::min(1 / condition, 1.0);
  return result;
}

}  // namespace gradpsi
