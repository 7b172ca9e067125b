#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// A matrix of blocks that have one pattern each, or are absent. Threads take rows of the pattern.
/// @param present  present(r, c): whether block row r has a block in block column c
/// @param fill     fill(r, c, i, values): row i of that block, an entry for each of the pattern's
template <class Present, class Fill>
SparseMatrix of_blocks(const SparseMatrix& pattern, int block_rows, int block_columns,
                       const Present& present, const Fill& fill, int threads) {
  constexpr std::int64_t most = std::numeric_limits<int>::max();
  const std::int64_t rows = pattern.rows(), columns = pattern.cols();
  std::int64_t blocks = 0;
  for (int r = 0; r < block_rows; ++r)
    for (int c = 0; c < block_columns; ++c) blocks += present(r, c);
  if (block_rows * rows > most || block_columns * columns > most ||
      blocks * pattern.nonZeros() > most)
    throw InvalidInput("a block matrix of " + std::to_string(blocks) + " matrices with " +
                       std::to_string(pattern.nonZeros()) +
                       " entries each is more than indices of 32 bits can count");
  SparseMatrix result(block_rows * rows, block_columns * columns);
  resize_in_large_pages(result, static_cast<int>(blocks * pattern.nonZeros()));
  const int* const outer = pattern.outerIndexPtr();
  int before = 0;  // entries of the block rows that are done
  for (int r = 0; r < block_rows; ++r) {
    int width = 0;  // blocks of this block row
    for (int c = 0; c < block_columns; ++c) width += present(r, c);
    int* const ends = result.outerIndexPtr() + r * rows + 1;
    parallel_chunks(static_cast<int>(rows), 1024, threads, [&](int begin, int end) {
      for (int i = begin; i < end; ++i) {
        const int count = outer[i + 1] - outer[i];
        int at = before + width * outer[i];
        ends[i] = before + width * outer[i + 1];
        for (int c = 0; c < block_columns; ++c) {
          if (!present(r, c)) continue;
          for (int k = 0; k < count; ++k)
            result.innerIndexPtr()[at + k] =
                static_cast<int>(c * columns) + pattern.innerIndexPtr()[outer[i] + k];
          fill(r, c, i, result.valuePtr() + at);
          at += count;
        }
      }
    });
    before += width * outer[rows];
  }
  return result;
}

}  // namespace gradpsi
