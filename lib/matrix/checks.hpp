#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// Whether a sum is zero up to the rounding of terms whose magnitudes add up to `size`.
inline bool vanishes(double sum, double size) {
  return std::abs(sum) <= 100 * std::numeric_limits<double>::epsilon() * size;
}

/// What the entries of a row add up to, and their magnitudes.
struct RowSum {
  double sum = 0, size = 0;
  bool vanishes() const { return gradpsi::vanishes(sum, size); }
};
inline RowSum row_sum(const SparseMatrix& A, int i) {
  RowSum result;
  for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
    result.sum += a.value();
    result.size += std::abs(a.value());
  }
  return result;
}

/// For each row whether it sums to zero.
inline std::vector<char> vanishing_rows(const SparseMatrix& A) {
  std::vector<char> result(A.rows());
  for (int i = 0; i < A.rows(); ++i) result[i] = row_sum(A, i).vanishes();
  return result;
}

/// Whether diag(scale) A is symmetric: entries (i, j) and (j, i) differ by at most 1e-12 of the
/// geometric mean of the diagonal's i and j.
bool is_symmetric(const SparseMatrix& A, const VectorView& scale, int threads = 1);

/// Whether every diagonal entry is at least the sum of the magnitudes of the others in its row, up to
/// 1e-12 of it: by Gershgorin, if A is symmetric after scaling its rows, no eigenvalue is negative.
/// @param diagonal  the column of each row's diagonal entry, if these are some of a matrix's rows
bool is_dominant(const SparseMatrix& A, std::span<const int> diagonal = {}, int threads = 1);

/// Whether two matrices, the second one compressed, have the same pattern and are so both.
bool share_pattern(const SparseMatrix& A, const SparseMatrix& B);

/// Rows whose diagonal entry has not the sign that most have, ascending. In the matrix of an implicit step they are
/// where a field grows faster than the step is short.
std::vector<int> reversed_rows(const SparseMatrix& A);

/// Rows connected with one another, and with no others, that all sum to zero: constants on them
/// are in the null space.
struct FloatingRows {
  int first = -1;  ///< the lowest of the first such set; -1: there is none
  int count = 0;   ///< how many there are in it
};
FloatingRows floating_rows(const SparseMatrix& A);

}  // namespace gradpsi
