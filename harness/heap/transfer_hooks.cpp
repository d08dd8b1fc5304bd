// readv, sendfile, flock, fallocate, statvfs and their kin for a test program, as file_hooks.cpp.
//
// Not taken: poll, select, epoll, splice and aio, to which a descriptor of ours is none at all.

#include <orrery/harness/heap/file_call.hpp>

#include <cstddef>
#include <cstdint>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/sendfile.h>
#include <sys/statfs.h>
#include <sys/statvfs.h>
#include <sys/uio.h>
#include <unistd.h>

extern "C" const char* orrery_transfer_hook_not_taken(std::size_t index);

namespace {

using namespace orrery::internal;
using Result = FileView::Result;

constexpr std::int64_t kHere = FileView::kHere;

struct statfs as_statfs(const struct statvfs& medium) {
  struct statfs result {};
  result.f_bsize = result.f_frsize = static_cast<decltype(result.f_bsize)>(medium.f_bsize);
  result.f_blocks = medium.f_blocks;
  result.f_bfree = result.f_bavail = medium.f_bfree;
  result.f_namelen = static_cast<decltype(result.f_namelen)>(medium.f_namemax);
  return result;
}
template <class Status>
Result give_statfs(Result result, const struct statvfs& medium, Status* to) {
  static_assert(sizeof(Status) == sizeof(struct statfs));
  if (result == 0) *reinterpret_cast<struct statfs*>(to) = as_statfs(medium);
  return result;
}

// posix_fallocate and posix_fadvise return the error.
int returned_error(long result) {
  return result < 0 ? static_cast<int>(-result) : 0;
}

}  // namespace

#define ORRERY_ERROR_CALL(type, name, call, arguments)                         \
  if (FileView* view = files()) {                                              \
    if (const Result ours = call) return returned_error(*ours);                \
  }                                                                            \
  static const std::add_pointer_t<type> system = system_function<type>(#name); \
  return system arguments

// ---- lists of parts

ORRERY_HOOK ssize_t readv(int fd, const iovec* parts, int count) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int), readv, ssize_t, read(fd, parts, count, kHere),
                   (fd, parts, count));
}

ORRERY_HOOK ssize_t writev(int fd, const iovec* parts, int count) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int), writev, ssize_t, write(fd, parts, count, kHere),
                   (fd, parts, count));
}

ORRERY_HOOK ssize_t preadv(int fd, const iovec* parts, int count, off_t offset) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t), preadv, ssize_t,
                   read(fd, parts, count, not_here(offset)), (fd, parts, count, offset));
}

ORRERY_HOOK ssize_t preadv64(int fd, const iovec* parts, int count, off_t offset) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t), preadv64, ssize_t,
                   read(fd, parts, count, not_here(offset)), (fd, parts, count, offset));
}

ORRERY_HOOK ssize_t pwritev(int fd, const iovec* parts, int count, off_t offset) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t), pwritev, ssize_t,
                   write(fd, parts, count, not_here(offset)), (fd, parts, count, offset));
}

ORRERY_HOOK ssize_t pwritev64(int fd, const iovec* parts, int count, off_t offset) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t), pwritev64, ssize_t,
                   write(fd, parts, count, not_here(offset)), (fd, parts, count, offset));
}

ORRERY_HOOK ssize_t preadv2(int fd, const iovec* parts, int count, off_t offset, int flags) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t, int), preadv2, ssize_t,
                   read(fd, parts, count, offset == -1 ? kHere : offset),
                   (fd, parts, count, offset, flags));
}

ORRERY_HOOK ssize_t preadv64v2(int fd, const iovec* parts, int count, off_t offset, int flags) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t, int), preadv64v2, ssize_t,
                   read(fd, parts, count, offset == -1 ? kHere : offset),
                   (fd, parts, count, offset, flags));
}

ORRERY_HOOK ssize_t pwritev2(int fd, const iovec* parts, int count, off_t offset, int flags) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t, int), pwritev2, ssize_t,
                   write(fd, parts, count, offset == -1 ? kHere : offset),
                   (fd, parts, count, offset, flags));
}

