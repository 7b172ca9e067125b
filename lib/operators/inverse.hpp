#pragma once

#include "base/lanes.hpp"

namespace gradpsi {

// Inverses of matrices of doubles, or of vectors of doubles: then of one matrix a lane. `Matrix` has
// elements A(i, j). Nothing branches on a number, so that all lanes go one way. Each
// returns whether, lane by lane, the pivots were sound; if not, the matrix holds no inverse.

template <class Matrix>
using Element = decltype(+Matrix()(0, 0));

template <class T>
[[gnu::always_inline]] inline T magnitude(T x) {
  return x < 0 ? -x : x;
}

/// Replaces A, symmetric positive definite, by its inverse (Cholesky).
template <int M, class Matrix>
[[gnu::always_inline]] inline auto invert_definite(Matrix& A) {
  using T = Element<Matrix>;
  Matrix L;  // of A = L L^T, then its inverse; strictly upper part unused
  auto sound = A(0, 0) > 0;
  for (int j = 0; j < M; ++j) {
    T diagonal = A(j, j);
    for (int k = 0; k < j; ++k) diagonal -= L(j, k) * L(j, k);
    sound = sound & (diagonal > 0);
    const T root = square_root(diagonal);
    const T reciprocal = 1 / root;
    L(j, j) = root;
    for (int i = j + 1; i < M; ++i) {
      T sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum * reciprocal;
    }
  }
  for (int j = 0; j < M; ++j) {
    L(j, j) = 1 / L(j, j);
    for (int i = j + 1; i < M; ++i) {
      T sum = L(i, j) * L(j, j);
      for (int k = j + 1; k < i; ++k) sum += L(i, k) * L(k, j);
      L(i, j) = -sum / L(i, i);
    }
  }
  for (int j = 0; j < M; ++j)
    for (int i = j; i < M; ++i) {
      T sum = L(i, i) * L(i, j);
      for (int k = i + 1; k < M; ++k) sum += L(k, i) * L(k, j);
      A(i, j) = A(j, i) = sum;
    }
  return sound;
}

/// Replaces A by its inverse (Gauss-Jordan elimination with row pivoting).
template <int M, class Matrix>
[[gnu::always_inline]] inline auto invert_general(Matrix& A) {
  using T = Element<Matrix>;
  auto sound = A(0, 0) == A(0, 0);
  decltype(sound) exchanged[M][M] = {};
  const auto exchange = [](auto which, T& a, T& b) __attribute__((always_inline)) {
    const T old = a;
    a = which ? b : a;
    b = which ? old : b;
  };
  for (int k = 0; k < M; ++k) {
    for (int i = k + 1; i < M; ++i) {
      exchanged[k][i] = magnitude(A(i, k)) > magnitude(A(k, k));
      for (int c = 0; c < M; ++c) exchange(exchanged[k][i], A(k, c), A(i, c));
    }
    sound = sound & (magnitude(A(k, k)) > 0);
    const T factor = 1 / A(k, k);
    A(k, k) = T{} + 1;
    for (int c = 0; c < M; ++c) A(k, c) *= factor;
    for (int i = 0; i < M; ++i) {
      if (i == k) continue;
      const T multiple = A(i, k);
      A(i, k) = T{};
      for (int c = 0; c < M; ++c) A(i, c) -= multiple * A(k, c);
    }
  }
  for (int k = M - 1; k >= 0; --k)
    for (int i = M - 1; i > k; --i)
      for (int r = 0; r < M; ++r) exchange(exchanged[k][i], A(r, k), A(r, i));
  return sound;
}

/// The largest column sum of magnitudes.
template <int M, class Matrix>
[[gnu::always_inline]] inline auto one_norm(const Matrix& A) {
  using T = Element<Matrix>;
  T norm{};
  for (int j = 0; j < M; ++j) {
    T sum{};
    for (int i = 0; i < M; ++i) sum += magnitude(T(A(i, j)));
    norm = norm < sum ? sum : norm;
  }
  return norm;
}

}  // namespace gradpsi
