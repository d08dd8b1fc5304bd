/// How a hook asks the files of flight code, and else the C library: for file_hooks.cpp and
/// descriptor_hooks.cpp.
#pragma once

#include <orrery/harness/heap/interposition.hpp>

#include <cerrno>
#include <cstdlib>
#include <dlfcn.h>
#include <type_traits>

#define ORRERY_HOOK extern "C" [[gnu::visibility("default")]]

namespace orrery::internal {

inline FileView* files() {
  return orrery::internal::file_view == nullptr ? nullptr : orrery::internal::file_view();
}

// As a system call of the C library returns: -1 and errno.
template <class T>
T returned(long result) {
  if (result >= 0) return static_cast<T>(result);
  errno = static_cast<int>(-result);
  return static_cast<T>(-1);
}

template <class T>
T* stream_or_null(long result, T* stream) {
  if (result >= 0) return stream;
  errno = static_cast<int>(-result);
  return nullptr;
}

template <class Function>
Function* system_function(const char* name) {
  void* address = dlsym(RTLD_NEXT, name);
  if (address == nullptr) std::abort();  // nobody could have linked a call of it
  return reinterpret_cast<Function*>(address);
}

}  // namespace orrery::internal

// Ours, or the C library's: `call` is asked of the view, `type` and `arguments` of the library.
#define ORRERY_FILE_CALL(type, name, result, call, arguments)                     \
  if (FileView* view = files()) {                                                 \
    if (const FileView::Result ours = view->call) return returned<result>(*ours); \
  }                                                                               \
  static const std::add_pointer_t<type> system = system_function<type>(#name);    \
  return system arguments

#define ORRERY_STREAM_CALL(type, name, object, call, arguments)                         \
  if (FileView* view = files()) {                                                       \
    object = nullptr;                                                                   \
    if (const FileView::Result ours = view->call) return stream_or_null(*ours, object); \
  }                                                                                     \
  static const std::add_pointer_t<type> system = system_function<type>(#name);          \
  return system arguments
