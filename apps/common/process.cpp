#include "common/process.hpp"

#include <dlfcn.h>

#include <csignal>

namespace gradpsi::apps {

namespace {

/// OpenBLAS starts its threads when the program is loaded, and they spin for a tenth of a second on the
/// cores that the search wants. Sent home, they come back when there is something to factorise.
void send_blas_threads_home() {
  if (void* const shutdown = dlsym(RTLD_DEFAULT, "blas_thread_shutdown_"))
    reinterpret_cast<int (*)()>(shutdown)();
}

}  // namespace

void prepare_process() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  send_blas_threads_home();
}

}  // namespace gradpsi::apps
