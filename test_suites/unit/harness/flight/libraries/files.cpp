// Uses files in every way that flight code does: "<verb> <path> <text>" on "do", one line back on
// "answers": what was read, or "errno" and its name where a function failed.
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dirent.h>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/uio.h>
#include <unistd.h>

#include "orrery_flight.hpp"

namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using orrery_abi::Port;

std::string failed() {
  return std::string("errno ") + strerrorname_np(errno);
}

std::string write_descriptor(const std::string& path, const std::string& text, int flags) {
  const int fd = open(path.c_str(), flags, 0644);
  if (fd < 0) return failed();
  const ssize_t written = write(fd, text.data(), text.size());
  const std::string result = written < 0 ? failed() : std::to_string(written);
  return close(fd) == 0 ? result : failed();
}

// Backwards, so that seeking shows.
std::string read_descriptor(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY);
  if (fd < 0) return failed();
  const off_t size = lseek(fd, 0, SEEK_END);
  std::string text;
  for (off_t at = size; at-- > 0;) {
    char c = 0;
    if (pread(fd, &c, 1, at) != 1) return failed();
    text += c;
  }
  close(fd);
  return text;
}

std::string read_stdio(const std::string& path) {
  FILE* file = std::fopen(path.c_str(), "r");
  if (file == nullptr) return failed();
  char line[64] = "";
  std::string text;
  while (std::fgets(line, sizeof line, file) != nullptr) text += line;
  std::rewind(file);
  int number = -1;
  if (std::fscanf(file, "%d", &number) == 1) text += "|" + std::to_string(number);
  std::fseek(file, 0, SEEK_END);
  text += "|" + std::to_string(std::ftell(file)) + "|" + std::to_string(fileno(file) >= 512);
  std::fclose(file);
  return text;
}

std::string read_stream(const std::string& path) {
  std::ifstream file(path);
  if (!file) return failed();
  std::string text, line;
  while (std::getline(file, line)) text += line + ";";
  file.clear();
  file.seekg(2);
  text += static_cast<char>(file.get());
  file.seekg(0, std::ios::end);
  return text + std::to_string(file.tellg());
}

std::string list(const std::string& path) {
  DIR* folder = opendir(path.c_str());
  if (folder == nullptr) return failed();
  std::string names;
  while (const dirent* entry = readdir(folder)) {
    names += std::string(entry->d_name) + (entry->d_type == DT_DIR ? "/ " : " ");
  }
  closedir(folder);
  return names;
}

std::string sizes(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return failed();
  return (S_ISDIR(status.st_mode) ? "folder " : "file ") + std::to_string(status.st_size) + " " +
         std::to_string(status.st_mtime);
}

std::string walk(const std::string& path) {
  std::string names;
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    names += entry.path().string() + (entry.is_directory() ? "/ " : " ");
  }
  return names;
}

std::string done(int result) {
  return result == 0 ? "done" : failed();
}

std::string read_some(int fd, std::size_t most) {
  char text[64];
  const ssize_t count = read(fd, text, most);
  return count < 0 ? failed() : std::string(text, static_cast<std::size_t>(count));
}

// The copy has the offset of the first, outlives it, and is the lowest number.
std::string copied(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY);
  const int copy = dup(fd);
  std::string text = read_some(fd, 2);
  text += "|" + read_some(copy, 2);
  lseek(copy, 1, SEEK_SET);
  text += "|" + read_some(fd, 1);
  close(fd);
  text += "|" + read_some(copy, 1) + "|" + std::to_string(copy - fd);
  close(copy);
  return text + "|" + read_some(copy, 1);
}

std::string copied_over(const std::string& path, const std::string& other) {
  const int fd = open(path.c_str(), O_RDONLY);
  const int over = open(other.c_str(), O_RDONLY);
  if (dup2(fd, fd) != fd || dup2(fd, over) != over) return failed();
  if (dup3(fd, fd, 0) != -1 || errno != EINVAL) return "dup3 of itself";
  const std::string text = read_some(over, 64);
  close(over);
  close(fd);
  return text;
}

