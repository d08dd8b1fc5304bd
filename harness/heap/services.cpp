// clock_gettime, rand, pthread_create and their kin for a test program: flight code is answered in
// virtual time and from the run's random streams, everybody else by the C library. The other half
// of orrery::allocator (interposer.cpp), for the same reasons an object file of the executable.

#include <orrery/harness/heap/interposition.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <dlfcn.h>
#include <pthread.h>
#include <sys/random.h>
#include <sys/time.h>
#include <threads.h>
#include <type_traits>
#include <unistd.h>

#ifndef ORRERY_SANITIZER_OWNS_MALLOC

#define ORRERY_HOOK extern "C" [[gnu::visibility("default")]]

extern "C" bool orrery_services_are_virtual();
extern "C" const char* orrery_service_hook_not_taken(std::size_t index);

namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

const orrery::internal::ServiceHooks* hooks() {
  return orrery::internal::service_hooks;
}

// The C library's own.
template <class Function>
Function* system_function(const char* name) {
  void* address = dlsym(RTLD_NEXT, name);
  if (address == nullptr) std::abort();  // nobody could have linked a call of it
  return reinterpret_cast<Function*>(address);
}

bool valid(const timespec* t) {
  return t->tv_sec >= 0 && t->tv_nsec >= 0 && t->tv_nsec < kSecond_ns;
}

std::int64_t ns_of(const timespec* t) {
  return t->tv_sec * kSecond_ns + t->tv_nsec;
}

}  // namespace

#define ORRERY_SYSTEM(name, type) \
  static const std::add_pointer_t<type> system = system_function<type>(#name)

// ---- time

ORRERY_HOOK int clock_gettime(clockid_t clock, timespec* t) noexcept {
  std::int64_t ns = 0;
  if (hooks() != nullptr && hooks()->read_clock("clock_gettime", clock, ns)) {
    *t = {ns / kSecond_ns, ns % kSecond_ns};
    return 0;
  }
  ORRERY_SYSTEM(clock_gettime, int(clockid_t, timespec*));
  return system(clock, t);
}

ORRERY_HOOK int gettimeofday(timeval* t, void* zone) noexcept {
  std::int64_t ns = 0;
  if (hooks() != nullptr && hooks()->read_clock("gettimeofday", CLOCK_REALTIME, ns)) {
    *t = {ns / kSecond_ns, ns % kSecond_ns / 1000};
    return 0;
  }
  ORRERY_SYSTEM(gettimeofday, int(timeval*, void*));
  return system(t, zone);
}

ORRERY_HOOK time_t time(time_t* t) noexcept {
  std::int64_t ns = 0;
  if (hooks() != nullptr && hooks()->read_clock("time", CLOCK_REALTIME, ns)) {
    if (t != nullptr) *t = ns / kSecond_ns;
    return ns / kSecond_ns;
  }
  ORRERY_SYSTEM(time, time_t(time_t*));
  return system(t);
}

ORRERY_HOOK clock_t clock() noexcept {
  std::int64_t ns = 0;
  if (hooks() != nullptr && hooks()->read_clock("clock", CLOCK_PROCESS_CPUTIME_ID, ns)) {
    return ns / (kSecond_ns / CLOCKS_PER_SEC);
  }
  ORRERY_SYSTEM(clock, clock_t());
  return system();
}

ORRERY_HOOK int nanosleep(const timespec* request, timespec* remaining) {
  if (valid(request) && hooks() != nullptr && hooks()->sleep("nanosleep", ns_of(request))) return 0;
  ORRERY_SYSTEM(nanosleep, int(const timespec*, timespec*));
  return system(request, remaining);
}

ORRERY_HOOK int clock_nanosleep(clockid_t clock, int flags, const timespec* request,
                                timespec* remaining) {
  if (valid(request) && hooks() != nullptr) {
    const bool slept = (flags & TIMER_ABSTIME) != 0
                           ? hooks()->sleep_until("clock_nanosleep", clock, ns_of(request))
                           : hooks()->sleep("clock_nanosleep", ns_of(request));
    if (slept) return 0;
  }
  ORRERY_SYSTEM(clock_nanosleep, int(clockid_t, int, const timespec*, timespec*));
  return system(clock, flags, request, remaining);
}

ORRERY_HOOK int usleep(useconds_t us) {
  if (hooks() != nullptr && hooks()->sleep("usleep", std::int64_t{us} * 1000)) return 0;
  ORRERY_SYSTEM(usleep, int(useconds_t));
  return system(us);
}

ORRERY_HOOK unsigned sleep(unsigned seconds) {
  if (hooks() != nullptr && hooks()->sleep("sleep", seconds * kSecond_ns)) return 0;
  ORRERY_SYSTEM(sleep, unsigned(unsigned));
  return system(seconds);
}

// ---- chance

ORRERY_HOOK int rand() noexcept {
  std::int32_t number = 0;
  if (hooks() != nullptr && hooks()->random_number("rand", number)) return number;
  ORRERY_SYSTEM(rand, int());
  return system();
}

ORRERY_HOOK long random() noexcept {
  std::int32_t number = 0;
  if (hooks() != nullptr && hooks()->random_number("random", number)) return number;
  ORRERY_SYSTEM(random, long());
  return system();
}

ORRERY_HOOK void srand(unsigned seed) noexcept {
  if (hooks() != nullptr && hooks()->seed("srand", seed)) return;
  ORRERY_SYSTEM(srand, void(unsigned));
  system(seed);
}

ORRERY_HOOK void srandom(unsigned seed) noexcept {
  if (hooks() != nullptr && hooks()->seed("srandom", seed)) return;
  ORRERY_SYSTEM(srandom, void(unsigned));
  system(seed);
}

ORRERY_HOOK ssize_t getrandom(void* to, std::size_t bytes, unsigned flags) {
  if (hooks() != nullptr && hooks()->random_bytes("getrandom", to, bytes)) {
    return static_cast<ssize_t>(bytes);
  }
  ORRERY_SYSTEM(getrandom, ssize_t(void*, std::size_t, unsigned));
  return system(to, bytes, flags);
}

ORRERY_HOOK int getentropy(void* to, std::size_t bytes) {
  constexpr std::size_t kMost = 256;  // as the C library's
  if (bytes <= kMost && hooks() != nullptr && hooks()->random_bytes("getentropy", to, bytes)) {
    return 0;
  }
  ORRERY_SYSTEM(getentropy, int(void*, std::size_t));
  return system(to, bytes);
}

// Since glibc 2.36, so that the compiler's headers may not know them.
ORRERY_HOOK std::uint32_t arc4random() noexcept {
  std::uint32_t number = 0;
  if (hooks() != nullptr && hooks()->random_bytes("arc4random", &number, sizeof number)) {
    return number;
  }
  ORRERY_SYSTEM(arc4random, std::uint32_t());
  return system();
}

ORRERY_HOOK void arc4random_buf(void* to, std::size_t bytes) noexcept {
  if (hooks() != nullptr && hooks()->random_bytes("arc4random_buf", to, bytes)) return;
  ORRERY_SYSTEM(arc4random_buf, void(void*, std::size_t));
  system(to, bytes);
}

// Without bias: what lies above the last whole multiple is drawn again.
ORRERY_HOOK std::uint32_t arc4random_uniform(std::uint32_t below) noexcept {
  std::uint64_t bits = 0;
  if (hooks() != nullptr && hooks()->random_bytes("arc4random_uniform", &bits, sizeof bits)) {
    if (below < 2) return 0;
    const std::uint64_t limit = UINT64_MAX / below * below;
    while (bits >= limit) hooks()->random_bytes("arc4random_uniform", &bits, sizeof bits);
    return static_cast<std::uint32_t>(bits % below);
  }
  ORRERY_SYSTEM(arc4random_uniform, std::uint32_t(std::uint32_t));
  return system(below);
}

// std::random_device::_M_getval(), which executes rdrand: no call of the C library shows it.
ORRERY_HOOK unsigned _ZNSt13random_device9_M_getvalEv(void* self) {
  std::uint32_t number = 0;
  if (hooks() != nullptr && hooks()->random_bytes("std::random_device", &number, sizeof number)) {
    return number;
  }
  ORRERY_SYSTEM(_ZNSt13random_device9_M_getvalEv, unsigned(void*));
  return system(self);
}

// ---- threads

ORRERY_HOOK int pthread_create(pthread_t* thread, const pthread_attr_t* attributes,
                               void* (*function)(void*), void* argument) noexcept {
  if (hooks() != nullptr) hooks()->start_thread("pthread_create");
  ORRERY_SYSTEM(pthread_create, int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*));
  return system(thread, attributes, function, argument);
}

