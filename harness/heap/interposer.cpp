// malloc and its kin for a test program: they allocate from the current heap, and free by address.
//
// An object file of the executable itself (an archive member might be left out), so that every
// library of the program, libstdc++ included, binds here. --dynamic-list exports the names under
// -fvisibility=hidden too.

#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/heap/simulated_heap.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <dlfcn.h>

#ifdef ORRERY_SANITIZER_OWNS_MALLOC

extern "C" bool orrery_allocator_simulates();
extern "C" bool orrery_allocator_simulates() {
  return false;
}

#else

#define ORRERY_HOOK extern "C" [[gnu::visibility("default")]]

// The C library's own, under names that are not interposed.
extern "C" void* __libc_malloc(std::size_t) noexcept;
extern "C" void __libc_free(void*) noexcept;
extern "C" void* __libc_calloc(std::size_t, std::size_t) noexcept;
extern "C" void* __libc_realloc(void*, std::size_t) noexcept;
extern "C" void* __libc_memalign(std::size_t, std::size_t) noexcept;

extern "C" bool orrery_allocator_simulates();
extern "C" const char* orrery_allocator_hook_not_taken(std::size_t index);

namespace {

using orrery::Arena;
using orrery::SimulatedHeap;

// The heap to allocate from, or null for the system's.
inline SimulatedHeap* heap_for(const void* caller) {
  SimulatedHeap* heap = orrery::current_heap;
  if (heap == nullptr) return nullptr;
  const std::uintptr_t in_loader =
      reinterpret_cast<std::uintptr_t>(caller) - orrery::internal::loader_begin;
  return in_loader < orrery::internal::loader_bytes ? nullptr : heap;
}

// The heap that a block in an arena goes back to: its own, wherever the program is. But flight code
// that hands in another process's block has that reported by its own heap, as a foreign pointer.
inline SimulatedHeap* accountable_for(const void* payload) {
  SimulatedHeap* owner = SimulatedHeap::owner_of(payload);
  SimulatedHeap* current = orrery::current_heap;
  if (__builtin_expect(owner == current, 1)) return owner;
  return owner == nullptr || current == nullptr || current->takes_others_blocks() ? owner : current;
}

inline void* or_no_memory(void* payload) {
  if (__builtin_expect(payload == nullptr, 0)) errno = ENOMEM;
  return payload;
}

void* align(const void* caller, std::size_t alignment, std::size_t bytes) {
  SimulatedHeap* heap = heap_for(caller);
  if (heap == nullptr) return __libc_memalign(alignment, bytes);
  if ((alignment & (alignment - 1)) != 0) {
    errno = EINVAL;
    return nullptr;
  }
  return or_no_memory(heap->allocate_aligned(alignment == 0 ? 1 : alignment, bytes));
}

void* resize(const void* caller, void* payload, std::size_t bytes) {
  if (payload == nullptr) {
    SimulatedHeap* heap = heap_for(caller);
    return heap == nullptr ? __libc_malloc(bytes) : or_no_memory(heap->allocate(bytes));
  }
  if (!Arena::contains(payload)) return __libc_realloc(payload, bytes);
  SimulatedHeap* owner = accountable_for(payload);
  if (owner == nullptr) return or_no_memory(nullptr);  // its process is dead
  void* resized = owner->reallocate(payload, bytes);
  return bytes == 0 ? resized : or_no_memory(resized);
}

constexpr std::size_t kPage_bytes = 4096;

}  // namespace

ORRERY_HOOK void* malloc(std::size_t bytes) noexcept {
  SimulatedHeap* heap = heap_for(__builtin_return_address(0));
  return heap == nullptr ? __libc_malloc(bytes) : heap->allocate(bytes);
}

ORRERY_HOOK void free(void* payload) noexcept {
  if (!Arena::contains(payload)) {
    __libc_free(payload);
    return;
  }
  // The memory of a dead process went with its arena.
  SimulatedHeap* owner = accountable_for(payload);
  if (owner != nullptr) owner->release(payload);
}

