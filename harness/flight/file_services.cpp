// What reads or writes flight memory does so as flight code; the rest is simulator code under
// SimulatorScope. A crash may leave these functions between any two lines.

#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/file_services.hpp>
#include <orrery/harness/flight/flight_memory.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <functional>
#include <stdio_ext.h>
#include <sys/mman.h>
#include <unistd.h>

namespace orrery::internal {
namespace {

constexpr int kFirst = 512, kEnd = 1024;  // descriptors
constexpr std::int64_t kHere = -1;        // at the file's own offset

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
    const long result = s.services->read(s.fd, to, bytes).value_or(-EBADF);
    if (result < 0) errno = static_cast<int>(-result);
    return result < 0 ? -1 : result;
  }
  static ssize_t write(void* cookie, const char* from, std::size_t bytes) {
    const Stream& s = *static_cast<Stream*>(cookie);
    if (s.services == nullptr) {
      errno = EBADF;
      return 0;
    }
    const long result = s.services->write(s.fd, from, bytes).value_or(-EBADF);
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

bool FileServices::OpenFile::readable() const {
  return (flags & O_ACCMODE) != O_WRONLY;
}
bool FileServices::OpenFile::writable() const {
  return (flags & O_ACCMODE) != O_RDONLY;
}

FileServices::FileServices(const FlightProcessOptions& options,
                           std::shared_ptr<NonVolatileMemory> memory, const VirtualServices& clock)
    : options_(options), memory_(std::move(memory)), clock_(clock) {}

FileServices::~FileServices() {
  close_all();
}

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

FileServices::OpenFile* FileServices::find(int fd) {
  const auto found = open_.find(fd);
  return found == open_.end() ? nullptr : found->second.file.get();
}

int FileServices::free_number(int at_least) const {
  int fd = std::max(at_least, kFirst);
  while (fd < kEnd && open_.count(fd) != 0) ++fd;
  return fd < kEnd ? fd : -EMFILE;
}

// As a crash; where a sanitizer must go on, the error that the call returns.
long FileServices::end_call(const char* refusal) {
  if (kCanRefuse) end_running_call(CrashKind::kForbiddenCall, refusal);
  return -EPERM;
}

// ---- descriptors

FileView::Result FileServices::close(int fd) {
  const auto found = open_.find(fd);
  if (found == open_.end()) return std::nullopt;
  const SimulatorScope scope;
  if (std::shared_ptr<Stream>& stream = found->second.stream) {
    stream->services = nullptr;
    orphans_.push_back(std::move(stream));
  }
  open_.erase(found);
  return 0;
}

FileView::Result FileServices::read(int fd, void* to, std::size_t bytes) {
  return read_from(fd, to, bytes, kHere);
}
FileView::Result FileServices::write(int fd, const void* from, std::size_t bytes) {
  return write_to(fd, from, bytes, kHere);
}
FileView::Result FileServices::read_at(int fd, void* to, std::size_t bytes, std::int64_t offset) {
  if (offset < 0 && find(fd) != nullptr) return -EINVAL;
  return read_from(fd, to, bytes, offset);
}
FileView::Result FileServices::write_at(int fd, const void* from, std::size_t bytes,
                                        std::int64_t offset) {
  if (offset < 0 && find(fd) != nullptr) return -EINVAL;
  return write_to(fd, from, bytes, offset);
}

FileView::Result FileServices::read_from(int fd, void* to, std::size_t bytes, std::int64_t offset) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (!file->readable()) return -EBADF;
  if (file->node->is_folder) return -EISDIR;
  const std::uint64_t at = offset == kHere ? file->offset : static_cast<std::uint64_t>(offset);
  const ByteBuffer& content = file->node->content;
  if (at >= content.size()) return 0;
  const std::size_t count = std::min<std::size_t>(bytes, content.size() - at);
  copy_between(to, content.data() + at, count);
  if (offset == kHere) file->offset = at + count;
  return static_cast<long>(count);
}

FileView::Result FileServices::write_to(int fd, const void* from, std::size_t bytes,
                                        std::int64_t offset) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (!file->writable()) return -EBADF;
  if (bytes > files().capacity_bytes()) return -ENOSPC;
  {
    const SimulatorScope scope;
    staging_.resize(bytes);
  }
  copy_between(staging_.data(), from, bytes);
  const SimulatorScope scope;
  std::uint64_t at = offset == kHere ? file->offset : static_cast<std::uint64_t>(offset);
  if ((file->flags & O_APPEND) != 0) at = file->node->content.size();
  if (const long error = write_staged(*file, at)) return error;
  if (offset == kHere) file->offset = at + bytes;
  return static_cast<long>(bytes);
}

long FileServices::write_staged(OpenFile& file, std::uint64_t at) {
  const int error = memory_->write_file(*file.node, at, staging_, clock_.unix_now_ns());
  if (error == 0 && (file.flags & O_DSYNC) != 0) files().sync(*file.node);
  return error;
}

FileView::Result FileServices::seek(int fd, std::int64_t offset, int whence) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  std::int64_t from = 0;
  if (whence == SEEK_CUR) from = static_cast<std::int64_t>(file->offset);
  if (whence == SEEK_END) from = static_cast<std::int64_t>(file->node->content.size());
  std::int64_t at = 0;
  const bool known = whence == SEEK_SET || whence == SEEK_CUR || whence == SEEK_END;
  if (!known || __builtin_add_overflow(from, offset, &at) || at < 0) return -EINVAL;
  file->offset = static_cast<std::uint64_t>(at);
  return at;
}

