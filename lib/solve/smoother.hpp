#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// Jacobi's method on a system's rows.
struct Smoother {
  DenseVector diagonal;  // a_ii
  DenseVector step;      // damping over the diagonal, or over what it should be beside the others
  std::vector<char> is_weak;  // rows whose diagonal is too small for the method
};
/// @param diagonal  the column of each row's diagonal entry
Smoother smoother(const SparseMatrix& A, const std::vector<int>& diagonal, int threads);

/// How many rows a factor of the weak ones and their neighbours may have, of n.
constexpr std::int64_t most_weak_rows(std::int64_t n) {
  return std::max<std::int64_t>(2'000, n / 10);
}

}  // namespace gradpsi
