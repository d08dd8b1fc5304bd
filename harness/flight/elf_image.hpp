/// A shared library's file in memory: what the loader must know of it, and what it changes in a
/// copy.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace orrery::internal {

/// Functions that the dynamic loader runs when it loads and unloads a library, as addresses before
/// relocation; 0: none. Arrays hold relocated pointers once the library is loaded.
struct LifeFunctions {
  std::uint64_t init = 0, init_array = 0, init_array_bytes = 0;
  std::uint64_t fini = 0, fini_array = 0, fini_array_bytes = 0;
};

/// 64-bit little-endian ELF only.
class ElfImage {
 public:
  /// @throws std::invalid_argument  the bytes are no such shared library, or are cut short.
  explicit ElfImage(ByteBuffer file);

  const ByteBuffer& bytes() const { return file_; }
  /// Libraries that it names as needed.
  std::vector<std::string> needed() const;
  /// Its own name for others, "" if it has none.
  std::string soname() const;
  /// DT_RUNPATH, else DT_RPATH: folders separated by colons, as written.
  std::string run_path() const;
  /// Changes names of libraries, its own or needed, to others of the same length.
  void rename_libraries(const std::map<std::string, std::string>& names);

  /// Symbols that g++ marks as one per program (statics of inline functions, inline variables)
  /// would be one for all copies, and keep a copy loaded for ever. As weak ones each copy has its
  /// own. Returns their names. @throws std::invalid_argument  no table of sections to find them by.
  std::vector<std::string> make_unique_symbols_weak();

  /// Takes them from the loader's hands, so that they can run as flight code, or never.
  LifeFunctions detach_life_functions();

  /// Name of the function that contains an address (before relocation), "" if the file does not
  /// tell. Uses the full symbol table where it was not stripped.
  std::string function_at(std::uint64_t address) const;
  std::string variable_at(std::uint64_t address) const;

  struct AddressRange {
    std::uint64_t begin = 0, end = 0;
  };
  /// .data, .bss and the like: what it may write, without what is read-only after relocation.
  std::vector<AddressRange> writable_data() const;

 private:
  template <class T>
  T read(std::uint64_t offset) const;
  template <class T>
  void write(std::uint64_t offset, const T& value);
  std::string text(std::uint64_t offset) const;
  std::uint64_t file_offset(std::uint64_t address) const;
  void find_dynamic();
  void find_symbols();
  std::string symbol_at(std::uint64_t address, unsigned char type) const;
  std::uint64_t dynamic_strings() const;
  std::string dynamic_text(std::int64_t tag) const;
  std::vector<std::uint64_t> library_names() const;

  struct SymbolTable {
    std::uint64_t offset = 0, count = 0, strings = 0;
  };
  struct Segment {
    std::uint64_t address = 0, offset = 0, bytes = 0;
  };

  ByteBuffer file_;
  std::vector<Segment> segments_;
  std::uint64_t dynamic_offset_ = 0, dynamic_count_ = 0;
  SymbolTable dynamic_symbols_, all_symbols_;
};

}  // namespace orrery::internal
