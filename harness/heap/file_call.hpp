/// How a hook asks the files of flight code, and else the C library: for file_hooks.cpp,
/// descriptor_hooks.cpp and transfer_hooks.cpp.
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

inline FileView::Result read_one(FileView& view, int fd, void* to, std::size_t bytes,
                                 std::int64_t offset) {
  const iovec part = {to, bytes};
  return view.read(fd, &part, 1, offset);
}
inline FileView::Result write_one(FileView& view, int fd, const void* from, std::size_t bytes,
                                  std::int64_t offset) {
  const iovec part = {const_cast<void*>(from), bytes};
  return view.write(fd, &part, 1, offset);
}
// What a call comes to that changes nothing of a file of ours: `answer`, if the file is there.
inline FileView::Result answer_for(FileView& view, int fd, long answer) {
  struct stat found {};
  const FileView::Result result = view.status(fd, &found);
  return result == 0 ? FileView::Result(answer) : result;
}
// A negative offset of the caller's never means the file's own.
inline std::int64_t not_here(off_t offset) {
  return offset < 0 ? -1 : offset;
}

}  // namespace orrery::internal

// Ours, or the C library's: `call` is asked of the view, `type` and `arguments` of the library.
#define ORRERY_FILE_CALL(type, name, result, call, arguments) \
  ORRERY_RESULT_CALL(type, name, result, view->call, arguments)

// The same with an expression that mentions `view`.
#define ORRERY_RESULT_CALL(type, name, result, expression, arguments)             \
  if (FileView* view = files()) {                                                 \
    if (const FileView::Result ours = expression) return returned<result>(*ours); \
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
