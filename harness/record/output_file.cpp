#include <orrery/harness/record/output_file.hpp>

#include <cerrno>
#include <fcntl.h>
#include <stdexcept>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace orrery {

namespace {

// Smaller ones take more calls for the same bytes, larger ones leave the processor's cache.
constexpr std::size_t kBufferBytes = 128 * 1024;

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file_ < 0) fail("cannot be opened for writing");
  buffer_.reserve(kBufferBytes);
}

OutputFile::~OutputFile() {
  if (file_ < 0) return;
  try {
    flush();
  } catch (const std::runtime_error&) {
  }
  ::close(file_);
}

void OutputFile::write(std::string_view text) {
  require_open();
  if (buffer_.size() + text.size() > kBufferBytes) flush();
  size_ += text.size();
  if (text.size() >= kBufferBytes) return write_at_end(text);
  buffer_ += text;
}

void OutputFile::write(Bytes bytes) {
  write(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

void OutputFile::overwrite(std::uint64_t position, std::string_view text) {
  require_open();
  if (position > size_ || text.size() > size_ - position) {
    throw std::out_of_range("OutputFile::overwrite: " + path_.string() + " has " +
                            std::to_string(size_) + " bytes, too few for " +
                            std::to_string(text.size()) + " at " + std::to_string(position));
  }
  flush();
  while (!text.empty()) {
    const ssize_t done = ::pwrite(file_, text.data(), text.size(), static_cast<off_t>(position));
    if (done < 0 && errno != EINTR) fail("cannot be written");
    if (done <= 0) continue;
    text.remove_prefix(static_cast<std::size_t>(done));
    position += static_cast<std::uint64_t>(done);
  }
}

void OutputFile::close() {
  if (file_ < 0) return;
  flush();
  if (::close(std::exchange(file_, -1)) != 0) fail("cannot be written");
}

void OutputFile::flush() {
  if (buffer_.empty()) return;
  // Gone whatever comes of it, so that a file that failed does not fail again when it ends.
  try {
    write_at_end(buffer_);
  } catch (...) {
    buffer_.clear();
    throw;
  }
  buffer_.clear();
}

void OutputFile::write_at_end(std::string_view text) {
  while (!text.empty()) {
    const ssize_t done = ::write(file_, text.data(), text.size());
    if (done < 0 && errno != EINTR) fail("cannot be written");
    if (done > 0) text.remove_prefix(static_cast<std::size_t>(done));
  }
}

void OutputFile::continue_in(std::filesystem::path path) {
  require_open();
  ::close(std::exchange(file_, -1));
  std::error_code error;
  std::filesystem::copy_file(path_, path, std::filesystem::copy_options::overwrite_existing, error);
  path_ = std::move(path);
  errno = error.value();
  if (error) fail("cannot be written");
  file_ = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
  // Not with O_APPEND, which would forbid overwrite().
  if (file_ < 0 || ::lseek(file_, 0, SEEK_END) < 0) fail("cannot be opened for writing");
}

void OutputFile::require_open() const {
  if (file_ < 0) throw std::logic_error("OutputFile: " + path_.string() + " is closed");
}

void OutputFile::fail(const char* what) const {
  throw std::runtime_error(path_.string() + " " + what + ": " +
                           std::generic_category().message(errno));
}

}  // namespace orrery
