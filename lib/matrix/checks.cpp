#include "matrix/checks.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "base/sets.hpp"

namespace gradpsi {
namespace {

constexpr int rows_per_chunk = 4096;
constexpr double tolerance = 1e-12;  // of differences, over diagonals

/// Whether S x = S^T x for some x without a pattern, S = diag(scale) A without its diagonal: then S is symmetric, as
/// rows' differences from their columns would all have to cancel. In one pass over A in which nothing is searched for.
bool products_agree(const SparseMatrix& A, const VectorView& scale, const DenseVector& size,
                    int threads) {
  const int n = static_cast<int>(A.rows());
  const int parts = std::clamp(n / rows_per_chunk, 1, checked_threads(threads));
  const auto first = [&](int part) { return static_cast<int>(std::int64_t{n} * part / parts); };
  DenseVector x(n);
  for (int i = 0; i < n; ++i) x[i] = 1 + std::fmod(0.6180339887498949 * (i + 1), 1.0);
  DenseMatrix differences =
      DenseMatrix::Zero(n, parts);  // S x - S^T x, what each part knows of them
  parallel_chunks(parts, 1, threads, [&](int part, int) {
    double* const difference = differences.col(part).data();
    for (int i = first(part); i < first(part + 1); ++i) {
      double own = 0;
      for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
        if (a.col() == i) continue;
        const double entry = scale[i] * a.value();
        own += entry * x[a.col()];
        difference[a.col()] -= entry * x[i];
      }
      difference[i] += own;
    }
  });
  for (int i = 0; i < n; ++i)
    if (!(std::abs(differences.row(i).sum()) <= tolerance * size[i])) return false;
  return true;
}

/// Whether entry by entry of two, or of one and the zero that is its mirror image, agree.
bool entries_agree(const SparseMatrix& A, const VectorView& scale, const DenseVector& size,
                   int threads) {
  const int* const outer = A.outerIndexPtr();
  const int* const column = A.innerIndexPtr();
  std::atomic<bool> agree = true;
  parallel_chunks(static_cast<int>(A.rows()), rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end && agree; ++i)
      for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
        const auto j = a.col();
        const int* const at = std::lower_bound(column + outer[j], column + outer[j + 1], i);
        const bool there = at < column + outer[j + 1] && *at == i;
        const double mirrored = there ? A.valuePtr()[at - column] : 0;
        if (!(std::abs(scale[i] * a.value() - scale[j] * mirrored) <=
              tolerance * std::sqrt(size[i] * size[j])))
          agree = false;
      }
  });
  return agree;
}

/// Whether a walk through all rows and back sees each of them connected with one of the marked.
bool are_connected(const SparseMatrix& A, std::vector<char> marked) {
  const int n = static_cast<int>(A.rows());
  const auto ask_neighbours = [&](int i) {
    for (SparseMatrix::InnerIterator a(A, i); !marked[i] && a; ++a)
      marked[i] = a.value() != 0 && marked[a.col()];
  };
  for (int i = 0; i < n; ++i) ask_neighbours(i);
  for (int i = n - 1; i >= 0; --i) ask_neighbours(i);
  return std::ranges::count(marked, 0) == 0;
}

}  // namespace

bool share_pattern(const SparseMatrix& A, const SparseMatrix& B) {
  return A.rows() == B.rows() && A.cols() == B.cols() && A.isCompressed() &&
         A.nonZeros() == B.nonZeros() &&
         std::equal(A.outerIndexPtr(), A.outerIndexPtr() + A.rows() + 1, B.outerIndexPtr()) &&
         std::equal(A.innerIndexPtr(), A.innerIndexPtr() + A.nonZeros(), B.innerIndexPtr());
}

bool is_symmetric(const SparseMatrix& A, const VectorView& scale, int threads) {
  DenseVector size(A.rows());
  parallel_chunks(static_cast<int>(A.rows()), rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) size[i] = std::abs(scale[i] * A.coeff(i, i));
  });
  return products_agree(A, scale, size, threads) || entries_agree(A, scale, size, threads);
}

bool is_dominant(const SparseMatrix& A, std::span<const int> diagonal, int threads) {
  std::atomic<bool> result = true;
  parallel_chunks(static_cast<int>(A.rows()), rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end && result; ++i) {
      const int column = diagonal.empty() ? i : diagonal[i];
      double excess = 0, own = 0;
      for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
        if (a.col() == column) own = a.value();
        excess += a.col() == column ? a.value() : -std::abs(a.value());
      }
      if (!(excess >= -1e-12 * own)) result = false;
    }
  });
  return result;
}

std::vector<int> reversed_rows(const SparseMatrix& A) {
  const Eigen::VectorXd diagonal = A.diagonal();
  const double usual = 2 * (diagonal.array() > 0).count() >= diagonal.size() ? 1 : -1;
  std::vector<int> result;
  for (int i = 0; i < diagonal.size(); ++i)
    if (!(usual * diagonal[i] > 0)) result.push_back(i);
  return result;
}

FloatingRows floating_rows(const SparseMatrix& A) {
  const int n = static_cast<int>(A.rows());
  std::vector<char> floats = vanishing_rows(A);
  std::vector<char> marked(n, false);
  if (std::ranges::count(floats, 1) < n) {
    for (int i = 0; i < n; ++i) marked[i] = !floats[i];
    if (are_connected(A, std::move(marked))) return {};
  } else if (n > 0) {
    marked[0] = true;
    if (are_connected(A, std::move(marked))) return {0, n};
  }
  Sets connected(n);
  for (int i = 0; i < n; ++i)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      if (a.value() != 0) connected.merge(i, static_cast<int>(a.col()));
  std::vector<int> count(n, 0);
  for (int i = 0; i < n; ++i) {
    const int lowest = connected.of(i);
    ++count[lowest];
    if (!floats[i]) floats[lowest] = false;
  }
  for (int i = 0; i < n; ++i)
    if (connected.of(i) == i && floats[i]) return {i, count[i]};
  return {};
}

}  // namespace gradpsi