std::string controlled(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR);
  const int copy = fcntl(fd, F_DUPFD_CLOEXEC, 700);
  std::string text = std::to_string(copy) + " " + std::to_string(fcntl(copy, F_GETFD)) +
                     std::to_string(fcntl(fd, F_GETFD));
  if (fcntl(copy, F_SETFL, O_APPEND) != 0) return failed();
  text += (fcntl(fd, F_GETFL) == (O_RDWR | O_APPEND)) ? " append" : " no";
  if (write(fd, "!", 1) != 1) return failed();
  struct flock lock {};
  lock.l_type = F_WRLCK;
  if (fcntl(fd, F_SETLK, &lock) != 0 || fcntl(fd, F_GETLK, &lock) != 0) return failed();
  text += lock.l_type == F_UNLCK ? " free" : " locked";
  close(copy);
  close(fd);
  return text + " " + std::to_string(fcntl(copy, F_GETFD));
}

// Written to, and read after its descriptor is closed; of what was mapped only all can be unmapped.
std::string mapped(const std::string& path, int flags) {
  const int fd = open(path.c_str(), O_RDONLY);
  auto* text = static_cast<char*>(mmap(nullptr, 6, PROT_READ | PROT_WRITE, flags, fd, 0));
  close(fd);
  if (text == MAP_FAILED) return failed();
  text[0] = 'X';
  std::string result(text, 5);
  result += text[5] == 0 ? "|0" : "|?";
  result += munmap(text, 8192) == 0 ? "|all" : "|" + failed();
  return result + (munmap(text, 6) == 0 ? "|done" : "|" + failed());
}

std::string temporary(std::string name, const std::string& text) {
  const int fd = mkstemp(name.data());
  if (fd < 0) return failed();
  if (write(fd, text.data(), text.size()) < 0) return failed();
  close(fd);
  return name;
}

std::string working_folder() {
  char text[64] = "";
  if (getcwd(text, sizeof text) == nullptr) return failed();
  char* allocated = getcwd(nullptr, 0);
  const bool same = allocated != nullptr && std::strcmp(allocated, text) == 0;
  std::free(allocated);
  char little[2];
  const bool fits = getcwd(little, sizeof little) != nullptr;
  return text + std::string(same ? "" : " differs") + (fits ? " fits" : " " + failed());
}

// Three parts out and, past one byte, two parts in; then one more at an offset, and back.
std::string in_parts(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT, 0644);
  char one[] = "ab", two[] = "cde";
  const iovec out[] = {{one, 2}, {nullptr, 0}, {two, 3}};
  std::string text = std::to_string(writev(fd, out, 3));
  lseek(fd, 1, SEEK_SET);
  char first[2] = {}, rest[8] = {};
  const iovec in[] = {{first, 2}, {rest, sizeof rest}};
  const ssize_t read_on = readv(fd, in, 2);
  text += "|" + std::to_string(read_on) + std::string(first, 2) + "," + rest;
  const ssize_t written = pwritev(fd, out, 1, 4), read_at = preadv(fd, in, 1, 3);
  text += "|" + std::to_string(written) + std::to_string(read_at) + std::string(first, 2) +
          std::to_string(lseek(fd, 0, SEEK_CUR));
  text += preadv(fd, in, 1, -1) < 0 ? "|" + failed() : "|read";
  const volatile int too_many = IOV_MAX + 1;
  text += readv(fd, in, too_many) < 0 ? "|" + failed() : "|read";
  close(fd);
  return text + (writev(fd, out, 3) < 0 ? "|" + failed() : "|written");
}

