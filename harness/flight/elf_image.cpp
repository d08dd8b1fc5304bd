#include <orrery/harness/flight/elf_image.hpp>

#include <cstring>
#include <elf.h>
#include <stdexcept>
#include <utility>

namespace orrery::internal {
namespace {

// In the range of the operating system's own tags, where glibc 2.36 and binutils know none: loaders
// skip them.
constexpr std::int64_t kDetached = 0x6000'0100;

}  // namespace

template <class T>
T ElfImage::read(std::uint64_t offset) const {
  if (offset > file_.size() || file_.size() - offset < sizeof(T)) {
    throw std::invalid_argument("the file is cut short: " + std::to_string(file_.size()) +
                                " bytes, and something lies at " + std::to_string(offset));
  }
  T value;
  std::memcpy(&value, file_.data() + offset, sizeof value);
  return value;
}

template <class T>
void ElfImage::write(std::uint64_t offset, const T& value) {
  (void)read<T>(offset);
  std::memcpy(file_.data() + offset, &value, sizeof value);
}

std::string ElfImage::text(std::uint64_t offset) const {
  std::string result;
  for (char c = read<char>(offset); c != 0; c = read<char>(++offset)) result += c;
  return result;
}

ElfImage::ElfImage(ByteBuffer file) : file_(std::move(file)) {
  if (file_.size() < sizeof(Elf64_Ehdr) || std::memcmp(file_.data(), ELFMAG, SELFMAG) != 0) {
    throw std::invalid_argument("not an ELF file");
  }
  const Elf64_Ehdr header = read<Elf64_Ehdr>(0);
  if (header.e_ident[EI_CLASS] != ELFCLASS64 || header.e_ident[EI_DATA] != ELFDATA2LSB) {
    throw std::invalid_argument("not a 64-bit little-endian ELF file");
  }
  if (header.e_type != ET_DYN) throw std::invalid_argument("not a shared library");
  find_dynamic();
  find_symbols();
}

void ElfImage::find_dynamic() {
  const Elf64_Ehdr header = read<Elf64_Ehdr>(0);
  for (unsigned i = 0; i < header.e_phnum; ++i) {
    const auto segment = read<Elf64_Phdr>(header.e_phoff + i * sizeof(Elf64_Phdr));
    if (segment.p_type == PT_LOAD) {
      segments_.push_back({segment.p_vaddr, segment.p_offset, segment.p_filesz});
    }
    if (segment.p_type == PT_DYNAMIC) {
      dynamic_offset_ = segment.p_offset;
      dynamic_count_ = segment.p_filesz / sizeof(Elf64_Dyn);
    }
  }
  if (dynamic_count_ == 0) throw std::invalid_argument("not a shared library");
}

void ElfImage::find_symbols() {
  const Elf64_Ehdr header = read<Elf64_Ehdr>(0);
  for (unsigned i = 0; i < header.e_shnum; ++i) {
    const auto section = read<Elf64_Shdr>(header.e_shoff + i * sizeof(Elf64_Shdr));
    if (section.sh_type != SHT_DYNSYM && section.sh_type != SHT_SYMTAB) continue;
    const auto strings = read<Elf64_Shdr>(header.e_shoff + section.sh_link * sizeof(Elf64_Shdr));
    (section.sh_type == SHT_DYNSYM ? dynamic_symbols_ : all_symbols_) = {
        section.sh_offset, section.sh_size / sizeof(Elf64_Sym), strings.sh_offset};
  }
}

std::uint64_t ElfImage::file_offset(std::uint64_t address) const {
  for (const Segment& s : segments_) {
    if (address >= s.address && address - s.address < s.bytes) {
      return s.offset + (address - s.address);
    }
  }
  throw std::invalid_argument("its dynamic section points outside the file");
}

std::uint64_t ElfImage::dynamic_strings() const {
  for (std::uint64_t i = 0; i < dynamic_count_; ++i) {
    const auto entry = read<Elf64_Dyn>(dynamic_offset_ + i * sizeof(Elf64_Dyn));
    if (entry.d_tag == DT_NULL) break;
    if (entry.d_tag == DT_STRTAB) return file_offset(entry.d_un.d_ptr);
  }
  throw std::invalid_argument("its dynamic section has no table of names");
}

std::vector<std::string> ElfImage::needed() const {
  std::vector<std::string> result;
  for (std::uint64_t i = 0; i < dynamic_count_; ++i) {
    const auto entry = read<Elf64_Dyn>(dynamic_offset_ + i * sizeof(Elf64_Dyn));
    if (entry.d_tag == DT_NULL) break;
    if (entry.d_tag == DT_NEEDED) result.push_back(text(dynamic_strings() + entry.d_un.d_val));
  }
  return result;
}

std::string ElfImage::dynamic_text(std::int64_t tag) const {
  for (std::uint64_t i = 0; i < dynamic_count_; ++i) {
    const auto entry = read<Elf64_Dyn>(dynamic_offset_ + i * sizeof(Elf64_Dyn));
    if (entry.d_tag == DT_NULL) break;
    if (entry.d_tag == tag) return text(dynamic_strings() + entry.d_un.d_val);
  }
  return "";
}

std::string ElfImage::soname() const {
  return dynamic_text(DT_SONAME);
}

std::string ElfImage::run_path() const {
  const std::string path = dynamic_text(DT_RUNPATH);
  return path.empty() ? dynamic_text(DT_RPATH) : path;
}

// Places in the file: of DT_NEEDED and DT_SONAME, and of the libraries whose symbol versions it
// needs.
std::vector<std::uint64_t> ElfImage::library_names() const {
  std::vector<std::uint64_t> places;
  const std::uint64_t strings = dynamic_strings();
  for (std::uint64_t i = 0; i < dynamic_count_; ++i) {
    const auto entry = read<Elf64_Dyn>(dynamic_offset_ + i * sizeof(Elf64_Dyn));
    if (entry.d_tag == DT_NULL) break;
    if (entry.d_tag == DT_NEEDED || entry.d_tag == DT_SONAME) {
      places.push_back(strings + entry.d_un.d_val);
    }
    if (entry.d_tag != DT_VERNEED) continue;
    for (std::uint64_t place = file_offset(entry.d_un.d_ptr);;) {
      const auto version = read<Elf64_Verneed>(place);
      places.push_back(strings + version.vn_file);
      if (version.vn_next == 0) break;
      place += version.vn_next;
    }
  }
  return places;
}

void ElfImage::rename_libraries(const std::map<std::string, std::string>& names) {
  for (const std::uint64_t place : library_names()) {
    const auto change = names.find(text(place));  // not again where two places share a string
    if (change == names.end()) continue;
    if (change->second.size() != change->first.size()) {
      throw std::invalid_argument("a library's name cannot change its length: " + change->second);
    }
    for (std::size_t i = 0; i < change->second.size(); ++i) write(place + i, change->second[i]);
  }
}

std::vector<std::string> ElfImage::make_unique_symbols_weak() {
  if (dynamic_symbols_.count == 0) {
    throw std::invalid_argument(
        "it has no table of sections, so no private copy can be made; link it without stripping "
        "that, or load it with Isolation::kShared");
  }
  std::vector<std::string> names;
  for (std::uint64_t i = 0; i < dynamic_symbols_.count; ++i) {
    const std::uint64_t offset = dynamic_symbols_.offset + i * sizeof(Elf64_Sym);
    auto symbol = read<Elf64_Sym>(offset);
    if (ELF64_ST_BIND(symbol.st_info) != STB_GNU_UNIQUE) continue;
    symbol.st_info =
        static_cast<unsigned char>(ELF64_ST_INFO(STB_WEAK, ELF64_ST_TYPE(symbol.st_info)));
    write(offset, symbol);
    names.push_back(text(dynamic_symbols_.strings + symbol.st_name));
  }
  return names;
}

LifeFunctions ElfImage::detach_life_functions() {
  LifeFunctions found;
  for (std::uint64_t i = 0; i < dynamic_count_; ++i) {
    const std::uint64_t offset = dynamic_offset_ + i * sizeof(Elf64_Dyn);
    auto entry = read<Elf64_Dyn>(offset);
    std::uint64_t* target = nullptr;
    switch (entry.d_tag) {
      case DT_NULL:
        return found;
      case DT_INIT:
        target = &found.init;
        break;
      case DT_INIT_ARRAY:
        target = &found.init_array;
        break;
      case DT_INIT_ARRAYSZ:
        target = &found.init_array_bytes;
        break;
      case DT_FINI:
        target = &found.fini;
        break;
      case DT_FINI_ARRAY:
        target = &found.fini_array;
        break;
      case DT_FINI_ARRAYSZ:
        target = &found.fini_array_bytes;
        break;
      default:
        continue;
    }
    *target = entry.d_un.d_val;
    entry.d_tag += kDetached;
    write(offset, entry);
  }
  return found;
}

std::string ElfImage::symbol_at(std::uint64_t address, unsigned char type) const {
  const SymbolTable& table = all_symbols_.count != 0 ? all_symbols_ : dynamic_symbols_;
  for (std::uint64_t i = 0; i < table.count; ++i) {
    const auto symbol = read<Elf64_Sym>(table.offset + i * sizeof(Elf64_Sym));
    if (ELF64_ST_TYPE(symbol.st_info) != type || symbol.st_shndx == SHN_UNDEF) continue;
    if (address >= symbol.st_value && address - symbol.st_value < symbol.st_size) {
      return text(table.strings + symbol.st_name);
    }
  }
  return "";
}

std::string ElfImage::function_at(std::uint64_t address) const {
  return symbol_at(address, STT_FUNC);
}

std::string ElfImage::variable_at(std::uint64_t address) const {
  return symbol_at(address, STT_OBJECT);
}

std::vector<ElfImage::AddressRange> ElfImage::writable_data() const {
  const Elf64_Ehdr header = read<Elf64_Ehdr>(0);
  std::vector<AddressRange> data;
  AddressRange relro;
  for (unsigned i = 0; i < header.e_phnum; ++i) {
    const auto segment = read<Elf64_Phdr>(header.e_phoff + i * sizeof(Elf64_Phdr));
    const AddressRange range{segment.p_vaddr, segment.p_vaddr + segment.p_memsz};
    if (segment.p_type == PT_GNU_RELRO) relro = range;
    if (segment.p_type == PT_LOAD && (segment.p_flags & PF_W) != 0) data.push_back(range);
  }
  for (AddressRange& range : data) {  // linkers put it at the beginning
    if (relro.begin <= range.begin && relro.end > range.begin) {
      range.begin = relro.end < range.end ? relro.end : range.end;
    }
  }
  return data;
}

}  // namespace orrery::internal
