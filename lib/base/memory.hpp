#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "gradpsi/matrix.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace gradpsi {

/// Asks for large pages where the system grants them on request: a first touch then costs a third of the
/// time, and products of large matrices a tenth less.
inline void prefer_large_pages([[maybe_unused]] const void* memory,
                               [[maybe_unused]] std::size_t bytes) {
#if defined(__linux__) && defined(MADV_HUGEPAGE)
  if (bytes < (std::size_t{4} << 20)) return;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = (reinterpret_cast<std::uintptr_t>(memory) + page - 1) / page * page;
  const auto end = (reinterpret_cast<std::uintptr_t>(memory) + bytes) / page * page;
  madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

/// Room for that many entries, their values left as they come.
inline void resize_in_large_pages(SparseMatrix& matrix, int entries) {
  matrix.resizeNonZeros(entries);
  prefer_large_pages(matrix.valuePtr(), sizeof(double) * entries);
  prefer_large_pages(matrix.innerIndexPtr(), sizeof(int) * entries);
}

/// Memory for the vector code, aligned to its widest loads; a copy has its own.
class LaneMemory {
 public:
  LaneMemory() = default;
  LaneMemory(const LaneMemory&) {}
  LaneMemory& operator=(const LaneMemory&) = delete;

  double* doubles(long count) {
    constexpr long alignment = 64 / sizeof(double);
    if (std::ssize(memory_) < count + alignment) memory_.resize(count + alignment);
    const auto at = reinterpret_cast<std::uintptr_t>(memory_.data());
    return reinterpret_cast<double*>((at + 63) / 64 * 64);
  }

 private:
  std::vector<double> memory_;
};

/// Memory for integers that threads take pieces of; it stays where it is until the end.
class Slabs {
 public:
  int* take(std::size_t count) {
    const std::lock_guard lock(mutex_);
    if (slabs_.empty() || used_ + count > capacity_) {
      // Few points should not take much, many not often.
      capacity_ =
          std::max(count, std::clamp(2 * capacity_, std::size_t{1} << 14, std::size_t{1} << 22));
      slabs_.push_back(std::make_unique_for_overwrite<int[]>(capacity_));
      prefer_large_pages(slabs_.back().get(), capacity_ * sizeof(int));
      used_ = 0;
    }
    return slabs_.back().get() + std::exchange(used_, used_ + count);
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<int[]>> slabs_;
  std::size_t used_ = 0, capacity_ = 0;
};

}  // namespace gradpsi
