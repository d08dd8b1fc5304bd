// open, read, fopen, stat and their kin for a test program: flight code finds the files of its
// spacecraft, everybody else those of the host. The third part of orrery::allocator
// (interposer.cpp), for the same reasons an object file of the executable.
//
// fopen of the C library does not come here for its own open() and read(), so streams of flight
// code are made with fopencookie (harness/flight/file_services.cpp). std::fstream opens with
// fopen64, and then reads and writes by the descriptor that fileno gives.

#include <orrery/harness/heap/file_call.hpp>

#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

extern "C" const char* orrery_file_hook_not_taken(std::size_t index);

namespace {

using namespace orrery::internal;

unsigned mode_argument(int flags, va_list arguments) {
  const bool has_mode = (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE;
  return has_mode ? va_arg(arguments, unsigned) : 0;
}

}  // namespace

// ---- descriptors

ORRERY_HOOK int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const unsigned mode = mode_argument(flags, arguments);
  va_end(arguments);
  ORRERY_FILE_CALL(int(const char*, int, ...), open, int, open("open", AT_FDCWD, path, flags),
                   (path, flags, mode));
}

ORRERY_HOOK int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const unsigned mode = mode_argument(flags, arguments);
  va_end(arguments);
  ORRERY_FILE_CALL(int(const char*, int, ...), open64, int, open("open", AT_FDCWD, path, flags),
                   (path, flags, mode));
}

ORRERY_HOOK int openat(int folder, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const unsigned mode = mode_argument(flags, arguments);
  va_end(arguments);
  ORRERY_FILE_CALL(int(int, const char*, int, ...), openat, int,
                   open("openat", folder, path, flags), (folder, path, flags, mode));
}

ORRERY_HOOK int openat64(int folder, const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const unsigned mode = mode_argument(flags, arguments);
  va_end(arguments);
  ORRERY_FILE_CALL(int(int, const char*, int, ...), openat64, int,
                   open("openat", folder, path, flags), (folder, path, flags, mode));
}

// What open is called under _FORTIFY_SOURCE.
extern "C" int __open_2(const char* path, int flags);
extern "C" int __open64_2(const char* path, int flags);
ORRERY_HOOK int __open_2(const char* path, int flags) {
  ORRERY_FILE_CALL(int(const char*, int), __open_2, int, open("open", AT_FDCWD, path, flags),
                   (path, flags));
}

ORRERY_HOOK int __open64_2(const char* path, int flags) {
  ORRERY_FILE_CALL(int(const char*, int), __open64_2, int, open("open", AT_FDCWD, path, flags),
                   (path, flags));
}

ORRERY_HOOK int creat(const char* path, mode_t mode) {
  ORRERY_FILE_CALL(int(const char*, mode_t), creat, int,
                   open("creat", AT_FDCWD, path, O_CREAT | O_WRONLY | O_TRUNC), (path, mode));
}

ORRERY_HOOK int close(int fd) {
  ORRERY_FILE_CALL(int(int), close, int, close(fd), (fd));
}

ORRERY_HOOK ssize_t read(int fd, void* to, std::size_t bytes) {
  ORRERY_RESULT_CALL(ssize_t(int, void*, std::size_t), read, ssize_t,
                     read_one(*view, fd, to, bytes, FileView::kHere), (fd, to, bytes));
}

ORRERY_HOOK ssize_t write(int fd, const void* from, std::size_t bytes) {
  ORRERY_RESULT_CALL(ssize_t(int, const void*, std::size_t), write, ssize_t,
                     write_one(*view, fd, from, bytes, FileView::kHere), (fd, from, bytes));
}

ORRERY_HOOK ssize_t pread(int fd, void* to, std::size_t bytes, off_t offset) {
  ORRERY_RESULT_CALL(ssize_t(int, void*, std::size_t, off_t), pread, ssize_t,
                     read_one(*view, fd, to, bytes, not_here(offset)), (fd, to, bytes, offset));
}

ORRERY_HOOK ssize_t pread64(int fd, void* to, std::size_t bytes, off_t offset) {
  ORRERY_RESULT_CALL(ssize_t(int, void*, std::size_t, off_t), pread64, ssize_t,
                     read_one(*view, fd, to, bytes, not_here(offset)), (fd, to, bytes, offset));
}