ORRERY_HOOK void* calloc(std::size_t count, std::size_t bytes) noexcept {
  SimulatedHeap* heap = heap_for(__builtin_return_address(0));
  return heap == nullptr ? __libc_calloc(count, bytes)
                         : or_no_memory(heap->allocate_zeroed(count, bytes));
}

ORRERY_HOOK void* realloc(void* payload, std::size_t bytes) noexcept {
  return resize(__builtin_return_address(0), payload, bytes);
}

ORRERY_HOOK void* reallocarray(void* payload, std::size_t count, std::size_t bytes) noexcept {
  std::size_t total = 0;
  if (__builtin_mul_overflow(count, bytes, &total)) return or_no_memory(nullptr);
  return resize(__builtin_return_address(0), payload, total);
}

ORRERY_HOOK void* memalign(std::size_t alignment, std::size_t bytes) noexcept {
  return align(__builtin_return_address(0), alignment, bytes);
}

ORRERY_HOOK void* aligned_alloc(std::size_t alignment, std::size_t bytes) noexcept {
  return align(__builtin_return_address(0), alignment, bytes);
}

ORRERY_HOOK int posix_memalign(void** result, std::size_t alignment, std::size_t bytes) noexcept {
  if (alignment == 0 || alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0) {
    return EINVAL;
  }
  const int kept = errno;  // posix_memalign leaves it alone
  void* payload = align(__builtin_return_address(0), alignment, bytes);
  errno = kept;
  if (payload == nullptr) return ENOMEM;
  *result = payload;
  return 0;
}

ORRERY_HOOK void* valloc(std::size_t bytes) noexcept {
  return align(__builtin_return_address(0), kPage_bytes, bytes);
}

ORRERY_HOOK void* pvalloc(std::size_t bytes) noexcept {
  const std::size_t pages = bytes > SIZE_MAX - kPage_bytes
                                ? bytes
                                : (bytes + kPage_bytes - 1) / kPage_bytes * kPage_bytes;
  return align(__builtin_return_address(0), kPage_bytes, pages);
}

ORRERY_HOOK std::size_t malloc_usable_size(void* payload) noexcept {
  if (Arena::contains(payload)) {
    SimulatedHeap* owner = SimulatedHeap::owner_of(payload);
    return owner == nullptr ? 0 : owner->blocks().usable_bytes(payload);
  }
  using Function = std::size_t (*)(void*);
  static const auto system = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "malloc_usable_size"));
  return system(payload);
}

// ---- the ends of processes

// Destructors of a library's statics: with the process alive they run at its end, and never
// when it has crashed, for what they would destroy went with its arena.
ORRERY_HOOK int __cxa_atexit(void (*function)(void*), void* argument, void* library) noexcept {
  const orrery::internal::ProcessHooks* hooks = orrery::internal::process_hooks;
  if (hooks != nullptr && hooks->register_exit(function, argument)) return 0;
  using Function = int (*)(void (*)(void*), void*, void*);
  static const auto system = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "__cxa_atexit"));
  return system(function, argument, library);
}

ORRERY_HOOK int __cxa_thread_atexit_impl(void (*function)(void*), void* argument,
                                         void* library) noexcept {
  const orrery::internal::ProcessHooks* hooks = orrery::internal::process_hooks;
  if (hooks != nullptr && hooks->register_exit(function, argument)) return 0;
  using Function = int (*)(void (*)(void*), void*, void*);
  static const auto system =
      reinterpret_cast<Function>(dlsym(RTLD_NEXT, "__cxa_thread_atexit_impl"));
  return system(function, argument, library);
}

