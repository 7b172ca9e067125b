#include "solve/factorisation_threads.hpp"

#include <dlfcn.h>
#include <omp.h>

#include <mutex>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace gradpsi {
namespace {

/// OpenBLAS's setting belongs to the process: the first to come sets it, the last to go restores it.
class BlasThreads {
 public:
  /// Whether its threads are OpenMP's: one per team member, and none where a region must not fork.
  bool by_openmp() const { return parallel_ && parallel_() == 2; }
  void acquire(int threads) {
    const std::lock_guard lock(mutex_);
    if (users_++ > 0 || !set_ || !get_) return;
    before_ = get_();
    if (before_ != threads) set_(threads);
  }
  void release() {
    const std::lock_guard lock(mutex_);
    if (--users_ == 0 && set_ && get_ && get_() != before_) set_(before_);
  }

 private:
  // Looked up at run time: which BLAS stands behind libblas is the administrator's choice.
  void (*const set_)(int) = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT,
                                                                  "openblas_set_num_threads"));
  int (*const get_)() = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT,
                                                          "openblas_get_num_threads"));
  int (*const parallel_)() = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT,
                                                               "openblas_get_parallel"));
  std::mutex mutex_;
  int users_ = 0;
  int before_ = 0;
};

BlasThreads& blas() {
  static BlasThreads threads;
  return threads;
}

}  // namespace

FactorisationThreads::FactorisationThreads(int threads)
    : active_levels_(omp_get_max_active_levels()), threads_(omp_get_max_threads()), control_(0) {
  blas().acquire(threads);
  omp_set_max_active_levels(0);
  // That build would wait for partners that a region of one thread does not have.
  if (blas().by_openmp()) omp_set_num_threads(1);
#if defined(__SSE2__)
  control_ = _mm_getcsr();
  constexpr unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x0040;
  _mm_setcsr(control_ | flush_to_zero | denormals_are_zero);
#endif
}

FactorisationThreads::~FactorisationThreads() {
#if defined(__SSE2__)
  _mm_setcsr(control_);
#endif
  omp_set_max_active_levels(active_levels_);
  if (blas().by_openmp()) omp_set_num_threads(threads_);
  blas().release();
}

}  // namespace gradpsi
