#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "base/parallel.hpp"
#include "gradpsi/matrix.hpp"
#include "gradpsi/spmv.hpp"
#include "matrix/products.hpp"

namespace gradpsi {

/// A x for the vector code.
template <class Value>
ProductArguments<Value> product_arguments(const Eigen::SparseMatrix<Value, Eigen::RowMajor, int>& A,
                                          const double* x, double* y) {
  return {A.outerIndexPtr(),
          A.innerIndexPtr(),
          static_cast<int>(A.nonZeros()),
          {A.valuePtr()},
          {x},
          {y}};
}

/// Rows begin to end of A x.
inline void rows_product(const SparseMatrix& A, int begin, int end, const double* x, double* y) {
  product_kernels(gathering_cpu()).vectors[0](product_arguments(A, x, y), begin, end);
}

/// The same with values of single precision.
inline void rows_product(const SingleSparseMatrix& A, int begin, int end, const double* x,
                         double* y) {
  product_kernels(gathering_cpu()).single(product_arguments(A, x, y), begin, end);
}

/// (A x)_i
inline double row_product(const SparseMatrix& A, int i, const double* x) {
  double y;
  rows_product(A, i, i + 1, x, &y);
  return y;
}

/// Calls f(i, (A x)_i) for each row, rows over threads.
template <class Matrix, class F>
void for_each_product(const Matrix& A, const double* x, int threads, const F& f) {
  constexpr int block = 256;  // rows, whose products stay in the cache
  parallel_chunks(static_cast<int>(A.rows()), 16 * block, threads, [&A, x, &f](int begin, int end) {
    double products[block];
    for (int first = begin; first < end; first += block) {
      const int last = std::min(first + block, end);
      rows_product(A, first, last, x, products);
      for (int i = first; i < last; ++i) f(i, products[i - first]);
    }
  });
}

/// r = b - A x; its 2-norm.
inline double residual(const SparseMatrix& A, const double* b, const double* x, double* r,
                       int threads) {
  for_each_product(A, x, threads, [b, r](int i, double product) { r[i] = b[i] - product; });
  return Eigen::Map<const Eigen::VectorXd>(r, A.rows()).norm();
}

}  // namespace gradpsi