ORRERY_HOOK int thrd_create(thrd_t* thread, thrd_start_t function, void* argument) {
  if (hooks() != nullptr) hooks()->start_thread("thrd_create");
  ORRERY_SYSTEM(thrd_create, int(thrd_t*, thrd_start_t, void*));
  return system(thread, function, argument);
}

// ---- self-test

extern "C" bool orrery_services_are_virtual() {
  return true;
}

// The index-th hook that the dynamic loader would not give to a library; null: no more.
extern "C" const char* orrery_service_hook_not_taken(std::size_t index) {
  struct Hook {
    const char* name;
    void* address;
  };
#define ORRERY_ENTRY(name) \
  { #name, reinterpret_cast < void*>(&name) }
  static const Hook all[] = {
      ORRERY_ENTRY(clock_gettime),
      ORRERY_ENTRY(gettimeofday),
      ORRERY_ENTRY(time),
      ORRERY_ENTRY(clock),
      ORRERY_ENTRY(nanosleep),
      ORRERY_ENTRY(clock_nanosleep),
      ORRERY_ENTRY(usleep),
      ORRERY_ENTRY(sleep),
      ORRERY_ENTRY(rand),
      ORRERY_ENTRY(random),
      ORRERY_ENTRY(srand),
      ORRERY_ENTRY(srandom),
      ORRERY_ENTRY(getrandom),
      ORRERY_ENTRY(getentropy),
      ORRERY_ENTRY(arc4random),
      ORRERY_ENTRY(arc4random_buf),
      ORRERY_ENTRY(arc4random_uniform),
      ORRERY_ENTRY(_ZNSt13random_device9_M_getvalEv),
      ORRERY_ENTRY(pthread_create),
      ORRERY_ENTRY(thrd_create),
  };
#undef ORRERY_ENTRY
  for (const Hook& hook : all) {
    if (dlsym(RTLD_DEFAULT, hook.name) == hook.address) continue;
    if (index-- == 0) return hook.name;
  }
  return nullptr;
}

#endif
