// Stands for somebody's library: calls each allocation function and says what came back.

#include <cstdlib>
#include <malloc.h>
#include <string>
#include <vector>

#define EXPORT extern "C" [[gnu::visibility("default")]]

EXPORT void* probe_malloc(std::size_t n) {
  return malloc(n);
}
EXPORT void probe_free(void* p) {
  free(p);
}
EXPORT void* probe_calloc(std::size_t n) {
  return calloc(n, 1);
}
EXPORT void* probe_realloc(void* p, std::size_t n) {
  return realloc(p, n);
}
EXPORT void* probe_reallocarray(void* p, std::size_t n) {
  return reallocarray(p, n, 1);
}
EXPORT void* probe_memalign(std::size_t n) {
  return memalign(64, n);
}
EXPORT void* probe_aligned_alloc(std::size_t n) {
  return aligned_alloc(64, n);
}
EXPORT void* probe_posix_memalign(std::size_t n) {
  void* p = nullptr;
  return posix_memalign(&p, 64, n) == 0 ? p : nullptr;
}
EXPORT void* probe_valloc(std::size_t n) {
  return valloc(n);
}
EXPORT void* probe_pvalloc(std::size_t n) {
  return pvalloc(n);
}
EXPORT std::size_t probe_malloc_usable_size(void* p) {
  return malloc_usable_size(p);
}
EXPORT void* probe_new(std::size_t) {
  return new long[3];
}
struct alignas(64) Wide {
  double lanes[8];
};
EXPORT void* probe_new_wide(std::size_t) {
  return new Wide;
}
// Grows a string within libstdc++.
EXPORT std::size_t probe_string(std::size_t n) {
  std::string text;
  for (std::size_t i = 0; i < n; ++i) text.push_back('x');
  return text.size();
}
EXPORT int probe_throw_bad_alloc() {
  try {
    std::vector<char> too_much(std::size_t{1} << 33);
    return 0;
  } catch (const std::bad_alloc&) {
    return 1;
  }
}
EXPORT std::vector<int>* probe_vector() {
  return new std::vector<int>(100);
}
EXPORT long* probe_thread_local() {
  static thread_local long block[64];
  return block;
}
EXPORT void probe_throw() {
  throw std::string("a string that does not fit into the string object itself");
}
