#pragma once

#include <omp.h>

#include <algorithm>
#include <exception>
#include <optional>
#include <string>

#include "gradpsi/error.hpp"

namespace gradpsi {

/// The number of threads to start for a caller who asked for `threads`, 0 leaving it to OpenMP.
inline int checked_threads(int threads) {
  if (threads < 0 || threads > 1024)  // far beyond what helps, OpenMP would end the program
    throw InvalidInput("threads must be 0 to 1024, not " + std::to_string(threads));
  return threads > 0 ? threads : omp_get_max_threads();
}

/// Calls body(begin, end) on chunks of [0, n), in any order. Each thread works with a copy of body,
/// so what a lambda captures by value is the thread's own. An exception, in that copying too, skips the
/// chunks that have not begun; one of those thrown is rethrown.
template <class Body>
void parallel_chunks(int n, int chunk, int threads, const Body& body) {
  const int chunks = n / chunk + (n % chunk > 0);
  threads = std::clamp(chunks, 1, checked_threads(threads));
  std::exception_ptr failure;
  bool failed = false;
#pragma omp parallel num_threads(threads)
  {
    const auto keep = [&] {
#pragma omp critical
      failure = std::current_exception();
#pragma omp atomic write
      failed = true;
    };
    std::optional<Body> own;
    try {
      own.emplace(body);
    } catch (...) {
      keep();
    }
#pragma omp for schedule(dynamic)
    for (int c = 0; c < chunks; ++c) {
      bool skip;
#pragma omp atomic read
      skip = failed;
      if (skip || !own) continue;
      try {
        (*own)(c * chunk, c == chunks - 1 ? n : (c + 1) * chunk);
      } catch (...) {
        keep();
      }
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace gradpsi
