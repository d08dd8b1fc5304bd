// What reads or writes flight memory does so as flight code; the rest is simulator code under
// SimulatorScope. A crash may leave these functions between any two lines.

#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/file_services.hpp>
#include <orrery/harness/flight/flight_memory.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <stdio_ext.h>
#include <unistd.h>

namespace orrery::internal {
namespace {

constexpr int kFirst = 512, kEnd = 1024;
constexpr std::size_t kLongestPath = 1024;
constexpr std::int64_t kHere = -1;  // at the file's own offset

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define ORRERY_SANITIZER_OPENS_FILES
#endif
#endif
#if defined(__SANITIZE_ADDRESS__)
#define ORRERY_SANITIZER_OPENS_FILES
#endif
// To print where an error was, a sanitizer opens files from within flight code.
#ifdef ORRERY_SANITIZER_OPENS_FILES
constexpr bool kCanRefuse = false;
#else
constexpr bool kCanRefuse = true;
#endif

// As flight code. False: too long.
bool copy_path(char (&to)[kLongestPath], const char* path) {
  const std::size_t length = strnlen(path, kLongestPath);
  if (length == kLongestPath) return false;
  copy_between(to, path, length);
  to[length] = 0;
  return true;
}

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
    const OpenFile* file = find(fd);
    if (file != nullptr && file->stream != nullptr) std::fflush(file->stream->file);
  }
}

void FileServices::close_all() {
  for (auto& [fd, file] : open_) {
    if (file.stream != nullptr) orphans_.push_back(std::move(file.stream));
  }
  for (const std::shared_ptr<Stream>& stream : orphans_) {
    stream->services = nullptr;
    if (stream->closed) continue;
    __fpurge(stream->file);
    std::fclose(stream->file);
  }
  orphans_.clear();
  open_.clear();
}

FileServices::OpenFile* FileServices::find(int fd) {
  const auto found = open_.find(fd);
  return found == open_.end() ? nullptr : &found->second;
}

// ---- paths

FileServices::Place FileServices::place_of(int folder, const char* text, std::string& path) const {
  std::string from = "/";
  if (text[0] != '/' && folder != AT_FDCWD) {
    const auto base = open_.find(folder);
    if (base == open_.end()) return Place::kHost;
    from = base->second.path;
  }
  path = FlightFiles::normal(from, text);
  if (memory_->files.covers(path)) return Place::kOurs;
  // A folder above one of ours: it is there, with nothing in it but the way to ours.
  if (memory_->files.find(path) != nullptr && options_.other_files != OtherFiles::kHost) {
    return Place::kOurs;
  }
  switch (options_.other_files) {
    case OtherFiles::kHost:
      return Place::kHost;
    case OtherFiles::kAbsent:
      return Place::kAbsent;
    case OtherFiles::kRefuse:
      break;
  }
  return kCanRefuse ? Place::kRefused : Place::kHost;
}

// action(path), as simulator code, where the path is the spacecraft's.
template <class Action>
FileView::Result FileServices::at_path(const char* function, int folder, const char* given,
                                       Action action) {
  char text[kLongestPath];
  if (!copy_path(text, given)) return -ENAMETOOLONG;
  char refusal[192];
  Place place = Place::kHost;
  long result = 0;
  {
    const SimulatorScope scope;
    std::string path;
    place = place_of(folder, text, path);
    if (place == Place::kOurs) result = action(path);
    std::snprintf(refusal, sizeof refusal,
                  "%s(\"%.100s\") called: no file of this spacecraft (FlightOptions::files)",
                  function, text);
  }
  if (place == Place::kRefused) end_running_call(CrashKind::kForbiddenCall, refusal);
  if (place == Place::kHost) return std::nullopt;
  return place == Place::kOurs ? result : -ENOENT;
}

FileView::Result FileServices::open(const char* function, int folder, const char* path, int flags) {
  return at_path(function, folder, path,
                 [&](const std::string& full) { return open_node(full, flags); });
}

long FileServices::open_node(const std::string& path, int flags) {
  const auto made = [&] { return files().make(path, false, clock_.unix_now_ns()); };
  FlightFiles::NodePointer node = files().find(path);
  const bool may_write = (flags & O_ACCMODE) != O_RDONLY;
  if (node == nullptr) {
    if ((flags & O_CREAT) == 0) return -ENOENT;
    if (const int error = made()) return error;
    node = files().find(path);
  } else {
    if ((flags & O_CREAT) != 0 && (flags & O_EXCL) != 0) return -EEXIST;
    if (node->is_folder && may_write) return -EISDIR;
    if (!node->is_folder && (flags & O_DIRECTORY) != 0) return -ENOTDIR;
    if (may_write && (flags & O_TRUNC) != 0) files().resize(*node, 0, clock_.unix_now_ns());
  }
  int fd = kFirst;
  while (fd < kEnd && open_.count(fd) != 0) ++fd;
  if (fd == kEnd) return -EMFILE;
  OpenFile& file = open_[fd];
  file.node = node;
  file.path = path;
  file.flags = flags;
  if (node->is_folder) file.names = files().names_in(path);
  return fd;
}

