/// Finds out whether a library writes its own globals.
#pragma once

#include <orrery/harness/flight/elf_image.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace orrery::internal {

/// Remembers what the data of a loaded library are: .data and .bss, without what the loader itself
/// writes (its RELRO part).
class GlobalsWatch {
 public:
  /// @param base     Where the library is loaded.
  /// @param ignored  An object of the library that may change; null: none.
  /// @throws std::invalid_argument  `path` is no shared library.
  GlobalsWatch(const std::string& path, std::uintptr_t base, const void* ignored,
               std::size_t ignored_bytes);

  /// Name of the first variable that has changed since, demangled, or "the byte at 0x..."; empty:
  /// none has.
  std::string changed() const;
  std::size_t bytes() const;
  /// Of the variable at an address of the library.
  std::string name_of(const std::byte* address) const;

 private:
  struct Range {
    const std::byte* begin;
    std::vector<std::byte> content;
  };

  ElfImage image_;
  std::uintptr_t base_;
  const std::byte* ignored_;
  std::size_t ignored_bytes_;
  std::vector<Range> ranges_;
};

/// Inverts one bit of a loaded library's .data and .bss: the one at `place`, 0 to 1, of the whole.
/// Says which; empty if it has none. @throws std::invalid_argument  `path` is no shared library.
std::string flip_global(const std::string& path, std::uintptr_t base, double place);

}  // namespace orrery::internal
