/// A file being written, in binary and through a buffer; every failure names the path.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace orrery {

/// Text and bytes go to the disk as they are: LF stays LF.
class OutputFile {
 public:
  /// Replaces an existing file. @throws std::runtime_error  it cannot be written.
  explicit OutputFile(std::filesystem::path path);
  /// Writes what is buffered, silently if that fails: close() first to know.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// @throws std::runtime_error  the disk is full or gone, perhaps noticed some writes later.
  void write(std::string_view text);
  void write(Bytes bytes);
  /// Puts `text` over what was written at `position`, which is then the file's business no more.
  /// @throws std::out_of_range  beyond what was written.
  void overwrite(std::uint64_t position, std::string_view text);
  /// Bytes written so far: where the next write begins.
  std::uint64_t size() const { return size_; }
  /// Further writes throw std::logic_error; a second close does nothing.
  /// @throws std::runtime_error  the rest cannot be written.
  void close();

  /// Hands what is buffered to the system. @throws std::runtime_error  it cannot be written.
  void flush();
  /// Goes on in another file, which begins as a copy of this one: in a child process after a fork,
  /// before which flush() was called. This one stays as it is.
  /// @throws std::runtime_error  it cannot be read or the other one not written.
  void continue_in(std::filesystem::path path);

  const std::filesystem::path& path() const { return path_; }

 private:
  void require_open() const;
  void write_at_end(std::string_view text);
  [[noreturn]] void fail(const char* what) const;

  std::filesystem::path path_;
  int file_ = -1;  // descriptor; -1: closed
  std::string buffer_;
  std::uint64_t size_ = 0;
};

}  // namespace orrery
