#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "operators/basis.hpp"
#include "operators/inverse.hpp"

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

/// The inverse of a moment matrix, Definite meaning symmetric positive definite unless it is singular.
/// Solutions are columns of the inverse or sums of them, and its norm gives the condition number
/// exactly, so that one elimination serves both.
template <bool Definite, int M>
Inverse<M> invert(const Eigen::Matrix<double, M, M>& A) {
  Inverse<M> result{A, 0};
  if (!(Definite ? invert_definite<M>(result.matrix) : invert_general<M>(result.matrix)))
    return result;
  const double condition = one_norm<M>(A) * one_norm<M>(result.matrix);
  if (std::isfinite(condition)) result.reciprocal_condition = std::min(1 / condition, 1.0);
  return result;
}

}  // namespace gradpsi
