// Counts all allocations: these functions replace those of the C library in the whole program, including libraries.
#include "malloc_hook.hpp"

#include <atomic>
#include <cstddef>

namespace {

std::atomic<long> calls{0};

}  // namespace

long allocation_calls() { return calls.load(std::memory_order_relaxed); }

extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) { return ++calls, __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) { return ++calls, __libc_calloc(count, size); }
void* realloc(void* old, std::size_t size) { return ++calls, __libc_realloc(old, size); }
void* memalign(std::size_t alignment, std::size_t size) { return ++calls, __libc_memalign(alignment, size); }
void* aligned_alloc(std::size_t alignment, std::size_t size) { return ++calls, __libc_memalign(alignment, size); }
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    ++calls;
    *out = __libc_memalign(alignment, size);
    return *out ? 0 : 12;  // ENOMEM
}
void free(void* old) {
    ++calls;
    __libc_free(old);
}
}
