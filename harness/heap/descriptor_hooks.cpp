// dup, fcntl, mmap, mkstemp, chdir and their kin for a test program, as file_hooks.cpp.

#include <orrery/harness/heap/file_call.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>

#include <climits>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

extern "C" const char* orrery_descriptor_hook_not_taken(std::size_t index);

namespace {

using namespace orrery::internal;

// Text for the caller: into `to`, or where that is null into memory of its own, as the C library
// does. Null: no room.
char* handed_over(const char* text, std::size_t bytes, char* to) {
  if (to == nullptr) to = static_cast<char*>(std::malloc(bytes));
  if (to != nullptr) std::memcpy(to, text, bytes);
  return to;
}

}  // namespace

// ---- copies of descriptors

ORRERY_HOOK int dup(int fd) noexcept {
  ORRERY_FILE_CALL(int(int), dup, int, duplicate(fd, 0, false), (fd));
}

ORRERY_HOOK int dup2(int fd, int to) noexcept {
  ORRERY_FILE_CALL(int(int, int), dup2, int, duplicate_to("dup2", fd, to), (fd, to));
}

ORRERY_HOOK int dup3(int fd, int to, int flags) noexcept {
  if (fd == to) {
    errno = EINVAL;
    return -1;
  }
  ORRERY_FILE_CALL(int(int, int, int), dup3, int, duplicate_to("dup3", fd, to), (fd, to, flags));
}

// What its third argument is, or whether there is one, depends on the second; on all systems that
// have this C library it can be read as a long.
ORRERY_HOOK int fcntl(int fd, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  const long argument = va_arg(arguments, long);
  va_end(arguments);
  ORRERY_FILE_CALL(int(int, int, ...), fcntl, int, control(fd, command, argument),
                   (fd, command, argument));
}

ORRERY_HOOK int fcntl64(int fd, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  const long argument = va_arg(arguments, long);
  va_end(arguments);
  ORRERY_FILE_CALL(int(int, int, ...), fcntl64, int, control(fd, command, argument),
                   (fd, command, argument));
}

// ---- mappings

#ifndef ORRERY_SANITIZER_OWNS_MALLOC

