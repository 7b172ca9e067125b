#pragma once

#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#if defined(__linux__)
#include <sys/mman.h>
#include <unistd.h>
#endif

// How the library shares out work and asks for memory; what it is compared with does the same.

/// Calls body(begin, end) on chunks of [0, n), in any order. Each thread works with a copy of body.
template <class Body>
void parallel_chunks(int n, int chunk, int threads, const Body& body) {
  const int chunks = n / chunk + (n % chunk > 0);
  if (threads <= 0) threads = omp_get_max_threads();
#pragma omp parallel num_threads(std::clamp(chunks, 1, threads))
  {
    const Body own = body;
#pragma omp for schedule(dynamic)
    for (int c = 0; c < chunks; ++c) own(c * chunk, c == chunks - 1 ? n : (c + 1) * chunk);
  }
}

/// Asks for large pages where the system grants them on request.
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
