// Memory that runs out, at every place where it can: the n-th allocation of a call fails, n = 1, 2, 3 and
// so on until the call meets no more. Each time there is an exception or, where a library has found
// another way, the right result; nothing leaks, arguments and files are what they were, and the next
// call works. This program stands between all allocations and the C library.
//
// Not failed, because these libraries cannot cope: allocations of OpenMP's runtime, which ends the program;
// those of OpenBLAS, which asks again for ever; those of the dynamic linker for new threads.

#include "pipeline/failing_allocations.hpp"

#include <link.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <new>
#include <string_view>

namespace {

std::atomic<long> live = 0;       // allocations that have not been freed
std::atomic<long> countdown = 0;  // the allocation that fails; 0: none
std::atomic<bool> from_then_on;   // and all that follow it
std::atomic<bool> has_failed;

struct Library {
  std::uintptr_t begin, end;
};
std::array<Library, 8> spared;
int spared_count = 0;

int spare(dl_phdr_info* info, std::size_t, void*) {
  const std::string_view name = info->dlpi_name;
  bool spares = false;
  for (const char* library : {"libgomp", "libomp", "openblas", "ld-linux"})
    spares |= name.find(library) != name.npos;
  for (int k = 0; spares && k < info->dlpi_phnum; ++k)
    if (const auto& segment = info->dlpi_phdr[k];
        segment.p_type == PT_LOAD && (segment.p_flags & PF_X) != 0)
      spared[spared_count++] = {info->dlpi_addr + segment.p_vaddr,
                                info->dlpi_addr + segment.p_vaddr + segment.p_memsz};
  return 0;
}

bool fails(const void* caller) {
  if (countdown == 0) return false;
  const auto at = reinterpret_cast<std::uintptr_t>(caller);
  for (int k = 0; k < spared_count; ++k)
    if (at >= spared[k].begin && at < spared[k].end) return false;
  if (const long before = countdown--; before > 1) return false;
  countdown = from_then_on ? 1 : 0;
  has_failed = true;
  return true;
}

void* counted(void* memory) {
  live += memory != nullptr;
  return memory;
}

}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_malloc(size));
}
void* calloc(std::size_t count, std::size_t size) {
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_calloc(count, size));
}
void* realloc(void* memory, std::size_t size) {
  if (fails(__builtin_return_address(0))) return nullptr;
  if (!memory) return counted(__libc_realloc(memory, size));
  void* const moved = __libc_realloc(memory, size);
  live -= size == 0 && !moved;
  return moved;
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_memalign(alignment, size));
}
void* memalign(std::size_t alignment, std::size_t size) {  // OpenMP's runtime calls it
  return fails(__builtin_return_address(0)) ? nullptr : counted(__libc_memalign(alignment, size));
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  if (fails(__builtin_return_address(0))) return ENOMEM;
  *memory = counted(__libc_memalign(alignment, size));
  return *memory ? 0 : ENOMEM;
}
void free(void* memory) {
  live -= memory != nullptr;
  __libc_free(memory);
}
}

namespace gradpsi {

void Fault20::SetUpTestSuite() {
  if (spared_count == 0) dl_iterate_phdr(spare, nullptr);
}

void fail_each(const Failure& failure, const std::function<bool()>& call,
               const std::function<bool()>& unchanged) {
  ASSERT_TRUE(call()) << "without failures";
  ASSERT_TRUE(call()) << "once more";  // what libraries keep for themselves is there now
  int exceptions = 0;
  for (long n = 1;; ++n) {
    SCOPED_TRACE("allocation " + std::to_string(n) + (failure.all ? " and all that follow" : ""));
    const long before = live;
    enum { Right, Wrong, NoMemory, Other } outcome;
    has_failed = false;
    from_then_on = failure.all;
    countdown = n;
    try {
      outcome = call() ? Right : Wrong;
    } catch (const std::bad_alloc&) {
      outcome = NoMemory;
    } catch (...) {
      outcome = Other;
    }
    countdown = 0;
    const long leaked = live - before;
    EXPECT_LE(leaked, failure.lost);  // less: a solver's workspace
    ASSERT_TRUE(outcome == Right || outcome == NoMemory) << outcome;
    ASSERT_TRUE(unchanged());
    if (!has_failed) break;
    exceptions += outcome == NoMemory;
    ASSERT_TRUE(call()) << "afterwards";
  }
  EXPECT_GT(exceptions, 0);
}

}  // namespace gradpsi