// The system's answer may look negative: addresses have the upper half of the words only there.
#define ORRERY_MAP_CALL(name)                                                            \
  if (FileView* view = fd < 0 || (flags & MAP_ANONYMOUS) != 0 ? nullptr : files()) {     \
    if (const FileView::Result ours = view->map(bytes, protection, flags, fd, offset)) { \
      return *ours < 0 ? reinterpret_cast<void*>(returned<std::intptr_t>(*ours))         \
                       : reinterpret_cast<void*>(*ours);                                 \
    }                                                                                    \
  }                                                                                      \
  static const auto system =                                                             \
      system_function<void*(void*, std::size_t, int, int, int, off_t)>(#name);           \
  return system(address, bytes, protection, flags, fd, offset)

ORRERY_HOOK void* mmap(void* address, std::size_t bytes, int protection, int flags, int fd,
                       off_t offset) noexcept {
  ORRERY_MAP_CALL(mmap);
}

ORRERY_HOOK void* mmap64(void* address, std::size_t bytes, int protection, int flags, int fd,
                         off_t offset) noexcept {
  ORRERY_MAP_CALL(mmap64);
}

ORRERY_HOOK int munmap(void* address, std::size_t bytes) noexcept {
  ORRERY_FILE_CALL(int(void*, std::size_t), munmap, int, unmap(address, bytes), (address, bytes));
}

#endif

// ---- files without a name of the caller's

ORRERY_HOOK int mkstemp(char* name) {
  ORRERY_FILE_CALL(int(char*), mkstemp, int, make_temporary("mkstemp", name, 0, 0), (name));
}

ORRERY_HOOK int mkstemp64(char* name) {
  ORRERY_FILE_CALL(int(char*), mkstemp64, int, make_temporary("mkstemp", name, 0, 0), (name));
}

ORRERY_HOOK int mkostemp(char* name, int flags) {
  ORRERY_FILE_CALL(int(char*, int), mkostemp, int, make_temporary("mkostemp", name, 0, flags),
                   (name, flags));
}

ORRERY_HOOK int mkstemps(char* name, int suffix) {
  ORRERY_FILE_CALL(int(char*, int), mkstemps, int, make_temporary("mkstemps", name, suffix, 0),
                   (name, suffix));
}

ORRERY_HOOK char* mkdtemp(char* name) noexcept {
  char* made = nullptr;
  ORRERY_STREAM_CALL(char*(char*), mkdtemp, made, make_temporary_folder("mkdtemp", name, made),
                     (name));
}

ORRERY_HOOK FILE* tmpfile() {
  FILE* none = nullptr;
  ORRERY_STREAM_CALL(FILE * (), tmpfile, none, refuse("tmpfile"), ());
}

ORRERY_HOOK FILE* tmpfile64() {
  FILE* none = nullptr;
  ORRERY_STREAM_CALL(FILE * (), tmpfile64, none, refuse("tmpfile"), ());
}

ORRERY_HOOK FILE* freopen(const char* path, const char* mode, FILE* stream) {
  FILE* none = nullptr;
  ORRERY_STREAM_CALL(FILE * (const char*, const char*, FILE*), freopen, none, refuse("freopen"),
                     (path, mode, stream));
}

// ---- the working folder

ORRERY_HOOK int chdir(const char* path) noexcept {
  ORRERY_FILE_CALL(int(const char*), chdir, int, change_folder("chdir", path), (path));
}

ORRERY_HOOK int fchdir(int fd) noexcept {
  ORRERY_FILE_CALL(int(int), fchdir, int, change_folder("fchdir", fd), (fd));
}

ORRERY_HOOK char* getcwd(char* to, std::size_t bytes) noexcept {
  char text[PATH_MAX];
  FileView* view = files();
  if (view != nullptr) {
    if (const FileView::Result ours = view->current_folder(text, sizeof text)) {
      const auto needed = static_cast<std::size_t>(*ours) + 1;
      if (bytes != 0 || to != nullptr) {
        if (bytes < needed) {
          errno = bytes == 0 ? EINVAL : ERANGE;
          return nullptr;
        }
      }
      return handed_over(text, needed, to);
    }
  }
  static const auto system = system_function<char*(char*, std::size_t)>("getcwd");
  return system(to, bytes);
}

ORRERY_HOOK char* realpath(const char* path, char* to) noexcept {
  char text[PATH_MAX];
  FileView* view = path == nullptr ? nullptr : files();
  if (view != nullptr) {
    if (const FileView::Result ours = view->real_path(path, text, sizeof text)) {
      if (*ours >= 0) return handed_over(text, static_cast<std::size_t>(*ours) + 1, to);
      errno = static_cast<int>(-*ours);
      return nullptr;
    }
  }
  static const auto system = system_function<char*(const char*, char*)>("realpath");
  return system(path, to);
}

// ---- self-test

// The index-th hook that the dynamic loader would not give to a library; null: no more.
extern "C" const char* orrery_descriptor_hook_not_taken(std::size_t index) {
  struct Hook {
    const char* name;
    void* address;
  };
#define ORRERY_ENTRY(name) \
  { #name, reinterpret_cast < void*>(&::name) }
  static const Hook all[] = {
      ORRERY_ENTRY(dup),       ORRERY_ENTRY(dup2),     ORRERY_ENTRY(dup3),
      ORRERY_ENTRY(fcntl),     ORRERY_ENTRY(fcntl64),  ORRERY_ENTRY(mkstemp),
      ORRERY_ENTRY(mkstemp64), ORRERY_ENTRY(mkostemp), ORRERY_ENTRY(mkstemps),
      ORRERY_ENTRY(mkdtemp),   ORRERY_ENTRY(tmpfile),  ORRERY_ENTRY(tmpfile64),
      ORRERY_ENTRY(freopen),   ORRERY_ENTRY(chdir),    ORRERY_ENTRY(fchdir),
      ORRERY_ENTRY(getcwd),    ORRERY_ENTRY(realpath),
#ifndef ORRERY_SANITIZER_OWNS_MALLOC
      ORRERY_ENTRY(mmap),      ORRERY_ENTRY(mmap64),   ORRERY_ENTRY(munmap),
#endif
  };
#undef ORRERY_ENTRY
  for (const Hook& hook : all) {
    if (dlsym(RTLD_DEFAULT, hook.name) == hook.address) continue;
    if (index-- == 0) return hook.name;
  }
  return nullptr;
}