ORRERY_HOOK ssize_t pwrite(int fd, const void* from, std::size_t bytes, off_t offset) {
  ORRERY_RESULT_CALL(ssize_t(int, const void*, std::size_t, off_t), pwrite, ssize_t,
                     write_one(*view, fd, from, bytes, not_here(offset)),
                     (fd, from, bytes, offset));
}

ORRERY_HOOK ssize_t pwrite64(int fd, const void* from, std::size_t bytes, off_t offset) {
  ORRERY_RESULT_CALL(ssize_t(int, const void*, std::size_t, off_t), pwrite64, ssize_t,
                     write_one(*view, fd, from, bytes, not_here(offset)),
                     (fd, from, bytes, offset));
}

ORRERY_HOOK off_t lseek(int fd, off_t offset, int whence) noexcept {
  ORRERY_FILE_CALL(off_t(int, off_t, int), lseek, off_t, seek(fd, offset, whence),
                   (fd, offset, whence));
}

ORRERY_HOOK off_t lseek64(int fd, off_t offset, int whence) noexcept {
  ORRERY_FILE_CALL(off_t(int, off_t, int), lseek64, off_t, seek(fd, offset, whence),
                   (fd, offset, whence));
}

ORRERY_HOOK int fsync(int fd) {
  ORRERY_FILE_CALL(int(int), fsync, int, sync(fd), (fd));
}

ORRERY_HOOK int fdatasync(int fd) {
  ORRERY_FILE_CALL(int(int), fdatasync, int, sync(fd), (fd));
}

ORRERY_HOOK int ftruncate(int fd, off_t bytes) noexcept {
  ORRERY_FILE_CALL(int(int, off_t), ftruncate, int, resize(fd, bytes), (fd, bytes));
}

ORRERY_HOOK int ftruncate64(int fd, off_t bytes) noexcept {
  ORRERY_FILE_CALL(int(int, off_t), ftruncate64, int, resize(fd, bytes), (fd, bytes));
}

ORRERY_HOOK int fstat(int fd, struct stat* to) noexcept {
  ORRERY_FILE_CALL(int(int, struct stat*), fstat, int, status(fd, to), (fd, to));
}

ORRERY_HOOK int fstat64(int fd, struct stat64* to) noexcept {
  ORRERY_FILE_CALL(int(int, struct stat64*), fstat64, int,
                   status(fd, reinterpret_cast<struct stat*>(to)), (fd, to));
}

// ---- paths

ORRERY_HOOK int truncate(const char* path, off_t bytes) noexcept {
  ORRERY_FILE_CALL(int(const char*, off_t), truncate, int, resize("truncate", path, bytes),
                   (path, bytes));
}

ORRERY_HOOK int truncate64(const char* path, off_t bytes) noexcept {
  ORRERY_FILE_CALL(int(const char*, off_t), truncate64, int, resize("truncate", path, bytes),
                   (path, bytes));
}

ORRERY_HOOK int stat(const char* path, struct stat* to) noexcept {
  ORRERY_FILE_CALL(int(const char*, struct stat*), stat, int, status("stat", AT_FDCWD, path, to),
                   (path, to));
}

ORRERY_HOOK int stat64(const char* path, struct stat64* to) noexcept {
  ORRERY_FILE_CALL(int(const char*, struct stat64*), stat64, int,
                   status("stat", AT_FDCWD, path, reinterpret_cast<struct stat*>(to)), (path, to));
}

ORRERY_HOOK int lstat(const char* path, struct stat* to) noexcept {
  ORRERY_FILE_CALL(int(const char*, struct stat*), lstat, int, status("lstat", AT_FDCWD, path, to),
                   (path, to));
}

ORRERY_HOOK int lstat64(const char* path, struct stat64* to) noexcept {
  ORRERY_FILE_CALL(int(const char*, struct stat64*), lstat64, int,
                   status("lstat", AT_FDCWD, path, reinterpret_cast<struct stat*>(to)), (path, to));
}

ORRERY_HOOK int fstatat(int folder, const char* path, struct stat* to, int flags) noexcept {
  ORRERY_FILE_CALL(int(int, const char*, struct stat*, int), fstatat, int,
                   status("fstatat", folder, path, to), (folder, path, to, flags));
}

