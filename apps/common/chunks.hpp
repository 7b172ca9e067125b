#pragma once

#include <omp.h>

#include <algorithm>
#include <exception>

namespace gradpsi::apps {

/// The number of threads to start for a user who asked for `threads`, 0 leaving it to OpenMP.
inline int thread_count(int threads) { return threads > 0 ? threads : omp_get_max_threads(); }

/// Calls body(begin, end) on chunks of [0, n), in any order and by several threads. An exception skips the
/// chunks that have not begun; one of those thrown is rethrown.
template <class Body>
void in_chunks(int n, int chunk, int threads, const Body& body) {
  const int chunks = n / chunk + (n % chunk > 0);
  std::exception_ptr failure;
  bool failed = false;
#pragma omp parallel for schedule(dynamic) num_threads(std::clamp(chunks, 1, thread_count(threads)))
  for (int c = 0; c < chunks; ++c) {
    bool skip;
#pragma omp atomic read
    skip = failed;
    if (skip) continue;
    try {
      body(c * chunk, c == chunks - 1 ? n : (c + 1) * chunk);
    } catch (...) {
#pragma omp critical
      failure = std::current_exception();
#pragma omp atomic write
      failed = true;
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace gradpsi::apps
