// Paths of flight code: which file of the spacecraft is meant, and what is done with it.

#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/file_services.hpp>
#include <orrery/harness/flight/flight_memory.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>

namespace orrery::internal {
namespace {

constexpr std::size_t kLongestPath = 1024;

// As flight code. False: too long.
bool copy_path(char (&to)[kLongestPath], const char* path) {
  const std::size_t length = strnlen(path, kLongestPath);
  if (length == kLongestPath) return false;
  copy_between(to, path, length);
  to[length] = 0;
  return true;
}

}  // namespace

FileServices::Place FileServices::place_of(int folder, const char* text, std::string& path) const {
  std::string from = folder_;
  if (text[0] != '/' && folder != AT_FDCWD) {
    const auto base = open_.find(folder);
    if (base == open_.end()) return Place::kHost;
    from = base->second.file->path;
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

FileView::Result FileServices::do_at_path(const char* function, int folder, const char* given,
                                          void* action,
                                          long (*call)(void* action, const std::string& full)) {
  char text[kLongestPath];
  if (!copy_path(text, given)) return -ENAMETOOLONG;
  char refusal[192];
  Place place = Place::kHost;
  long result = 0;
  {
    const SimulatorScope scope;
    std::string path;
    place = place_of(folder, text, path);
    if (place == Place::kOurs) result = call(action, path);
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
  const int fd = free_number(0);
  if (fd < 0) return fd;
  auto file = std::make_shared<OpenFile>();
  file->node = node;
  file->path = path;
  file->flags = flags;
  if (node->is_folder) file->names = files().names_in(path);
  open_[fd] = {std::move(file), nullptr, (flags & O_CLOEXEC) != 0 ? FD_CLOEXEC : 0};
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

FileView::Result FileServices::rename(const char* function, int from_folder, const char* from,
                                      int to_folder, const char* to) {
  char text[kLongestPath];
  if (!copy_path(text, to)) return -ENAMETOOLONG;
  return at_path(function, from_folder, from, [&](const std::string& full) -> long {
    std::string target;
    if (place_of(to_folder, text, target) != Place::kOurs) return -EXDEV;
    return files().rename(full, target);
  });
}

FileView::Result FileServices::space(const char* function, const char* path, struct statvfs* to) {
  struct statvfs medium {};
  const Result result = at_path(function, AT_FDCWD, path, [&](const std::string& full) -> long {
    if (files().find(full) == nullptr) return -ENOENT;
    medium = describe_medium();
    return 0;
  });
  if (result == 0) copy_between(to, &medium, sizeof medium);
  return result;
}

FileView::Result FileServices::make_folder(const char* function, int folder, const char* path) {
  return at_path(function, folder, path, [&](const std::string& full) -> long {
    return files().make(full, true, clock_.unix_now_ns());
  });
}

// ---- temporary names

// The first number that is free, so that every run has the same names. make(path) of a file that
// does not exist yet, as simulator code.
template <class Make>
FileView::Result FileServices::at_free_name(const char* function, char* name, int suffix,
                                            Make make) {
  constexpr std::size_t kDigits = 6;
  char text[kLongestPath];
  if (!copy_path(text, name)) return -ENAMETOOLONG;
  const std::size_t behind = kDigits + static_cast<std::size_t>(std::max(suffix, 0));
  const std::size_t length = std::strlen(text);
  if (suffix < 0 || length < behind) return -EINVAL;
  const std::size_t at = length - behind;
  if (std::memcmp(text + at, "XXXXXX", kDigits) != 0) return -EINVAL;
  char digits[kDigits + 1] = "";
  const Result result = at_path(function, AT_FDCWD, text, [&](std::string full) -> long {
    const std::size_t place = full.size() - behind;
    for (int number = 1; number < 1'000'000; ++number) {
      std::snprintf(digits, sizeof digits, "%06d", number);
      full.replace(place, kDigits, digits);
      if (files().find(full) == nullptr) return make(full);
    }
    return -EEXIST;
  });
  if (result && *result >= 0) copy_between(name + at, digits, kDigits);
  return result;
}

FileView::Result FileServices::make_temporary(const char* function, char* name, int suffix,
                                              int flags) {
  return at_free_name(function, name, suffix, [&](const std::string& full) {
    return open_node(full, (flags & ~O_ACCMODE) | O_RDWR | O_CREAT | O_EXCL);
  });
}

FileView::Result FileServices::make_temporary_folder(const char* function, char* name,
                                                     char*& made) {
  made = name;
  return at_free_name(function, name, 0, [&](const std::string& full) -> long {
    return files().make(full, true, clock_.unix_now_ns());
  });
}

FileView::Result FileServices::refuse(const char* function) {
  if (options_.other_files == OtherFiles::kHost) return std::nullopt;
  if (options_.other_files == OtherFiles::kAbsent) return -EACCES;
  char refusal[160];
  std::snprintf(refusal, sizeof refusal,
                "%s() called: it works with a file of the host (FlightOptions::other_files)",
                function);
  return end_call(refusal);
}

// ---- the working folder

// That of the host belongs to the whole test program.
FileView::Result FileServices::change_folder(const char* function, const char* path) {
  const Result result = at_path(function, AT_FDCWD, path, [&](const std::string& full) -> long {
    const FlightFiles::NodePointer node = files().find(full);
    if (node == nullptr) return -ENOENT;
    if (!node->is_folder) return -ENOTDIR;
    folder_ = full;
    return 0;
  });
  if (result) return result;
  char refusal[160];
  std::snprintf(refusal, sizeof refusal,
                "%s(\"%.60s\") called: it would change the folder of the whole test program",
                function, path);
  return end_call(refusal);
}

FileView::Result FileServices::change_folder(const char* function, int fd) {
  const OpenFile* file = find(fd);
  if (file == nullptr) {
    char refusal[128];
    std::snprintf(refusal, sizeof refusal,
                  "%s(%d) called: it would change the folder of the whole test program", function,
                  fd);
    return end_call(refusal);
  }
  if (!file->node->is_folder) return -ENOTDIR;
  const SimulatorScope scope;
  folder_ = file->path;
  return 0;
}

FileView::Result FileServices::current_folder(char* to, std::size_t bytes) {
  if (options_.other_files == OtherFiles::kHost && folder_ == "/") return std::nullopt;
  if (folder_.size() >= bytes) return -ERANGE;
  std::memcpy(to, folder_.c_str(), folder_.size() + 1);
  return static_cast<long>(folder_.size());
}

FileView::Result FileServices::real_path(const char* path, char* to, std::size_t bytes) {
  return at_path("realpath", AT_FDCWD, path, [&](const std::string& full) -> long {
    if (files().find(full) == nullptr) return -ENOENT;
    if (full.size() >= bytes) return -ENAMETOOLONG;
    std::memcpy(to, full.c_str(), full.size() + 1);
    return static_cast<long>(full.size());
  });
}

}  // namespace orrery::internal
