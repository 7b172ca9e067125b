#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

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

// Eigen hands an inverse of this size to its blocked solvers, made for large matrices. Written out for
// a fixed size, all weights of a second-order Laplacian take a quarter less time in 2D, a sixth in 3D.

/// Replaces A, symmetric positive semidefinite, by its inverse (Cholesky); false if it is singular.
template <int M>
bool invert_definite(Eigen::Matrix<double, M, M>& A) {
  Eigen::Matrix<double, M, M> L;  // of A = L L^T, then its inverse; strictly upper part unused
  for (int j = 0; j < M; ++j) {
    double diagonal = A(j, j);
    for (int k = 0; k < j; ++k) diagonal -= L(j, k) * L(j, k);
    if (!(diagonal > 0)) return false;
    L(j, j) = std::sqrt(diagonal);
    for (int i = j + 1; i < M; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum / L(j, j);
    }
  }
  for (int j = 0; j < M; ++j) {
    L(j, j) = 1 / L(j, j);
    for (int i = j + 1; i < M; ++i) {
      double sum = 0;
      for (int k = j; k < i; ++k) sum -= L(i, k) * L(k, j);
      L(i, j) = sum / L(i, i);
    }
  }
  for (int j = 0; j < M; ++j)
    for (int i = j; i < M; ++i) {
      double sum = 0;
      for (int k = i; k < M; ++k) sum += L(k, i) * L(k, j);
      A(i, j) = A(j, i) = sum;
    }
  return true;
}

/// Replaces A by its inverse (Gauss-Jordan elimination with row pivoting); false if it is singular.
template <int M>
bool invert_general(Eigen::Matrix<double, M, M>& A) {
  std::array<int, M> exchanged;
  for (int k = 0; k < M; ++k) {
    int pivot = k;
    for (int i = k + 1; i < M; ++i)
      if (std::abs(A(i, k)) > std::abs(A(pivot, k))) pivot = i;
    if (!(std::abs(A(pivot, k)) > 0)) return false;
    exchanged[k] = pivot;
    if (pivot != k) A.row(k).swap(A.row(pivot));
    const double factor = 1 / A(k, k);
    A(k, k) = 1;
    A.row(k) *= factor;
    for (int i = 0; i < M; ++i) {
      if (i == k) continue;
      const double multiple = A(i, k);
      A(i, k) = 0;
      A.row(i) -= multiple * A.row(k);
    }
  }
  for (int k = M - 1; k >= 0; --k)
    if (exchanged[k] != k) A.col(k).swap(A.col(exchanged[k]));
  return true;
}

/// The inverse of a moment matrix, Definite meaning symmetric positive definite unless it is singular.
/// Solutions are columns of the inverse or sums of them, and its norm gives the condition number
/// exactly, so that one elimination serves both.
template <bool Definite, int M>
Inverse<M> invert(const Eigen::Matrix<double, M, M>& A) {
  Inverse<M> result{A, 0};
  if (!(Definite ? invert_definite(result.matrix) : invert_general(result.matrix))) return result;
  const double condition = one_norm(A) * one_norm(result.matrix);
  if (std::isfinite(condition)) result.reciprocal_condition = std::min(1 / condition, 1.0);
  return result;
}

}  // namespace gradpsi
