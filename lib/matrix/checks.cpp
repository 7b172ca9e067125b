#include "matrix/checks.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/parallel.hpp"
#include "base/sets.hpp"

namespace gradpsi {
namespace {

constexpr int rows_per_chunk = 4096;

}  // namespace

bool is_symmetric(const SparseMatrix& A, const VectorView& scale, int threads) {
  const int n = static_cast<int>(A.rows());
  const int* const outer = A.outerIndexPtr();
  const int* const column = A.innerIndexPtr();
  const double* const a = A.valuePtr();
  Eigen::VectorXd size(n);
  parallel_chunks(n, rows_per_chunk, threads, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) size[i] = std::abs(scale[i] * A.coeff(i, i));
  });
  const auto agrees = [&](int i, int k, bool& there) {
    const int j = column[k];
    const int* const at = std::lower_bound(column + outer[j], column + outer[j + 1], i);
    there = at < column + outer[j + 1] && *at == i;
    const double mirrored = there ? a[at - column] : 0;
    return std::abs(scale[i] * a[k] - scale[j] * mirrored) <= 1e-12 * std::sqrt(size[i] * size[j]);
  };
  // Entries above the diagonal meet those below it; if some of these are left, they are compared, too.
  std::atomic<std::int64_t> unmatched = 0;
  std::atomic<bool> differs = false;
  const auto compare = [&](int begin, int end, bool above) {
    std::int64_t below = 0, matched = 0;
    for (int i = begin; i < end && !differs; ++i)
      for (int k = outer[i]; k < outer[i + 1]; ++k) {
        bool there = false;
        if (column[k] == i || (column[k] > i) != above) {
          below += column[k] < i;
          continue;
        }
        if (!agrees(i, k, there)) differs = true;
        matched += there;
      }
    unmatched += below - matched;
  };
  parallel_chunks(n, rows_per_chunk, threads,
                  [&](int begin, int end) { compare(begin, end, true); });
  if (!differs && unmatched != 0)
    parallel_chunks(n, rows_per_chunk, threads,
                    [&](int begin, int end) { compare(begin, end, false); });
  return !differs;
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
  if (std::ranges::count(floats, 1) == 0) return {};
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
