// chmod, utimes, link, readlink, renameat, statx and their kin for a test program, as
// file_hooks.cpp; and what calls are named under _FORTIFY_SOURCE and in programs of older systems.

#include <orrery/harness/heap/file_call.hpp>

#include <climits>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <unistd.h>
#include <utime.h>

extern "C" const char* orrery_attribute_hook_not_taken(std::size_t index);

namespace {

using namespace orrery::internal;
using Result = FileView::Result;

Result answer_for(FileView& view, const char* function, int folder, const char* path, long answer) {
  if (path == nullptr) return answer_for(view, folder, answer);  // futimens, as utimensat
  const Result result = view.access(function, folder, path);
  return result == 0 ? Result(answer) : result;
}
// There are no links: they can neither be made nor be what a name stands for.
Result make_link(FileView& view, const char* function, int folder, const char* path) {
  const Result result = view.access(function, folder, path);
  if (!result) return result;
  return *result == 0 ? -EEXIST : -EPERM;
}

Result give_statx(FileView& view, int folder, const char* path, int flags, struct statx* to) {
  struct stat found {};
  const bool of_descriptor = (flags & AT_EMPTY_PATH) != 0 && path != nullptr && *path == 0;
  const Result result =
      of_descriptor ? view.status(folder, &found) : view.status("statx", folder, path, &found);
  if (result != 0) return result;
  *to = {};
  to->stx_mask = STATX_BASIC_STATS;
  to->stx_blksize = static_cast<std::uint32_t>(found.st_blksize);
  to->stx_nlink = static_cast<std::uint32_t>(found.st_nlink);
  to->stx_mode = static_cast<std::uint16_t>(found.st_mode);
  to->stx_ino = found.st_ino;
  to->stx_size = static_cast<std::uint64_t>(found.st_size);
  to->stx_blocks = static_cast<std::uint64_t>(found.st_blocks);
  to->stx_mtime.tv_sec = found.st_mtim.tv_sec;
  to->stx_mtime.tv_nsec = static_cast<std::uint32_t>(found.st_mtim.tv_nsec);
  to->stx_atime = to->stx_ctime = to->stx_mtime;
  return result;
}

}  // namespace

// ---- owners, modes and times, of which files of ours have only the time of their last change

ORRERY_HOOK int fchmod(int fd, mode_t mode) noexcept {
  ORRERY_RESULT_CALL(int(int, mode_t), fchmod, int, answer_for(*view, fd, 0), (fd, mode));
}

ORRERY_HOOK int chmod(const char* path, mode_t mode) noexcept {
  ORRERY_RESULT_CALL(int(const char*, mode_t), chmod, int,
                     answer_for(*view, "chmod", AT_FDCWD, path, 0), (path, mode));
}

ORRERY_HOOK int fchmodat(int folder, const char* path, mode_t mode, int flags) noexcept {
  ORRERY_RESULT_CALL(int(int, const char*, mode_t, int), fchmodat, int,
                     answer_for(*view, "fchmodat", folder, path, 0), (folder, path, mode, flags));
}

ORRERY_HOOK int fchown(int fd, uid_t owner, gid_t group) noexcept {
  ORRERY_RESULT_CALL(int(int, uid_t, gid_t), fchown, int, answer_for(*view, fd, 0),
                     (fd, owner, group));
}

ORRERY_HOOK int chown(const char* path, uid_t owner, gid_t group) noexcept {
  ORRERY_RESULT_CALL(int(const char*, uid_t, gid_t), chown, int,
                     answer_for(*view, "chown", AT_FDCWD, path, 0), (path, owner, group));
}

ORRERY_HOOK int lchown(const char* path, uid_t owner, gid_t group) noexcept {
  ORRERY_RESULT_CALL(int(const char*, uid_t, gid_t), lchown, int,
                     answer_for(*view, "lchown", AT_FDCWD, path, 0), (path, owner, group));
}

ORRERY_HOOK int fchownat(int folder, const char* path, uid_t owner, gid_t group,
                         int flags) noexcept {
  ORRERY_RESULT_CALL(int(int, const char*, uid_t, gid_t, int), fchownat, int,
                     answer_for(*view, "fchownat", folder, path, 0),
                     (folder, path, owner, group, flags));
}