ORRERY_HOOK void exit(int status) noexcept {
  const orrery::internal::ProcessHooks* hooks = orrery::internal::process_hooks;
  if (hooks != nullptr) hooks->exit(status);
  using Function = void (*)(int);
  reinterpret_cast<Function>(dlsym(RTLD_NEXT, "exit"))(status);
  __builtin_unreachable();
}

// ---- statics of functions

// A crash within the constructor of one leaves its guard taken, and who wants it next would wait
// for ever. No static variables of our own in here.
namespace {

template <class Function>
void find_system(Function*& function, const char* name) {
  if (function == nullptr) function = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

using GuardAcquire = int(long long*);
using GuardRelease = void(long long*);
constinit GuardAcquire* system_guard_acquire = nullptr;
constinit GuardRelease* system_guard_release = nullptr;
constinit GuardRelease* system_guard_abort = nullptr;

}  // namespace

ORRERY_HOOK int __cxa_guard_acquire(long long* guard) {
  const orrery::internal::ProcessHooks* hooks = orrery::internal::process_hooks;
  if (hooks != nullptr) hooks->static_wanted(guard);
  find_system(system_guard_acquire, "__cxa_guard_acquire");
  const int ours = system_guard_acquire(guard);
  if (hooks != nullptr && ours != 0) hooks->static_begun(guard);
  return ours;
}

ORRERY_HOOK void __cxa_guard_release(long long* guard) {
  find_system(system_guard_release, "__cxa_guard_release");
  system_guard_release(guard);
  const orrery::internal::ProcessHooks* hooks = orrery::internal::process_hooks;
  if (hooks != nullptr) hooks->static_ended(guard);
}

ORRERY_HOOK void __cxa_guard_abort(long long* guard) {
  find_system(system_guard_abort, "__cxa_guard_abort");
  system_guard_abort(guard);
  const orrery::internal::ProcessHooks* hooks = orrery::internal::process_hooks;
  if (hooks != nullptr) hooks->static_ended(guard);
}

// ---- self-test

extern "C" bool orrery_allocator_simulates() {
  return true;
}

// The index-th hook that the dynamic loader would not give to a library; null: no more.
extern "C" const char* orrery_allocator_hook_not_taken(std::size_t index) {
  struct Hook {
    const char* name;
    void* address;
  };
  static const Hook hooks[] = {
      {"malloc", reinterpret_cast<void*>(&malloc)},
      {"free", reinterpret_cast<void*>(&free)},
      {"calloc", reinterpret_cast<void*>(&calloc)},
      {"realloc", reinterpret_cast<void*>(&realloc)},
      {"reallocarray", reinterpret_cast<void*>(&reallocarray)},
      {"memalign", reinterpret_cast<void*>(&memalign)},
      {"aligned_alloc", reinterpret_cast<void*>(&aligned_alloc)},
      {"posix_memalign", reinterpret_cast<void*>(&posix_memalign)},
      {"valloc", reinterpret_cast<void*>(&valloc)},
      {"pvalloc", reinterpret_cast<void*>(&pvalloc)},
      {"malloc_usable_size", reinterpret_cast<void*>(&malloc_usable_size)},
      {"__cxa_atexit", reinterpret_cast<void*>(&__cxa_atexit)},
      {"__cxa_thread_atexit_impl", reinterpret_cast<void*>(&__cxa_thread_atexit_impl)},
      {"exit", reinterpret_cast<void*>(&exit)},
      {"__cxa_guard_acquire", reinterpret_cast<void*>(&__cxa_guard_acquire)},
      {"__cxa_guard_release", reinterpret_cast<void*>(&__cxa_guard_release)},
      {"__cxa_guard_abort", reinterpret_cast<void*>(&__cxa_guard_abort)},
  };
  for (const Hook& hook : hooks) {
    // The search that binds a library loaded with RTLD_LOCAL begins in the same place.
    if (dlsym(RTLD_DEFAULT, hook.name) == hook.address) continue;
    if (index-- == 0) return hook.name;
  }
  return nullptr;
}

#endif
