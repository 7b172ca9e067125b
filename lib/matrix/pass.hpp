#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>

#include "base/parallel.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/matrix.hpp"

namespace gradpsi {

// What products have in common: checks of what they are given, and the parts of the rows that threads take.

template <class Matrix>
void check_product(const Matrix& A, Eigen::Index x, int threads) {
  checked_threads(threads);
  if (!A.isCompressed()) throw InvalidInput("the matrix is not compressed");
  if (A.cols() != x)
    throw InvalidInput("the vector has " + std::to_string(x) + " entries for " +
                       std::to_string(A.cols()) + " columns");
}

inline void check_apart(const double* x, const double* y) {
  if (x == y && x) throw InvalidInput("a product cannot be written over its argument");
}

/// As far as that can be told without reading the patterns.
inline void check_share_pattern(std::span<const SparseMatrix> matrices) {
  for (const SparseMatrix& A : matrices)
    if (A.rows() != matrices.front().rows() || A.cols() != matrices.front().cols() ||
        A.nonZeros() != matrices.front().nonZeros())
      throw InvalidInput("the matrices do not share their pattern");
}

/// Whether they have the same entries, each compared.
inline bool same_pattern(const SparseMatrix& A, const SparseMatrix& B) {
  return A.rows() == B.rows() && A.cols() == B.cols() && A.nonZeros() == B.nonZeros() &&
         std::equal(A.outerIndexPtr(), A.outerIndexPtr() + A.rows(), B.outerIndexPtr()) &&
         std::equal(A.innerIndexPtr(), A.innerIndexPtr() + A.nonZeros(), B.innerIndexPtr());
}

template <class Matrix>
int entries(const Matrix& A) {
  return static_cast<int>(A.nonZeros());
}

/// Calls body(begin, end) on ranges of rows of about as many entries.
template <class Matrix, class Body>
void parallel_rows(const Matrix& A, int threads, const Body& body) {
  constexpr int entries_per_chunk = 1 << 16;
  const int* const outer = A.outerIndexPtr();
  const int rows = static_cast<int>(A.rows());
  const int parts = std::max(1, entries(A) / entries_per_chunk);
  const auto first_row = [&](int part) {
    if (part == parts) return rows;
    const auto entry = static_cast<int>(std::int64_t{entries(A)} * part / parts);
    return static_cast<int>(std::lower_bound(outer, outer + rows, entry) - outer);
  };
  parallel_chunks(parts, 1, threads, [&](int part, int) {
    const int begin = part == 0 ? 0 : first_row(part), end = first_row(part + 1);
    if (begin < end) body(begin, end);
  });
}

}  // namespace gradpsi
