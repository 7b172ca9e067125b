#include "solve/smoother.hpp"

#include <cmath>

#include "base/parallel.hpp"
#include "solve/for_petsc.hpp"

namespace gradpsi {
namespace {

constexpr double damping = 0.9;
constexpr double weakest = 0.45;  // of a row's magnitudes, that its diagonal counts as at least
constexpr double weak = 0.3;  // of them, less than which makes a row one that cannot be smoothed

}  // namespace

Smoother smoother(const SparseMatrix& A, const std::vector<int>& diagonal, int threads) {
  const int n = static_cast<int>(A.rows());
  Smoother result{DenseVector::Zero(n), DenseVector(n), std::vector<char>(n)};
  parallel_chunks(n, 4096, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      double own = 0, size = 0;
      for (SparseMatrix::InnerIterator a(A, k); a; ++a) {
        size += std::abs(a.value());
        if (a.col() == diagonal[k]) own = a.value();
      }
      result.diagonal[k] = own;
      result.is_weak[k] = own < weak * size;
      result.step[k] = damping / (std::abs(own) < weakest * size ? weakest * size : own);
    }
  });
  return result;
}

}  // namespace gradpsi