ORRERY_HOOK int futimens(int fd, const timespec times[2]) noexcept {
  ORRERY_RESULT_CALL(int(int, const timespec[2]), futimens, int, answer_for(*view, fd, 0),
                     (fd, times));
}

ORRERY_HOOK int utimensat(int folder, const char* path, const timespec times[2],
                          int flags) noexcept {
  ORRERY_RESULT_CALL(int(int, const char*, const timespec[2], int), utimensat, int,
                     answer_for(*view, "utimensat", folder, path, 0), (folder, path, times, flags));
}

ORRERY_HOOK int utimes(const char* path, const timeval times[2]) noexcept {
  ORRERY_RESULT_CALL(int(const char*, const timeval[2]), utimes, int,
                     answer_for(*view, "utimes", AT_FDCWD, path, 0), (path, times));
}

ORRERY_HOOK int utime(const char* path, const utimbuf* times) noexcept {
  ORRERY_RESULT_CALL(int(const char*, const utimbuf*), utime, int,
                     answer_for(*view, "utime", AT_FDCWD, path, 0), (path, times));
}

// ---- links

ORRERY_HOOK int link(const char* from, const char* to) noexcept {
  ORRERY_RESULT_CALL(int(const char*, const char*), link, int,
                     make_link(*view, "link", AT_FDCWD, to), (from, to));
}

ORRERY_HOOK int linkat(int from_folder, const char* from, int to_folder, const char* to,
                       int flags) noexcept {
  ORRERY_RESULT_CALL(int(int, const char*, int, const char*, int), linkat, int,
                     make_link(*view, "linkat", to_folder, to),
                     (from_folder, from, to_folder, to, flags));
}

ORRERY_HOOK int symlink(const char* content, const char* path) noexcept {
  ORRERY_RESULT_CALL(int(const char*, const char*), symlink, int,
                     make_link(*view, "symlink", AT_FDCWD, path), (content, path));
}

ORRERY_HOOK int symlinkat(const char* content, int folder, const char* path) noexcept {
  ORRERY_RESULT_CALL(int(const char*, int, const char*), symlinkat, int,
                     make_link(*view, "symlinkat", folder, path), (content, folder, path));
}

ORRERY_HOOK ssize_t readlink(const char* path, char* to, std::size_t bytes) noexcept {
  ORRERY_RESULT_CALL(ssize_t(const char*, char*, std::size_t), readlink, ssize_t,
                     answer_for(*view, "readlink", AT_FDCWD, path, -EINVAL), (path, to, bytes));
}

ORRERY_HOOK ssize_t readlinkat(int folder, const char* path, char* to, std::size_t bytes) noexcept {
  ORRERY_RESULT_CALL(ssize_t(int, const char*, char*, std::size_t), readlinkat, ssize_t,
                     answer_for(*view, "readlinkat", folder, path, -EINVAL),
                     (folder, path, to, bytes));
}

ORRERY_HOOK int renameat(int from_folder, const char* from, int to_folder,
                         const char* to) noexcept {
  ORRERY_FILE_CALL(int(int, const char*, int, const char*), renameat, int,
                   rename("renameat", from_folder, from, to_folder, to),
                   (from_folder, from, to_folder, to));
}

ORRERY_HOOK int renameat2(int from_folder, const char* from, int to_folder, const char* to,
                          unsigned flags) noexcept {
  ORRERY_RESULT_CALL(int(int, const char*, int, const char*, unsigned), renameat2, int,
                     flags == 0 ? view->rename("renameat2", from_folder, from, to_folder, to)
                                : answer_for(*view, "renameat2", from_folder, from, -EINVAL),
                     (from_folder, from, to_folder, to, flags));
}

// ---- status

// What its third argument is depends on the second; see fcntl.
ORRERY_HOOK int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  ORRERY_RESULT_CALL(int(int, unsigned long, ...), ioctl, int, answer_for(*view, fd, -ENOTTY),
                     (fd, request, argument));
}

ORRERY_HOOK int statx(int folder, const char* path, int flags, unsigned mask,
                      struct statx* to) noexcept {
  ORRERY_RESULT_CALL(int(int, const char*, int, unsigned, struct statx*), statx, int,
                     give_statx(*view, folder, path, flags, to), (folder, path, flags, mask, to));
}

// ---- under _FORTIFY_SOURCE

