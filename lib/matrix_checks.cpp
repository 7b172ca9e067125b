#include "matrix_checks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace gradpsi {

bool vanishes(double sum, double size) {
  return std::abs(sum) <= 100 * std::numeric_limits<double>::epsilon() * size;
}

namespace {

/// Sets of numbers 0 to n - 1 that merge, each known by its lowest member.
class Sets {
 public:
  explicit Sets(int n) : parent_(n) {
    for (int i = 0; i < n; ++i) parent_[i] = i;
  }
  int of(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void merge(int i, int j) {
    i = of(i), j = of(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<int> parent_;
};

}  // namespace

bool is_symmetric(const SparseMatrix& A, const Eigen::VectorXd& scale) {
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

bool is_dominant(const SparseMatrix& A) {
  for (int i = 0; i < A.rows(); ++i) {
    double excess = 0, diagonal = 0;
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      if (a.col() == i) diagonal = a.value();
      excess += a.col() == i ? a.value() : -std::abs(a.value());
    }
    if (!(excess >= -1e-12 * diagonal)) return false;
  }
  return true;
}

FloatingRows floating_rows(const SparseMatrix& A) {
  const int n = static_cast<int>(A.rows());
  std::vector<char> floats(n);
  for (int i = 0; i < n; ++i) {
    double sum = 0, size = 0;
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      sum += a.value();
      size += std::abs(a.value());
    }
    floats[i] = vanishes(sum, size);
  }
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