FileView::Result FileServices::resize(const char* function, const char* path, std::int64_t bytes) {
  return at_path(function, AT_FDCWD, path, [&](const std::string& full) -> long {
    const FlightFiles::NodePointer node = files().find(full);
    if (node == nullptr) return -ENOENT;
    if (node->is_folder) return -EISDIR;
    return bytes < 0
               ? -EINVAL
               : files().resize(*node, static_cast<std::uint64_t>(bytes), clock_.unix_now_ns());
  });
}

FileView::Result FileServices::status(const char* function, int folder, const char* path,
                                      struct stat* to) {
  struct stat found {};
  const Result result = at_path(function, folder, path, [&](const std::string& full) -> long {
    const FlightFiles::NodePointer node = files().find(full);
    return node == nullptr ? -ENOENT : describe(*node, &found);
  });
  if (result == 0) copy_between(to, &found, sizeof found);
  return result;
}

long FileServices::describe(const FlightFiles::Node& node, struct stat* to) const {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  constexpr std::int64_t kBlock_bytes = 512;
  *to = {};
  to->st_ino = node.number;
  to->st_nlink = 1;
  to->st_mode = node.is_folder ? S_IFDIR | 0755 : S_IFREG | 0644;
  to->st_size = static_cast<off_t>(node.content.size());
  to->st_blksize = 4096;
  to->st_blocks = (to->st_size + kBlock_bytes - 1) / kBlock_bytes;
  to->st_mtim = {node.changed_unix_ns / kSecond_ns, node.changed_unix_ns % kSecond_ns};
  to->st_atim = to->st_ctim = to->st_mtim;
  return 0;
}

FileView::Result FileServices::access(const char* function, int folder, const char* path) {
  return at_path(function, folder, path, [&](const std::string& full) -> long {
    return files().find(full) == nullptr ? -ENOENT : 0;
  });
}

FileView::Result FileServices::remove(const char* function, int folder, const char* path,
                                      Kind kind) {
  return at_path(function, folder, path, [&](const std::string& full) -> long {
    const FlightFiles::NodePointer node = files().find(full);
    const bool is_folder =
        kind == Kind::kFolder || (kind == Kind::kEither && node != nullptr && node->is_folder);
    return files().remove(full, is_folder);
  });
}

FileView::Result FileServices::rename(const char* function, const char* from, const char* to) {
  char text[kLongestPath];
  if (!copy_path(text, to)) return -ENAMETOOLONG;
  return at_path(function, AT_FDCWD, from, [&](const std::string& full) -> long {
    std::string target;
    if (place_of(AT_FDCWD, text, target) != Place::kOurs) return -EXDEV;
    return files().rename(full, target);
  });
}

FileView::Result FileServices::make_folder(const char* function, int folder, const char* path) {
  return at_path(function, folder, path, [&](const std::string& full) -> long {
    return files().make(full, true, clock_.unix_now_ns());
  });
}

// ---- descriptors

FileView::Result FileServices::close(int fd) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  const SimulatorScope scope;
  if (file->stream != nullptr) {
    file->stream->services = nullptr;
    orphans_.push_back(std::move(file->stream));
  }
  open_.erase(fd);
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

// ---- streams

FileView::Result FileServices::open_stream(const char* function, const char* path, const char* mode,
                                           FILE*& stream) {
  const int flags = flags_of(mode);
  if (flags < 0) return -EINVAL;
  const Result fd = open(function, AT_FDCWD, path, flags);
  return !fd || *fd < 0 ? fd : make_stream(static_cast<int>(*fd), mode, stream);
}

FileView::Result FileServices::open_stream(int fd, const char* mode, FILE*& stream) {
  const OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (flags_of(mode) < 0 || file->stream != nullptr) return -EINVAL;
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
  for (const auto& [fd, file] : open_) {
    if (file.stream != nullptr && file.stream->file == stream) return fd;
  }
  return std::nullopt;
}

// ---- folders

// A DIR of ours is the address of its open file, which is of no use to anybody else.
FileServices::OpenFile* FileServices::find_folder(DIR* folder, int* fd) {
  for (auto& [number, file] : open_) {
    if (reinterpret_cast<DIR*>(&file) != folder) continue;
    if (fd != nullptr) *fd = number;
    return &file;
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