extern "C" ssize_t __read_chk(int, void*, std::size_t, std::size_t);
extern "C" ssize_t __pread_chk(int, void*, std::size_t, off_t, std::size_t);
extern "C" ssize_t __pread64_chk(int, void*, std::size_t, off_t, std::size_t);
extern "C" int __openat_2(int, const char*, int);
extern "C" int __openat64_2(int, const char*, int);
extern "C" ssize_t __readlink_chk(const char*, char*, std::size_t, std::size_t);
extern "C" char* __realpath_chk(const char*, char*, std::size_t);
extern "C" char* __getcwd_chk(char*, std::size_t, std::size_t);

ORRERY_HOOK char* __realpath_chk(const char* path, char* to, std::size_t room) {
  if (room < PATH_MAX) std::abort();
  return realpath(path, to);
}

ORRERY_HOOK char* __getcwd_chk(char* to, std::size_t bytes, std::size_t room) {
  if (bytes > room) std::abort();
  return getcwd(to, bytes);
}

ORRERY_HOOK ssize_t __read_chk(int fd, void* to, std::size_t bytes, std::size_t room) {
  ORRERY_RESULT_CALL(ssize_t(int, void*, std::size_t, std::size_t), __read_chk, ssize_t,
                     read_one(*view, fd, to, bytes, FileView::kHere), (fd, to, bytes, room));
}

ORRERY_HOOK ssize_t __pread_chk(int fd, void* to, std::size_t bytes, off_t offset,
                                std::size_t room) {
  ORRERY_RESULT_CALL(ssize_t(int, void*, std::size_t, off_t, std::size_t), __pread_chk, ssize_t,
                     read_one(*view, fd, to, bytes, not_here(offset)),
                     (fd, to, bytes, offset, room));
}

ORRERY_HOOK ssize_t __pread64_chk(int fd, void* to, std::size_t bytes, off_t offset,
                                  std::size_t room) {
  ORRERY_RESULT_CALL(ssize_t(int, void*, std::size_t, off_t, std::size_t), __pread64_chk, ssize_t,
                     read_one(*view, fd, to, bytes, not_here(offset)),
                     (fd, to, bytes, offset, room));
}

ORRERY_HOOK int __openat_2(int folder, const char* path, int flags) {
  ORRERY_FILE_CALL(int(int, const char*, int), __openat_2, int, open("openat", folder, path, flags),
                   (folder, path, flags));
}

ORRERY_HOOK int __openat64_2(int folder, const char* path, int flags) {
  ORRERY_FILE_CALL(int(int, const char*, int), __openat64_2, int,
                   open("openat", folder, path, flags), (folder, path, flags));
}

ORRERY_HOOK ssize_t __readlink_chk(const char* path, char* to, std::size_t bytes,
                                   std::size_t room) {
  ORRERY_RESULT_CALL(ssize_t(const char*, char*, std::size_t, std::size_t), __readlink_chk, ssize_t,
                     answer_for(*view, "readlink", AT_FDCWD, path, -EINVAL),
                     (path, to, bytes, room));
}

// ---- as programs call it that were linked with a C library before 2.33

extern "C" int __xstat(int version, const char* path, struct stat* to);
extern "C" int __xstat64(int version, const char* path, struct stat64* to);
extern "C" int __lxstat(int version, const char* path, struct stat* to);
extern "C" int __lxstat64(int version, const char* path, struct stat64* to);
extern "C" int __fxstat(int version, int fd, struct stat* to);
extern "C" int __fxstat64(int version, int fd, struct stat64* to);
extern "C" int __fxstatat(int version, int folder, const char* path, struct stat* to, int flags);
extern "C" int __fxstatat64(int version, int folder, const char* path, struct stat64* to,
                            int flags);

ORRERY_HOOK int __xstat(int version, const char* path, struct stat* to) {
  ORRERY_FILE_CALL(int(int, const char*, struct stat*), __xstat, int,
                   status("stat", AT_FDCWD, path, reinterpret_cast<struct stat*>(to)),
                   (version, path, to));
}

ORRERY_HOOK int __xstat64(int version, const char* path, struct stat64* to) {
  ORRERY_FILE_CALL(int(int, const char*, struct stat64*), __xstat64, int,
                   status("stat", AT_FDCWD, path, reinterpret_cast<struct stat*>(to)),
                   (version, path, to));
}

