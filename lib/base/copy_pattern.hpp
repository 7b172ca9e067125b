#pragma once

#include <algorithm>

#include "base/memory.hpp"
#include "base/parallel.hpp"

namespace gradpsi {

/// Gives a matrix the pattern of another, compressed; the values are left as they come.
inline void copy_pattern(SparseMatrix& matrix, const SparseMatrix& other, int threads) {
  matrix.resize(other.rows(), other.cols());
  const int m = static_cast<int>(other.rows());
  const int* const outer = other.outerIndexPtr();
  std::copy_n(outer, m + 1, matrix.outerIndexPtr());
  resize_in_large_pages(matrix, outer[m]);
  parallel_chunks(m, 8192, threads, [&](int begin, int end) {
    std::copy(other.innerIndexPtr() + outer[begin], other.innerIndexPtr() + outer[end],
              matrix.innerIndexPtr() + outer[begin]);
  });
}

}  // namespace gradpsi
