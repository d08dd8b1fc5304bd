#include <orrery/harness/flight/globals_watch.hpp>
#include <orrery/harness/flight/library_closure.hpp>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <memory>

namespace orrery::internal {

GlobalsWatch::GlobalsWatch(const std::string& path, std::uintptr_t base, const void* ignored,
                           std::size_t ignored_bytes)
    : image_(read_file(path)),
      base_(base),
      ignored_(static_cast<const std::byte*>(ignored)),
      ignored_bytes_(ignored_bytes) {
  for (const ElfImage::AddressRange& range : image_.writable_data()) {
    const auto* begin = reinterpret_cast<const std::byte*>(base + range.begin);
    ranges_.push_back({begin, std::vector<std::byte>(begin, begin + (range.end - range.begin))});
  }
}

std::string GlobalsWatch::changed() const {
  for (const Range& range : ranges_) {
    if (std::memcmp(range.begin, range.content.data(), range.content.size()) == 0) continue;
    for (std::size_t i = 0; i < range.content.size(); ++i) {
      const std::byte* address = range.begin + i;
      const bool may =
          ignored_ != nullptr && address >= ignored_ && address < ignored_ + ignored_bytes_;
      if (!may && *address != range.content[i]) return name_of(address);
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
  const std::uintptr_t offset = reinterpret_cast<std::uintptr_t>(address) - base_;
  const std::string symbol = image_.variable_at(offset);
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

}  // namespace orrery::internal