ORRERY_HOOK ssize_t pwritev64v2(int fd, const iovec* parts, int count, off_t offset, int flags) {
  ORRERY_FILE_CALL(ssize_t(int, const iovec*, int, off_t, int), pwritev64v2, ssize_t,
                   write(fd, parts, count, offset == -1 ? kHere : offset),
                   (fd, parts, count, offset, flags));
}

// ---- from file to file

ORRERY_HOOK ssize_t sendfile(int to, int from, off_t* offset, std::size_t bytes) noexcept {
  ORRERY_FILE_CALL(ssize_t(int, int, off_t*, std::size_t), sendfile, ssize_t,
                   transfer("sendfile", from, offset, to, nullptr, bytes),
                   (to, from, offset, bytes));
}

ORRERY_HOOK ssize_t sendfile64(int to, int from, off_t* offset, std::size_t bytes) noexcept {
  ORRERY_FILE_CALL(ssize_t(int, int, off_t*, std::size_t), sendfile64, ssize_t,
                   transfer("sendfile", from, offset, to, nullptr, bytes),
                   (to, from, offset, bytes));
}

ORRERY_HOOK ssize_t copy_file_range(int from, off64_t* from_offset, int to, off64_t* to_offset,
                                    std::size_t bytes, unsigned flags) {
  ORRERY_FILE_CALL(ssize_t(int, off64_t*, int, off64_t*, std::size_t, unsigned), copy_file_range,
                   ssize_t, transfer("copy_file_range", from, from_offset, to, to_offset, bytes),
                   (from, from_offset, to, to_offset, bytes, flags));
}

// ---- locks, room, advice

ORRERY_HOOK int flock(int fd, int operation) noexcept {
  ORRERY_FILE_CALL(int(int, int), flock, int, control(fd, F_SETLK, 0), (fd, operation));
}

ORRERY_HOOK int lockf(int fd, int operation, off_t bytes) {
  ORRERY_FILE_CALL(int(int, int, off_t), lockf, int, control(fd, F_SETLK, 0),
                   (fd, operation, bytes));
}

ORRERY_HOOK int lockf64(int fd, int operation, off_t bytes) {
  ORRERY_FILE_CALL(int(int, int, off_t), lockf64, int, control(fd, F_SETLK, 0),
                   (fd, operation, bytes));
}

ORRERY_HOOK int fallocate(int fd, int mode, off_t offset, off_t bytes) {
  ORRERY_FILE_CALL(int(int, int, off_t, off_t), fallocate, int, allocate(fd, mode, offset, bytes),
                   (fd, mode, offset, bytes));
}

ORRERY_HOOK int fallocate64(int fd, int mode, off_t offset, off_t bytes) {
  ORRERY_FILE_CALL(int(int, int, off_t, off_t), fallocate64, int, allocate(fd, mode, offset, bytes),
                   (fd, mode, offset, bytes));
}

ORRERY_HOOK int posix_fallocate(int fd, off_t offset, off_t bytes) {
  ORRERY_ERROR_CALL(int(int, off_t, off_t), posix_fallocate, view->allocate(fd, 0, offset, bytes),
                    (fd, offset, bytes));
}

ORRERY_HOOK int posix_fallocate64(int fd, off_t offset, off_t bytes) {
  ORRERY_ERROR_CALL(int(int, off_t, off_t), posix_fallocate64, view->allocate(fd, 0, offset, bytes),
                    (fd, offset, bytes));
}

ORRERY_HOOK int posix_fadvise(int fd, off_t offset, off_t bytes, int advice) noexcept {
  ORRERY_ERROR_CALL(int(int, off_t, off_t, int), posix_fadvise, answer_for(*view, fd, 0),
                    (fd, offset, bytes, advice));
}

ORRERY_HOOK int posix_fadvise64(int fd, off_t offset, off_t bytes, int advice) noexcept {
  ORRERY_ERROR_CALL(int(int, off_t, off_t, int), posix_fadvise64, answer_for(*view, fd, 0),
                    (fd, offset, bytes, advice));
}

ORRERY_HOOK int statvfs(const char* path, struct statvfs* to) noexcept {
  ORRERY_FILE_CALL(int(const char*, struct statvfs*), statvfs, int,
                   space("statvfs", path, reinterpret_cast<struct statvfs*>(to)), (path, to));
}