FileView::Result FileServices::sync(int fd) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  const SimulatorScope scope;
  files().sync(*file->node);
  return 0;
}

FileView::Result FileServices::resize(int fd, std::int64_t bytes) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (!file->writable() || bytes < 0) return -EINVAL;
  const SimulatorScope scope;
  return files().resize(*file->node, static_cast<std::uint64_t>(bytes), clock_.unix_now_ns());
}

FileView::Result FileServices::status(int fd, struct stat* to) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  struct stat found {};
  describe(*file->node, &found);
  copy_between(to, &found, sizeof found);
  return 0;
}

// ---- copies of descriptors

FileView::Result FileServices::duplicate(int fd, int at_least, bool closes_at_exec) {
  if (find(fd) == nullptr) return std::nullopt;
  const SimulatorScope scope;
  const int copy = free_number(at_least);
  if (copy >= 0) open_[copy] = {open_.at(fd).file, nullptr, closes_at_exec ? FD_CLOEXEC : 0};
  return copy;
}

FileView::Result FileServices::duplicate_to(const char* function, int fd, int to) {
  const bool is_ours = find(fd) != nullptr;
  const bool takes_ours = to >= kFirst && to < kEnd;
  if (!is_ours && !takes_ours) return std::nullopt;
  if (is_ours && takes_ours) {
    if (fd == to) return to;
    close(to);
    const SimulatorScope scope;
    open_[to].file = open_.at(fd).file;
    return to;
  }
  char refusal[160];
  std::snprintf(refusal, sizeof refusal,
                "%s(%d, %d) called: between a file of this spacecraft (descriptors %d to %d) and "
                "one of the host",
                function, fd, to, kFirst, kEnd - 1);
  return end_call(refusal);
}

FileView::Result FileServices::control(int fd, int command, long argument) {
  constexpr int kSettable = O_APPEND | O_NONBLOCK;
  const auto found = open_.find(fd);
  if (found == open_.end()) return std::nullopt;
  OpenFile& file = *found->second.file;
  switch (command) {
    case F_DUPFD:
    case F_DUPFD_CLOEXEC: {
      const int at_least = static_cast<int>(argument);  // the upper half may hold anything
      if (at_least < 0 || at_least >= kEnd) return -EINVAL;
      return duplicate(fd, at_least, command == F_DUPFD_CLOEXEC);
    }
    case F_GETFD:
      return found->second.flags;
    case F_SETFD:
      found->second.flags = static_cast<int>(argument) & FD_CLOEXEC;
      return 0;
    case F_GETFL:
      return file.flags & (O_ACCMODE | O_DSYNC | kSettable);
    case F_SETFL:
      file.flags = (file.flags & ~kSettable) | (static_cast<int>(argument) & kSettable);
      return 0;
    case F_SETLK:
    case F_SETLKW:
    case F_OFD_SETLK:
    case F_OFD_SETLKW:
      return 0;
    case F_GETLK:
    case F_OFD_GETLK: {
      const decltype(flock::l_type) free = F_UNLCK;
      copy_between(&reinterpret_cast<struct flock*>(argument)->l_type, &free, sizeof free);
      return 0;
    }
    default:
      return -EINVAL;
  }
}

// ---- mappings

FileView::Result FileServices::map(std::size_t bytes, int protection, int flags, int fd,
                                   std::int64_t offset) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  if (file->node->is_folder) return -ENODEV;
  if (!file->readable()) return -EACCES;
  if (bytes == 0 || bytes > SIZE_MAX - page || offset < 0) return -EINVAL;
  const auto from = static_cast<std::size_t>(offset);
  if (from % page != 0) return -EINVAL;
  if ((flags & MAP_TYPE) != MAP_PRIVATE || (flags & MAP_FIXED) != 0) {
    char refusal[256];
    std::snprintf(refusal, sizeof refusal,
                  "mmap of \"%.100s\" called: a file of this spacecraft can be mapped MAP_PRIVATE "
                  "and where there is room, not MAP_SHARED or MAP_FIXED",
                  file->path.c_str());
    return end_call(refusal);
  }
  const SimulatorScope scope;
  const std::size_t whole = (bytes + page - 1) / page * page;
  void* memory = mmap(nullptr, whole, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return -ENOMEM;
  const ByteBuffer& content = file->node->content;
  if (from < content.size()) {
    std::memcpy(memory, content.data() + from, std::min(bytes, content.size() - from));
  }
  mprotect(memory, whole, protection);
  mappings_.push_back({static_cast<std::byte*>(memory), whole});
  return reinterpret_cast<std::intptr_t>(memory);
}

// Whole ones only.
FileView::Result FileServices::unmap(void* address, std::size_t bytes) {
  const auto* begin = static_cast<const std::byte*>(address);
  const auto found =
      std::find_if(mappings_.begin(), mappings_.end(), [begin, bytes](const Mapping& m) {
        return std::less<>()(begin, m.begin + m.bytes) && std::less<>()(m.begin, begin + bytes);
      });
  if (found == mappings_.end()) return std::nullopt;
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  if (begin != found->begin || (bytes + page - 1) / page * page != found->bytes) return -EINVAL;
  const SimulatorScope scope;
  munmap(found->begin, found->bytes);
  mappings_.erase(found);
  return 0;
}

// ---- streams

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

void install_file_view() {
  file_view = []() -> FileView* {
    return flight_code_is_running() ? running_process()->files : nullptr;
  };
}

}  // namespace orrery::internal
