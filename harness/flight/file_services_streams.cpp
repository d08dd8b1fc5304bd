// FILE and DIR over the descriptors of flight code; what file_services.cpp says of a crash holds
// here, too.

#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/file_services.hpp>
#include <orrery/harness/flight/flight_memory.hpp>

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <stdio_ext.h>
#include <sys/mman.h>

namespace orrery::internal {
namespace {

// -1: no mode of fopen.
int flags_of(const char* mode) {
  const bool both = std::strchr(mode, '+') != nullptr;
  const int exclusive = std::strchr(mode, 'x') != nullptr ? O_EXCL : 0;
  const int direction = both ? O_RDWR : O_WRONLY;
  switch (mode[0]) {
    case 'r':
      return both ? O_RDWR : O_RDONLY;
    case 'w':
      return direction | O_CREAT | O_TRUNC | exclusive;
    case 'a':
      return direction | O_CREAT | O_APPEND | exclusive;
    default:
      return -1;
  }
}

}  // namespace

// The C library's FILE over one of our descriptors.
struct FileServices::Stream {
  FileServices* services = nullptr;  // null: its process is dead
  int fd = 0;
  FILE* file = nullptr;
  bool closed = false;
  char buffer[4096];

  static ssize_t read(void* cookie, char* to, std::size_t bytes) {
    const Stream& s = *static_cast<Stream*>(cookie);
    if (s.services == nullptr) return 0;
    const iovec part = {to, bytes};
    const long result = s.services->read(s.fd, &part, 1, kHere).value_or(-EBADF);
    if (result < 0) errno = static_cast<int>(-result);
    return result < 0 ? -1 : result;
  }
  static ssize_t write(void* cookie, const char* from, std::size_t bytes) {
    const Stream& s = *static_cast<Stream*>(cookie);
    if (s.services == nullptr) {
      errno = EBADF;
      return 0;
    }
    const iovec part = {const_cast<char*>(from), bytes};
    const long result = s.services->write(s.fd, &part, 1, kHere).value_or(-EBADF);
    if (result < 0) errno = static_cast<int>(-result);
    return result < 0 ? 0 : result;  // as fopencookie asks for
  }
  static int seek(void* cookie, off64_t* offset, int whence) {
    const Stream& s = *static_cast<Stream*>(cookie);
    if (s.services == nullptr) return 0;
    const long result = s.services->seek(s.fd, *offset, whence).value_or(-EBADF);
    if (result < 0) errno = static_cast<int>(-result);
    if (result >= 0) *offset = result;
    return result < 0 ? -1 : 0;
  }
  // The C library looks at the buffer no more.
  static int close(void* cookie) {
    Stream& s = *static_cast<Stream*>(cookie);
    s.closed = true;
    if (s.services == nullptr) return 0;
    const SimulatorScope scope;
    s.services->open_.erase(s.fd);  // and with it this one
    return 0;
  }
};

void FileServices::flush() {
  for (int fd = kFirst; fd < kEnd; ++fd) {  // not by an iterator: flight code may close
    const auto found = open_.find(fd);
    if (found == open_.end() || found->second.stream == nullptr) continue;
    std::fflush(found->second.stream->file);
  }
}

void FileServices::close_all() {
  for (auto& [fd, descriptor] : open_) {
    if (descriptor.stream != nullptr) orphans_.push_back(std::move(descriptor.stream));
  }
  for (const std::shared_ptr<Stream>& stream : orphans_) {
    stream->services = nullptr;
    if (stream->closed) continue;
    __fpurge(stream->file);
    std::fclose(stream->file);
  }
  orphans_.clear();
  open_.clear();
  for (const Mapping& mapping : mappings_) munmap(mapping.begin, mapping.bytes);
  mappings_.clear();
}

void FileServices::orphan(std::shared_ptr<Stream> stream) {
  if (stream == nullptr) return;
  stream->services = nullptr;
  orphans_.push_back(std::move(stream));
}

FileView::Result FileServices::open_stream(const char* function, const char* path, const char* mode,
                                           FILE*& stream) {
  const int flags = flags_of(mode);
  if (flags < 0) return -EINVAL;
  const Result fd = open(function, AT_FDCWD, path, flags);
  return !fd || *fd < 0 ? fd : make_stream(static_cast<int>(*fd), mode, stream);
}

FileView::Result FileServices::open_stream(int fd, const char* mode, FILE*& stream) {
  const auto found = open_.find(fd);
  if (found == open_.end()) return std::nullopt;
  if (flags_of(mode) < 0 || found->second.stream != nullptr) return -EINVAL;
  return make_stream(fd, mode, stream);
}

long FileServices::make_stream(int fd, const char* mode, FILE*& stream) {
  char kept_mode[8] = "";
  copy_between(kept_mode, mode, strnlen(mode, sizeof kept_mode - 1));
  const SimulatorScope scope;
  auto made = std::make_shared<Stream>();
  made->services = this;
  made->fd = fd;
  const cookie_io_functions_t functions = {Stream::read, Stream::write, Stream::seek,
                                           Stream::close};
  made->file = fopencookie(made.get(), kept_mode, functions);
  if (made->file == nullptr) return -ENOMEM;
  std::setvbuf(made->file, made->buffer, _IOFBF, sizeof made->buffer);
  stream = made->file;
  open_[fd].stream = std::move(made);
  return 0;
}

FileView::Result FileServices::descriptor_of(FILE* stream) {
  for (const auto& [fd, descriptor] : open_) {
    if (descriptor.stream != nullptr && descriptor.stream->file == stream) return fd;
  }
  return std::nullopt;
}

// ---- folders

// A DIR of ours is the address of its open file, which is of no use to anybody else.
FileServices::OpenFile* FileServices::find_folder(DIR* folder, int* fd) {
  for (auto& [number, descriptor] : open_) {
    if (reinterpret_cast<DIR*>(descriptor.file.get()) != folder) continue;
    if (fd != nullptr) *fd = number;
    return descriptor.file.get();
  }
  return nullptr;
}

FileView::Result FileServices::open_folder(const char* function, const char* path, DIR*& folder) {
  const Result fd = open(function, AT_FDCWD, path, O_RDONLY | O_DIRECTORY);
  return !fd || *fd < 0 ? fd : open_folder(static_cast<int>(*fd), folder);
}

FileView::Result FileServices::open_folder(int fd, DIR*& folder) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (!file->node->is_folder) return -ENOTDIR;
  folder = reinterpret_cast<DIR*>(file);
  return 0;
}

FileView::Result FileServices::read_folder(DIR* folder, dirent*& entry) {
  OpenFile* file = find_folder(folder);
  if (file == nullptr) return std::nullopt;
  entry = nullptr;
  if (file->next_name == file->names.size()) return 0;
  const SimulatorScope scope;
  const std::string& name = file->names[file->next_name++];
  const FlightFiles::NodePointer node = files().find(FlightFiles::normal(file->path, name));
  file->entry = {};
  file->entry.d_ino = node == nullptr ? 0 : node->number;
  file->entry.d_reclen = sizeof file->entry;
  file->entry.d_type = node != nullptr && node->is_folder ? DT_DIR : DT_REG;
  name.copy(file->entry.d_name, sizeof file->entry.d_name - 1);
  entry = &file->entry;
  return 0;
}

FileView::Result FileServices::close_folder(DIR* folder) {
  int fd = 0;
  if (find_folder(folder, &fd) == nullptr) return std::nullopt;
  return close(fd);
}

}  // namespace orrery::internal
