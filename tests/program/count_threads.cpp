// Loaded before a program by LD_PRELOAD: writes a byte to the file GRADPSI_STARTED for each thread that gradpsi
// starts, by whatever library; not those of the programs that it calls, which inherit this.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

extern "C" __attribute__((visibility("default"))) int pthread_create(
    pthread_t* thread, const pthread_attr_t* attributes, void* (*work)(void*),
    void* argument) noexcept {
  static auto* const create =
      reinterpret_cast<decltype(&pthread_create)>(dlsym(RTLD_NEXT, "pthread_create"));
  const char* const file = std::getenv("GRADPSI_STARTED");
  if (file && std::strcmp(program_invocation_short_name, "gradpsi") == 0) {
    const int out = open(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    if (out < 0 || write(out, "+", 1) != 1) std::abort();
    close(out);
  }
  return create(thread, attributes, work, argument);
}
