// What reads or writes flight memory does so as flight code; the rest is simulator code under
// SimulatorScope. A crash may leave these functions between any two lines.

#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/file_services.hpp>
#include <orrery/harness/flight/flight_memory.hpp>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <fcntl.h>
#include <functional>
#include <sys/mman.h>
#include <unistd.h>

namespace orrery::internal {
namespace {

// A part of a list that flight code handed in.
iovec part_of(const iovec* parts, int i) {
  iovec part;
  copy_between(&part, parts + i, sizeof part);
  return part;
}

bool is_list(int parts, std::int64_t offset) {
  return parts >= 0 && parts <= IOV_MAX && (offset >= 0 || offset == FileView::kHere);
}

}  // namespace

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
  orphan(std::move(found->second.stream));
  open_.erase(found);
  return 0;
}

FileView::Result FileServices::read(int fd, const iovec* to, int parts, std::int64_t offset) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (!file->readable()) return -EBADF;
  if (file->node->is_folder) return -EISDIR;
  if (!is_list(parts, offset)) return -EINVAL;
  const ByteBuffer& content = file->node->content;
  const std::uint64_t begin = offset == kHere ? file->offset : static_cast<std::uint64_t>(offset);
  std::uint64_t at = begin;
  for (int i = 0; i < parts && at < content.size(); ++i) {
    const iovec part = part_of(to, i);
    const std::size_t count = std::min<std::size_t>(part.iov_len, content.size() - at);
    copy_between(part.iov_base, content.data() + at, count);
    at += count;
  }
  if (offset == kHere) file->offset = at;
  return static_cast<long>(at - begin);
}

// One write to the medium, of however many parts.
FileView::Result FileServices::write(int fd, const iovec* from, int parts, std::int64_t offset) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (!file->writable()) return -EBADF;
  if (!is_list(parts, offset)) return -EINVAL;
  std::size_t bytes = 0;
  for (int i = 0; i < parts; ++i) {
    const std::size_t count = part_of(from, i).iov_len;
    if (count > files().capacity_bytes() - bytes) return -ENOSPC;
    bytes += count;
  }
  {
    const SimulatorScope scope;
    staging_.resize(bytes);
  }
  std::size_t staged = 0;
  for (int i = 0; i < parts; ++i) {
    const iovec part = part_of(from, i);
    copy_between(staging_.data() + staged, part.iov_base, part.iov_len);
    staged += part.iov_len;
  }
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

// Within the spacecraft's files only.
FileView::Result FileServices::transfer(const char* function, int from, std::int64_t* from_offset,
                                        int to, std::int64_t* to_offset, std::size_t bytes) {
  OpenFile* in = find(from);
  OpenFile* out = find(to);
  if (in == nullptr && out == nullptr) return std::nullopt;
  if (in == nullptr || out == nullptr) return refuse_between(function, from, to);
  if (!in->readable() || !out->writable()) return -EBADF;
  if (in->node->is_folder || (out->flags & O_APPEND) != 0) return -EINVAL;
  auto read_at = static_cast<std::int64_t>(in->offset);
  auto write_at = static_cast<std::int64_t>(out->offset);
  if (from_offset != nullptr) copy_between(&read_at, from_offset, sizeof read_at);
  if (to_offset != nullptr) copy_between(&write_at, to_offset, sizeof write_at);
  if (read_at < 0 || write_at < 0) return -EINVAL;
  const ByteBuffer& content = in->node->content;
  const auto begin = std::min<std::size_t>(static_cast<std::size_t>(read_at), content.size());
  const std::size_t count = std::min(bytes, content.size() - begin);
  if (count == 0) return 0;
  {
    const SimulatorScope scope;
    staging_.assign(content.data() + begin, content.data() + begin + count);
    if (const long error = write_staged(*out, static_cast<std::uint64_t>(write_at))) return error;
  }
  read_at += static_cast<std::int64_t>(count);
  write_at += static_cast<std::int64_t>(count);
  if (from_offset == nullptr) in->offset = static_cast<std::uint64_t>(read_at);
  if (to_offset == nullptr) out->offset = static_cast<std::uint64_t>(write_at);
  if (from_offset != nullptr) copy_between(from_offset, &read_at, sizeof read_at);
  if (to_offset != nullptr) copy_between(to_offset, &write_at, sizeof write_at);
  return static_cast<long>(count);
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

// Room for what is not written yet; a medium of this size has no other use for it than size.
FileView::Result FileServices::allocate(int fd, int mode, std::int64_t offset, std::int64_t bytes) {
  OpenFile* file = find(fd);
  if (file == nullptr) return std::nullopt;
  if (!file->writable()) return -EBADF;
  std::int64_t end = 0;
  if (offset < 0 || bytes <= 0) return -EINVAL;
  if (__builtin_add_overflow(offset, bytes, &end)) return -EFBIG;
  if (mode != 0) return -EOPNOTSUPP;
  if (static_cast<std::uint64_t>(end) <= file->node->content.size()) return 0;
  const SimulatorScope scope;
  return files().resize(*file->node, static_cast<std::uint64_t>(end), clock_.unix_now_ns());
}

FileView::Result FileServices::space(int fd, struct statvfs* to) {
  if (find(fd) == nullptr) return std::nullopt;
  const struct statvfs medium = describe_medium();
  copy_between(to, &medium, sizeof medium);
  return 0;
}

// Counted in bytes.
struct statvfs FileServices::describe_medium() {
  struct statvfs medium {};
  medium.f_bsize = medium.f_frsize = 1;
  medium.f_blocks = files().capacity_bytes();
  medium.f_bfree = medium.f_bavail = files().capacity_bytes() - files().used_bytes();
  medium.f_namemax = 255;
  return medium;
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
  return refuse_between(function, fd, to);
}

long FileServices::refuse_between(const char* function, int first, int second) {
  char refusal[160];
  std::snprintf(refusal, sizeof refusal,
                "%s(%d, %d) called: between a file of this spacecraft (descriptors %d to %d) and "
                "one of the host",
                function, first, second, kFirst, kEnd - 1);
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

void install_file_view() {
  file_view = []() -> FileView* {
    return flight_code_is_running() ? running_process()->files : nullptr;
  };
}

}  // namespace orrery::internal