ORRERY_HOOK int __lxstat(int version, const char* path, struct stat* to) {
  ORRERY_FILE_CALL(int(int, const char*, struct stat*), __lxstat, int,
                   status("lstat", AT_FDCWD, path, reinterpret_cast<struct stat*>(to)),
                   (version, path, to));
}

ORRERY_HOOK int __lxstat64(int version, const char* path, struct stat64* to) {
  ORRERY_FILE_CALL(int(int, const char*, struct stat64*), __lxstat64, int,
                   status("lstat", AT_FDCWD, path, reinterpret_cast<struct stat*>(to)),
                   (version, path, to));
}

ORRERY_HOOK int __fxstat(int version, int fd, struct stat* to) {
  ORRERY_FILE_CALL(int(int, int, struct stat*), __fxstat, int,
                   status(fd, reinterpret_cast<struct stat*>(to)), (version, fd, to));
}

ORRERY_HOOK int __fxstat64(int version, int fd, struct stat64* to) {
  ORRERY_FILE_CALL(int(int, int, struct stat64*), __fxstat64, int,
                   status(fd, reinterpret_cast<struct stat*>(to)), (version, fd, to));
}

ORRERY_HOOK int __fxstatat(int version, int folder, const char* path, struct stat* to, int flags) {
  ORRERY_FILE_CALL(int(int, int, const char*, struct stat*, int), __fxstatat, int,
                   status("fstatat", folder, path, reinterpret_cast<struct stat*>(to)),
                   (version, folder, path, to, flags));
}

ORRERY_HOOK int __fxstatat64(int version, int folder, const char* path, struct stat64* to,
                             int flags) {
  ORRERY_FILE_CALL(int(int, int, const char*, struct stat64*, int), __fxstatat64, int,
                   status("fstatat", folder, path, reinterpret_cast<struct stat*>(to)),
                   (version, folder, path, to, flags));
}

// ---- self-test

// The index-th hook that the dynamic loader would not give to a library; null: no more.
extern "C" const char* orrery_attribute_hook_not_taken(std::size_t index) {
  struct Hook {
    const char* name;
    void* address;
  };
#define ORRERY_ENTRY(name) \
  { #name, reinterpret_cast < void*>(&::name) }
  static const Hook all[] = {
      ORRERY_ENTRY(fchmod),         ORRERY_ENTRY(chmod),          ORRERY_ENTRY(fchmodat),
      ORRERY_ENTRY(fchown),         ORRERY_ENTRY(chown),          ORRERY_ENTRY(lchown),
      ORRERY_ENTRY(fchownat),       ORRERY_ENTRY(futimens),       ORRERY_ENTRY(utimensat),
      ORRERY_ENTRY(utimes),         ORRERY_ENTRY(utime),          ORRERY_ENTRY(link),
      ORRERY_ENTRY(linkat),         ORRERY_ENTRY(symlink),        ORRERY_ENTRY(symlinkat),
      ORRERY_ENTRY(readlink),       ORRERY_ENTRY(readlinkat),     ORRERY_ENTRY(renameat),
      ORRERY_ENTRY(renameat2),      ORRERY_ENTRY(ioctl),          ORRERY_ENTRY(statx),
      ORRERY_ENTRY(__realpath_chk), ORRERY_ENTRY(__getcwd_chk),   ORRERY_ENTRY(__read_chk),
      ORRERY_ENTRY(__pread_chk),    ORRERY_ENTRY(__pread64_chk),  ORRERY_ENTRY(__openat_2),
      ORRERY_ENTRY(__openat64_2),   ORRERY_ENTRY(__readlink_chk), ORRERY_ENTRY(__xstat),
      ORRERY_ENTRY(__xstat64),      ORRERY_ENTRY(__lxstat),       ORRERY_ENTRY(__lxstat64),
      ORRERY_ENTRY(__fxstat),       ORRERY_ENTRY(__fxstat64),     ORRERY_ENTRY(__fxstatat),
      ORRERY_ENTRY(__fxstatat64),
  };
#undef ORRERY_ENTRY
  for (const Hook& hook : all) {
    if (dlsym(RTLD_DEFAULT, hook.name) == hook.address) continue;
    if (index-- == 0) return hook.name;
  }
  return nullptr;
}
