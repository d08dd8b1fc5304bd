// The simulated heap of orrery-flight-target: malloc and its kin as in interposer.cpp, for one heap
// and one thread, on processors of 32 bits, too.
//
// Calls of flight code allocate from the heap, all else from the C library; freeing and resizing go
// by the address. What constructors allocate while the library is loaded is the C library's.

#include <orrery/harness/heap/first_fit_heap.hpp>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <dlfcn.h>
#include <malloc.h>
#include <new>
#include <orrery_wire.h>
#include <sys/mman.h>

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
void orrery_target_heap_open(std::uint32_t bytes);
void orrery_target_heap_enter(void);
void orrery_target_heap_leave(orrery_wire_cost* cost);
}

namespace {

using orrery::BlockHeap;
using orrery::internal::FirstFitHeap;

alignas(FirstFitHeap) std::byte place[sizeof(FirstFitHeap)];
BlockHeap* heap = nullptr;  // never destroyed
std::byte* arena = nullptr;
std::size_t arena_bytes = 0;
bool in_flight = false;

bool from_heap(const void* address) {
  return reinterpret_cast<std::uintptr_t>(address) - reinterpret_cast<std::uintptr_t>(arena) <
         arena_bytes;
}

void on_fault(void*, const orrery::HeapFault& fault) {
  if (fault.kind == orrery::HeapFault::Kind::kExhausted) return;  // malloc returns null
  in_flight = false;
  std::fprintf(stderr, "orrery-flight-target: heap: %s %p in %s\n", to_string(fault.kind),
               fault.address, fault.during);
  std::abort();
}

void* aligned(std::size_t alignment, std::size_t bytes) {
  return in_flight ? heap->allocate_aligned(alignment, bytes) : __libc_memalign(alignment, bytes);
}

// From one side to the other: only where flight code resizes what the C library gave it.
void* moved(void* block, std::size_t bytes) {
  void* made = malloc(bytes);
  if (made == nullptr) return nullptr;
  const std::size_t held = malloc_usable_size(block);
  __builtin_memcpy(made, block, held < bytes ? held : bytes);
  free(block);
  return made;
}

}  // namespace

extern "C" {

void orrery_target_heap_open(std::uint32_t bytes) {
  orrery::HeapOptions options;
  options.alignment = 2 * sizeof(void*);  // the ABI's: 8 on 32 bits, 16 on 64
  options.limit_bytes = bytes;
  const auto needed = static_cast<std::size_t>(BlockHeap::arena_bytes(options));
  void* mapped = mmap(nullptr, needed, PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (mapped == MAP_FAILED) {
    std::perror("orrery-flight-target: no memory for the heap");
    std::exit(2);
  }
  arena = static_cast<std::byte*>(mapped);
  arena_bytes = needed;
  heap = new (place) FirstFitHeap(mapped, options, orrery::internal::BlockRules{});
  heap->set_fault_handler(on_fault, nullptr);
}

void orrery_target_heap_enter(void) {
  if (heap == nullptr) return;
  heap->mark();
  in_flight = true;
}

void orrery_target_heap_leave(orrery_wire_cost* cost) {
  in_flight = false;
  if (heap == nullptr) return;
  cost->heap_now = heap->live_bytes();
  cost->heap_peak = heap->peak_since_mark_bytes();
  cost->heap_size = heap->heap_bytes();
  cost->heap_largest_free = heap->largest_free_bytes();
}

void* malloc(std::size_t bytes) {
  return in_flight ? heap->allocate(bytes) : __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  return in_flight ? heap->allocate_zeroed(count, bytes) : __libc_calloc(count, bytes);
}
void free(void* block) {
  from_heap(block) ? heap->release(block) : __libc_free(block);
}
void* realloc(void* block, std::size_t bytes) {
  if (block == nullptr) return malloc(bytes);
  if (from_heap(block)) return heap->reallocate(block, bytes);
  if (in_flight && bytes != 0) return moved(block, bytes);
  return __libc_realloc(block, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  return aligned(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  return aligned(alignment, bytes);
}
int posix_memalign(void** made, std::size_t alignment, std::size_t bytes) {
  if (alignment < sizeof(void*) || (alignment & (alignment - 1)) != 0) return EINVAL;
  void* block = aligned(alignment, bytes);
  if (block == nullptr) return ENOMEM;
  *made = block;
  return 0;
}
std::size_t malloc_usable_size(void* block) {
  if (from_heap(block)) return heap->usable_bytes(block);
  using Function = std::size_t (*)(void*);
  static const auto of_libc = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "malloc_usable_size"));
  return of_libc(block);
}

}  // extern "C"