ORRERY_HOOK int statvfs64(const char* path, struct statvfs64* to) noexcept {
  ORRERY_FILE_CALL(int(const char*, struct statvfs64*), statvfs64, int,
                   space("statvfs", path, reinterpret_cast<struct statvfs*>(to)), (path, to));
}

ORRERY_HOOK int fstatvfs(int fd, struct statvfs* to) noexcept {
  ORRERY_FILE_CALL(int(int, struct statvfs*), fstatvfs, int,
                   space(fd, reinterpret_cast<struct statvfs*>(to)), (fd, to));
}

ORRERY_HOOK int fstatvfs64(int fd, struct statvfs64* to) noexcept {
  ORRERY_FILE_CALL(int(int, struct statvfs64*), fstatvfs64, int,
                   space(fd, reinterpret_cast<struct statvfs*>(to)), (fd, to));
}

ORRERY_HOOK int statfs(const char* path, struct statfs* to) noexcept {
  struct statvfs medium {};
  ORRERY_RESULT_CALL(int(const char*, struct statfs*), statfs, int,
                     give_statfs(view->space("statfs", path, &medium), medium, to), (path, to));
}

ORRERY_HOOK int statfs64(const char* path, struct statfs64* to) noexcept {
  struct statvfs medium {};
  ORRERY_RESULT_CALL(int(const char*, struct statfs64*), statfs64, int,
                     give_statfs(view->space("statfs", path, &medium), medium, to), (path, to));
}

ORRERY_HOOK int fstatfs(int fd, struct statfs* to) noexcept {
  struct statvfs medium {};
  ORRERY_RESULT_CALL(int(int, struct statfs*), fstatfs, int,
                     give_statfs(view->space(fd, &medium), medium, to), (fd, to));
}

ORRERY_HOOK int fstatfs64(int fd, struct statfs64* to) noexcept {
  struct statvfs medium {};
  ORRERY_RESULT_CALL(int(int, struct statfs64*), fstatfs64, int,
                     give_statfs(view->space(fd, &medium), medium, to), (fd, to));
}

// ---- self-test

// The index-th hook that the dynamic loader would not give to a library; null: no more.
extern "C" const char* orrery_transfer_hook_not_taken(std::size_t index) {
  struct Hook {
    const char* name;
    void* address;
  };
#define ORRERY_ENTRY(name) \
  { #name, reinterpret_cast < void*>(&::name) }
  static const Hook all[] = {
      ORRERY_ENTRY(readv),           ORRERY_ENTRY(writev),
      ORRERY_ENTRY(preadv),          ORRERY_ENTRY(preadv64),
      ORRERY_ENTRY(pwritev),         ORRERY_ENTRY(pwritev64),
      ORRERY_ENTRY(preadv2),         ORRERY_ENTRY(preadv64v2),
      ORRERY_ENTRY(pwritev2),        ORRERY_ENTRY(pwritev64v2),
      ORRERY_ENTRY(sendfile),        ORRERY_ENTRY(sendfile64),
      ORRERY_ENTRY(copy_file_range), ORRERY_ENTRY(flock),
      ORRERY_ENTRY(lockf),           ORRERY_ENTRY(lockf64),
      ORRERY_ENTRY(fallocate),       ORRERY_ENTRY(fallocate64),
      ORRERY_ENTRY(posix_fallocate), ORRERY_ENTRY(posix_fallocate64),
      ORRERY_ENTRY(posix_fadvise),   ORRERY_ENTRY(posix_fadvise64),
      ORRERY_ENTRY(statvfs),         ORRERY_ENTRY(statvfs64),
      ORRERY_ENTRY(fstatvfs),        ORRERY_ENTRY(fstatvfs64),
      ORRERY_ENTRY(statfs),          ORRERY_ENTRY(statfs64),
      ORRERY_ENTRY(fstatfs),         ORRERY_ENTRY(fstatfs64),
  };
#undef ORRERY_ENTRY
  for (const Hook& hook : all) {
    if (dlsym(RTLD_DEFAULT, hook.name) == hook.address) continue;
    if (index-- == 0) return hook.name;
  }
  return nullptr;
}