// By sendfile from an offset of its own, and by copy_file_range from the file's.
std::string sent(const std::string& path, const std::string& other) {
  const int from = open(path.c_str(), O_RDONLY);
  const int to = open(other.c_str(), O_RDWR | O_CREAT, 0644);
  off_t at = 2;
  std::string text = std::to_string(sendfile(to, from, &at, 3));
  text += " " + std::to_string(at);
  text += "|" + std::to_string(copy_file_range(from, nullptr, to, nullptr, 100, 0));
  text += "|" + std::to_string(copy_file_range(from, nullptr, to, nullptr, 100, 0));
  text += sendfile(from, to, nullptr, 1) < 0 ? "|" + failed() : "|sent";
  close(from);
  close(to);
  return text;
}

std::string locked(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR);
  const int other = open(path.c_str(), O_RDWR);
  std::string text = done(flock(fd, LOCK_EX | LOCK_NB));
  text += " " + done(lockf(other, F_TLOCK, 0));
  close(other);
  close(fd);
  return text + " " + done(flock(fd, LOCK_UN));
}

std::string allocated(const std::string& path) {
  const int fd = open(path.c_str(), O_RDWR);
  std::string text = std::to_string(posix_fallocate(fd, 2, 4)) + " ";
  text += std::to_string(posix_fallocate(fd, 0, 3)) + " ";
  text += std::string(strerrorname_np(posix_fallocate(fd, 0, 1000))) + " ";
  text += done(fallocate(fd, FALLOC_FL_KEEP_SIZE, 0, 8)) + " ";
  text += std::to_string(posix_fadvise(fd, 0, 0, POSIX_FADV_SEQUENTIAL)) + " ";
  close(fd);
  const std::filesystem::space_info space = std::filesystem::space(path);
  return text + std::to_string(space.capacity) + " " + std::to_string(space.available);
}

// What is there but means nothing, and what is not there.
std::string attributes(const std::string& path, const std::string& other) {
  const char* p = path.c_str();
  const timespec times[2] = {};
  std::string text = done(chmod(p, 0600));
  text += " " + done(utimensat(AT_FDCWD, p, times, 0));
  text += " " + done(symlink(p, other.c_str()));
  text += " " + done(link(p, other.c_str()));
  text += " " + done(link(other.c_str(), p));
  char to[8];
  text += readlink(p, to, sizeof to) < 0 ? " " + failed() : " link";
  struct statx status {};
  text += " " + done(statx(AT_FDCWD, p, 0, STATX_SIZE, &status));
  text += std::to_string(status.stx_size);
  const int fd = open(p, O_RDONLY);
  text += " " + done(ioctl(fd, TIOCGWINSZ, to));
  text += " " + done(fchmod(fd, 0600));
  text += " " + done(renameat(AT_FDCWD, p, AT_FDCWD, other.c_str()));
  close(fd);
  return text;
}

FILE* left_open = nullptr;
// Not null, which the undefined-behaviour sanitizer looks for; volatile against the compiler.
const char* volatile nowhere = reinterpret_cast<const char*>(8);