ORRERY_HOOK int fstatat64(int folder, const char* path, struct stat64* to, int flags) noexcept {
  ORRERY_FILE_CALL(int(int, const char*, struct stat64*, int), fstatat64, int,
                   status("fstatat", folder, path, reinterpret_cast<struct stat*>(to)),
                   (folder, path, to, flags));
}

ORRERY_HOOK int access(const char* path, int mode) noexcept {
  ORRERY_FILE_CALL(int(const char*, int), access, int, access("access", AT_FDCWD, path),
                   (path, mode));
}

ORRERY_HOOK int faccessat(int folder, const char* path, int mode, int flags) noexcept {
  ORRERY_FILE_CALL(int(int, const char*, int, int), faccessat, int,
                   access("faccessat", folder, path), (folder, path, mode, flags));
}

ORRERY_HOOK int unlink(const char* path) noexcept {
  ORRERY_FILE_CALL(int(const char*), unlink, int,
                   remove("unlink", AT_FDCWD, path, FileView::Kind::kFile), (path));
}

ORRERY_HOOK int unlinkat(int folder, const char* path, int flags) noexcept {
  ORRERY_FILE_CALL(
      int(int, const char*, int), unlinkat, int,
      remove("unlinkat", folder, path,
             (flags & AT_REMOVEDIR) != 0 ? FileView::Kind::kFolder : FileView::Kind::kFile),
      (folder, path, flags));
}

ORRERY_HOOK int rmdir(const char* path) noexcept {
  ORRERY_FILE_CALL(int(const char*), rmdir, int,
                   remove("rmdir", AT_FDCWD, path, FileView::Kind::kFolder), (path));
}

ORRERY_HOOK int remove(const char* path) noexcept {
  ORRERY_FILE_CALL(int(const char*), remove, int,
                   remove("remove", AT_FDCWD, path, FileView::Kind::kEither), (path));
}

ORRERY_HOOK int rename(const char* from, const char* to) noexcept {
  ORRERY_FILE_CALL(int(const char*, const char*), rename, int,
                   rename("rename", AT_FDCWD, from, AT_FDCWD, to), (from, to));
}

ORRERY_HOOK int mkdir(const char* path, mode_t mode) noexcept {
  ORRERY_FILE_CALL(int(const char*, mode_t), mkdir, int, make_folder("mkdir", AT_FDCWD, path),
                   (path, mode));
}

ORRERY_HOOK int mkdirat(int folder, const char* path, mode_t mode) noexcept {
  ORRERY_FILE_CALL(int(int, const char*, mode_t), mkdirat, int,
                   make_folder("mkdirat", folder, path), (folder, path, mode));
}

// ---- streams

ORRERY_HOOK FILE* fopen(const char* path, const char* mode) {
  FILE* stream = nullptr;
  ORRERY_STREAM_CALL(FILE * (const char*, const char*), fopen, stream,
                     open_stream("fopen", path, mode, stream), (path, mode));
}

ORRERY_HOOK FILE* fopen64(const char* path, const char* mode) {
  FILE* stream = nullptr;
  ORRERY_STREAM_CALL(FILE * (const char*, const char*), fopen64, stream,
                     open_stream("fopen", path, mode, stream), (path, mode));
}

ORRERY_HOOK FILE* fdopen(int fd, const char* mode) noexcept {
  FILE* stream = nullptr;
  ORRERY_STREAM_CALL(FILE * (int, const char*), fdopen, stream, open_stream(fd, mode, stream),
                     (fd, mode));
}

ORRERY_HOOK int fileno(FILE* stream) noexcept {
  ORRERY_FILE_CALL(int(FILE*), fileno, int, descriptor_of(stream), (stream));
}

// ---- folders

ORRERY_HOOK DIR* opendir(const char* path) {
  DIR* folder = nullptr;
  ORRERY_STREAM_CALL(DIR * (const char*), opendir, folder, open_folder("opendir", path, folder),
                     (path));
}

ORRERY_HOOK DIR* fdopendir(int fd) {
  DIR* folder = nullptr;
  ORRERY_STREAM_CALL(DIR * (int), fdopendir, folder, open_folder(fd, folder), (fd));
}

ORRERY_HOOK dirent* readdir(DIR* folder) {
  dirent* entry = nullptr;
  ORRERY_STREAM_CALL(dirent * (DIR*), readdir, entry, read_folder(folder, entry), (folder));
}

