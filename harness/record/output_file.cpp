#include <orrery/harness/record/output_file.hpp>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace orrery {

namespace {

constexpr std::size_t kBufferBytes = 64 * 1024;

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  errno = 0;
  file_.open(path_, std::ios::binary | std::ios::trunc);
  if (!file_) fail("cannot be opened for writing");
  buffer_.reserve(kBufferBytes);
}

OutputFile::~OutputFile() {
  if (file_.is_open()) file_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
}

void OutputFile::write(std::string_view text) {
  require_open();
  buffer_ += text;
  size_ += text.size();
  if (buffer_.size() >= kBufferBytes) flush();
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
  file_.seekp(static_cast<std::streamoff>(position));
  file_.write(text.data(), static_cast<std::streamsize>(text.size()));
  file_.seekp(0, std::ios::end);
  if (!file_) fail("cannot be written");
}

void OutputFile::close() {
  if (!file_.is_open()) return;
  flush();
  file_.close();
  if (!file_) fail("cannot be written");
}

void OutputFile::flush() {
  errno = 0;
  file_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
  file_.flush();
  buffer_.clear();
  if (!file_) fail("cannot be written");
}

void OutputFile::continue_in(std::filesystem::path path) {
  require_open();
  file_.close();
  std::error_code error;
  std::filesystem::copy_file(path_, path, std::filesystem::copy_options::overwrite_existing, error);
  path_ = std::move(path);
  errno = error.value();
  if (error) fail("cannot be written");
  // Not with ios::app, which would forbid overwrite().
  file_.open(path_, std::ios::binary | std::ios::in | std::ios::out | std::ios::ate);
  if (!file_) fail("cannot be opened for writing");
}

void OutputFile::require_open() const {
  if (!file_.is_open()) throw std::logic_error("OutputFile: " + path_.string() + " is closed");
}

void OutputFile::fail(const char* what) const {
  const std::string reason = errno != 0 ? ": " + std::generic_category().message(errno) : "";
  throw std::runtime_error(path_.string() + " " + what + reason);
}

}  // namespace orrery
