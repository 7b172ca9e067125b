#include "common/process.hpp"

#include <dlfcn.h>

#include <Eigen/Core>
#include <csignal>

namespace gradpsi::apps {

namespace {

/// A function that the BLAS at hand may have, OpenBLAS or another.
template <class F>
F* blas_function(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_DEFAULT, name));
}

/// OpenBLAS starts its threads when the program is loaded, and they spin for a tenth of a second on the
/// cores that the search wants. Sent home, they come back when there is something for several of them to
/// factorise; one by itself would call all others back to be told their number, if it was not 1 already.
void send_blas_threads_home() {
  auto* const set_threads = blas_function<void(int)>("openblas_set_num_threads");
  auto* const shutdown = blas_function<int()>("blas_thread_shutdown_");
  if (!set_threads || !shutdown) return;
  set_threads(1);
  shutdown();
}

}  // namespace

void prepare_process() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  send_blas_threads_home();
  // Eigen's products would take as many as OpenMP offers, whatever --threads says.
  Eigen::setNbThreads(1);
}

}  // namespace gradpsi::apps