ORRERY_HOOK dirent64* readdir64(DIR* folder) {
  static_assert(sizeof(dirent) == sizeof(dirent64));
  return reinterpret_cast<dirent64*>(readdir(folder));
}

ORRERY_HOOK int closedir(DIR* folder) {
  ORRERY_FILE_CALL(int(DIR*), closedir, int, close_folder(folder), (folder));
}

// ---- self-test

// The index-th hook that the dynamic loader would not give to a library; null: no more.
extern "C" const char* orrery_file_hook_not_taken(std::size_t index) {
  struct Hook {
    const char* name;
    void* address;
  };
  static const Hook all[] = {
      {"open", reinterpret_cast<void*>(&::open)},
      {"open64", reinterpret_cast<void*>(&::open64)},
      {"openat", reinterpret_cast<void*>(&::openat)},
      {"openat64", reinterpret_cast<void*>(&::openat64)},
      {"__open_2", reinterpret_cast<void*>(&::__open_2)},
      {"__open64_2", reinterpret_cast<void*>(&::__open64_2)},
      {"creat", reinterpret_cast<void*>(&::creat)},
      {"close", reinterpret_cast<void*>(&::close)},
      {"read", reinterpret_cast<void*>(&::read)},
      {"pread", reinterpret_cast<void*>(&::pread)},
      {"pread64", reinterpret_cast<void*>(&::pread64)},
      {"write", reinterpret_cast<void*>(&::write)},
      {"pwrite", reinterpret_cast<void*>(&::pwrite)},
      {"pwrite64", reinterpret_cast<void*>(&::pwrite64)},
      {"lseek", reinterpret_cast<void*>(&::lseek)},
      {"lseek64", reinterpret_cast<void*>(&::lseek64)},
      {"fsync", reinterpret_cast<void*>(&::fsync)},
      {"fdatasync", reinterpret_cast<void*>(&::fdatasync)},
      {"ftruncate", reinterpret_cast<void*>(&::ftruncate)},
      {"ftruncate64", reinterpret_cast<void*>(&::ftruncate64)},
      {"truncate", reinterpret_cast<void*>(&::truncate)},
      {"truncate64", reinterpret_cast<void*>(&::truncate64)},
      {"fstat", reinterpret_cast<void*>(&::fstat)},
      {"fstat64", reinterpret_cast<void*>(&::fstat64)},
      {"stat", reinterpret_cast<void*>(&::stat)},
      {"stat64", reinterpret_cast<void*>(&::stat64)},
      {"lstat", reinterpret_cast<void*>(&::lstat)},
      {"lstat64", reinterpret_cast<void*>(&::lstat64)},
      {"fstatat", reinterpret_cast<void*>(&::fstatat)},
      {"fstatat64", reinterpret_cast<void*>(&::fstatat64)},
      {"access", reinterpret_cast<void*>(&::access)},
      {"faccessat", reinterpret_cast<void*>(&::faccessat)},
      {"unlink", reinterpret_cast<void*>(&::unlink)},
      {"unlinkat", reinterpret_cast<void*>(&::unlinkat)},
      {"rmdir", reinterpret_cast<void*>(&::rmdir)},
      {"remove", reinterpret_cast<void*>(static_cast<int (*)(const char*)>(&::remove))},
      {"rename", reinterpret_cast<void*>(&::rename)},
      {"mkdir", reinterpret_cast<void*>(&::mkdir)},
      {"mkdirat", reinterpret_cast<void*>(&::mkdirat)},
      {"fopen", reinterpret_cast<void*>(&::fopen)},
      {"fopen64", reinterpret_cast<void*>(&::fopen64)},
      {"fdopen", reinterpret_cast<void*>(&::fdopen)},
      {"fileno", reinterpret_cast<void*>(&::fileno)},
      {"opendir", reinterpret_cast<void*>(&::opendir)},
      {"fdopendir", reinterpret_cast<void*>(&::fdopendir)},
      {"readdir", reinterpret_cast<void*>(&::readdir)},
      {"readdir64", reinterpret_cast<void*>(&::readdir64)},
      {"closedir", reinterpret_cast<void*>(&::closedir)},
  };
  for (const Hook& hook : all) {
    if (dlsym(RTLD_DEFAULT, hook.name) == hook.address) continue;
    if (index-- == 0) return hook.name;
  }
  return nullptr;
}
