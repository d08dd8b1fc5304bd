#include <orrery/harness/flight/globals_watch.hpp>
#include <orrery/harness/flight/library_closure.hpp>
#include <orrery/harness/kernel/sanitizers.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <memory>

namespace orrery::internal {
namespace {

// What lies between a library's variables is forbidden ground under AddressSanitizer, to memcpy and
// memcmp as well; a function of our own may read it.
#ifdef ORRERY_ADDRESS_SANITIZER
[[gnu::no_sanitize_address]] void flip(volatile std::byte* at, int bit) {
  *at = *at ^ (std::byte{1} << bit);
}

[[gnu::no_sanitize_address]] std::byte read(const volatile std::byte* from) {
  return *from;
}

void copy(const std::byte* from, std::vector<std::byte>& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = read(from + i);
}

bool equal(const std::byte* a, const std::vector<std::byte>& b) {
  for (std::size_t i = 0; i < b.size(); ++i) {
    if (read(a + i) != b[i]) return false;
  }
  return true;
}
#else
void flip(std::byte* at, int bit) {
  *at ^= std::byte{1} << bit;
}

std::byte read(const std::byte* from) {
  return *from;
}

void copy(const std::byte* from, std::vector<std::byte>& to) {
  std::memcpy(to.data(), from, to.size());
}

bool equal(const std::byte* a, const std::vector<std::byte>& b) {
  return std::memcmp(a, b.data(), b.size()) == 0;
}
#endif

std::string variable_name(const ElfImage& image, std::uintptr_t offset) {
  const std::string symbol = image.variable_at(offset);
  if (symbol.empty()) {
    char text[48];
    std::snprintf(text, sizeof text, "the byte at 0x%zx", static_cast<std::size_t>(offset));
    return text;
  }
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> readable(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), std::free);
  return status == 0 ? readable.get() : symbol;
}

}  // namespace

GlobalsWatch::GlobalsWatch(const std::string& path, std::uintptr_t base, const void* ignored,
                           std::size_t ignored_bytes)
    : image_(read_file(path)),
      base_(base),
      ignored_(static_cast<const std::byte*>(ignored)),
      ignored_bytes_(ignored_bytes) {
  for (const ElfImage::AddressRange& range : image_.writable_data()) {
    const auto* begin = reinterpret_cast<const std::byte*>(base + range.begin);
    ranges_.push_back({begin, std::vector<std::byte>(range.end - range.begin)});
    copy(begin, ranges_.back().content);
  }
}

std::string GlobalsWatch::changed() const {
  for (const Range& range : ranges_) {
    if (equal(range.begin, range.content)) continue;
    for (std::size_t i = 0; i < range.content.size(); ++i) {
      const std::byte* address = range.begin + i;
      const bool may =
          ignored_ != nullptr && address >= ignored_ && address < ignored_ + ignored_bytes_;
      if (!may && read(address) != range.content[i]) return name_of(address);
    }
  }
  return "";
}

std::size_t GlobalsWatch::bytes() const {
  std::size_t sum = 0;
  for (const Range& range : ranges_) sum += range.content.size();
  return sum;
}

std::string GlobalsWatch::name_of(const std::byte* address) const {
  return variable_name(image_, reinterpret_cast<std::uintptr_t>(address) - base_);
}

std::string flip_global(const std::string& path, std::uintptr_t base, double place) {
  const ElfImage image(read_file(path));
  std::uint64_t bits = 0;
  for (const auto& range : image.writable_data()) bits += 8 * (range.end - range.begin);
  if (bits == 0) return "";
  auto bit = std::min(bits - 1, static_cast<std::uint64_t>(place * static_cast<double>(bits)));
  for (const auto& range : image.writable_data()) {
    const std::uint64_t here = 8 * (range.end - range.begin);
    if (bit >= here) {
      bit -= here;
      continue;
    }
    const std::uint64_t offset = range.begin + bit / 8;
    flip(reinterpret_cast<std::byte*>(base + offset), static_cast<int>(bit % 8));
    return "bit " + std::to_string(bit % 8) + " of a byte of " + variable_name(image, offset);
  }
  return "";
}

}  // namespace orrery::internal
