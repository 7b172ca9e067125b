#include "matrix/checks.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/sets.hpp"

namespace gradpsi {

bool is_symmetric(const SparseMatrix& A, const VectorView& scale) {
  const int n = static_cast<int>(A.rows());
  const int* const outer = A.outerIndexPtr();
  const int* const column = A.innerIndexPtr();
  const double* const a = A.valuePtr();
  Eigen::VectorXd size(n);
  for (int i = 0; i < n; ++i) size[i] = std::abs(scale[i] * A.coeff(i, i));
  const auto differ = [&](int i, int j, double ij, double ji) {
    return !(std::abs(scale[i] * ij - scale[j] * ji) <= 1e-12 * std::sqrt(size[i] * size[j]));
  };
  // With i ascending, row j is asked for its entries left of the diagonal in their order: next[j].
  std::vector<int> next(outer, outer + n);
  const auto has_partnerless = [&](int j, int before) {
    for (int& at = next[j]; at < outer[j + 1] && column[at] < before; ++at)
      if (differ(j, column[at], a[at], 0)) return true;
    return false;
  };
  for (int i = 0; i < n; ++i) {
    if (has_partnerless(i, i)) return false;
    for (int k = outer[i]; k < outer[i + 1]; ++k) {
      const int j = column[k];
      if (j <= i) continue;
      if (has_partnerless(j, i)) return false;
      int& at = next[j];
      const bool there = at < outer[j + 1] && column[at] == i;
      if (differ(i, j, a[k], there ? a[at] : 0)) return false;
      at += there;
    }
  }
  return true;
}

bool is_dominant(const SparseMatrix& A, std::span<const int> diagonal) {
  for (int i = 0; i < A.rows(); ++i) {
    const int column = diagonal.empty() ? i : diagonal[i];
    double excess = 0, own = 0;
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      if (a.col() == column) own = a.value();
      excess += a.col() == column ? a.value() : -std::abs(a.value());
    }
    if (!(excess >= -1e-12 * own)) return false;
  }
  return true;
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
