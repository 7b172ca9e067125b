#pragma once

#include <Eigen/Core>

#include "gradpsi/assemble.hpp"
#include "parallel.hpp"

namespace gradpsi {

/// (A x)_i, in four sums that do not wait for one another.
inline double row_product(const SparseMatrix& A, int i, const double* x) {
  const double* const a = A.valuePtr();
  const int* const column = A.innerIndexPtr();
  int k = A.outerIndexPtr()[i];
  const int end = A.outerIndexPtr()[i + 1];
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  for (; k + 3 < end; k += 4) {
    s0 += a[k] * x[column[k]];
    s1 += a[k + 1] * x[column[k + 1]];
    s2 += a[k + 2] * x[column[k + 2]];
    s3 += a[k + 3] * x[column[k + 3]];
  }
  for (; k < end; ++k) s0 += a[k] * x[column[k]];
  return (s0 + s1) + (s2 + s3);
}

/// Calls f(i, (A x)_i) for each row, rows over threads.
template <class F>
void for_each_product(const SparseMatrix& A, const double* x, int threads, const F& f) {
  parallel_chunks(static_cast<int>(A.rows()), 4096, threads, [&A, x, &f](int begin, int end) {
    for (int i = begin; i < end; ++i) f(i, row_product(A, i, x));
  });
}

/// r = b - A x; its 2-norm.
inline double residual(const SparseMatrix& A, const double* b, const double* x, double* r,
                       int threads) {
  for_each_product(A, x, threads, [b, r](int i, double product) { r[i] = b[i] - product; });
  return Eigen::Map<const Eigen::VectorXd>(r, A.rows()).norm();
}

}  // namespace gradpsi