std::string perform(const std::string& verb, const std::string& path, const std::string& text) {
  const char* p = path.c_str();
  if (verb == "write") return write_descriptor(path, text, O_WRONLY | O_CREAT | O_TRUNC);
  if (verb == "append") return write_descriptor(path, text, O_WRONLY | O_APPEND);
  if (verb == "create") return write_descriptor(path, text, O_WRONLY | O_CREAT | O_EXCL);
  if (verb == "read") return read_descriptor(path);
  if (verb == "fopen") return read_stdio(path);
  if (verb == "ifstream") return read_stream(path);
  if (verb == "ofstream") {
    std::ofstream file(path, std::ios::app);
    file << text << 42 << '\n';
    file.close();
    return file ? "done" : failed();
  }
  if (verb == "fprintf") {
    FILE* file = std::fopen(p, "w");
    if (file == nullptr) return failed();
    std::fprintf(file, "%s\n", text.c_str());
    return done(std::fclose(file));
  }
  if (verb == "leave") {  // in the buffer, for as long as the process lives
    left_open = std::fopen(p, "a");
    std::fputs(text.c_str(), left_open);
    return "done";
  }
  if (verb == "flush") return done(std::fflush(left_open));
  if (verb == "sync") return done(fsync(fileno(left_open)));
  if (verb == "close_under") {
    FILE* file = std::fopen(p, "w");
    std::fputs(text.c_str(), file);
    close(fileno(file));
    return done(std::fclose(file));
  }
  if (verb == "stat") return sizes(path);
  if (verb == "list") return list(path);
  if (verb == "walk") return walk(path);
  if (verb == "mkdir") return done(mkdir(p, 0755));
  if (verb == "rmdir") return done(rmdir(p));
  if (verb == "unlink") return done(unlink(p));
  if (verb == "rename") return done(std::rename(p, text.c_str()));
  if (verb == "truncate") return done(truncate(p, 3));
  if (verb == "exists") return std::filesystem::exists(path) ? "yes" : "no";
  if (verb == "null") return std::to_string(open(nowhere, O_RDONLY));
  if (verb == "dup") return copied(path);
  if (verb == "dup2") return copied_over(path, text);
  if (verb == "dup2_to_host") return std::to_string(dup2(open(p, O_RDONLY), 1));
  if (verb == "fcntl") return controlled(path);
  if (verb == "map") return mapped(path, MAP_PRIVATE);
  if (verb == "map_shared") return mapped(path, MAP_SHARED);
  if (verb == "map_fixed") return mapped(path, MAP_PRIVATE | MAP_FIXED);
  if (verb == "mkstemp") return temporary(path, text);
  if (verb == "mkdtemp") {
    std::string name = path;
    return mkdtemp(name.data()) == nullptr ? failed() : name;
  }
  if (verb == "tmpfile") return std::tmpfile() == nullptr ? failed() : "made";
  if (verb == "freopen") return std::freopen(p, "w", stdout) == nullptr ? failed() : "made";
  if (verb == "chdir") return done(chdir(p));
  if (verb == "getcwd") return working_folder();
  if (verb == "realpath") {
    char whole[PATH_MAX];
    return realpath(p, whole) == nullptr ? failed() : whole;
  }
  if (verb == "parts") return in_parts(path);
  if (verb == "send") return sent(path, text);
  if (verb == "copy_file") {
    std::error_code error;
    std::filesystem::copy_file(path, text, error);
    return error ? error.message() : "done";
  }
  if (verb == "send_to_host") {
    return std::to_string(sendfile(1, open(p, O_RDONLY), nullptr, 1));
  }
  if (verb == "lock") return locked(path);
  if (verb == "allocate") return allocated(path);
  if (verb == "attributes") return attributes(path, text);
  if (verb == "many") {
    int opened = 0;
    while (open(p, O_RDONLY) >= 0) ++opened;
    return std::to_string(opened) + " " + failed();
  }
  return "no such verb";
}

class Files {
 public:
  Files(Host host, const orrery_boot&) : host_(host) {}
  std::int32_t order(std::int64_t, Bytes message) {
    const std::string all(static_cast<const char*>(message.data), message.size);
    const std::size_t first = all.find(' ');
    const std::size_t second = std::min(all.find(' ', first + 1), all.size());
    const std::string text = second < all.size() ? all.substr(second + 1) : "";
    const std::string answer =
        perform(all.substr(0, first), all.substr(first + 1, second - first - 1), text);
    host_.output(2, {answer.data(), static_cast<std::uint32_t>(answer.size())});
    return ORRERY_OK;
  }
  std::int32_t tick(std::int64_t) { return ORRERY_OK; }
  static const Port<Files> (&ports())[2] {
    static const Port<Files> table[2] = {{1, ORRERY_IN, ORRERY_PACKET, "do", 1024, &Files::order},
                                         {2, ORRERY_OUT, ORRERY_PACKET, "answers", 1024, nullptr}};
    return table;
  }

 private:
  Host host_;
};

}  // namespace

ORRERY_FLIGHT_LIBRARY(Files, "files", "1.0")
