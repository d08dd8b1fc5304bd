#include <orrery/harness/flight/library_closure.hpp>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace orrery::internal {
namespace {

namespace fs = std::filesystem;

// Libraries whose state the whole program shares anyway.
bool belongs_to_the_system(const std::string& library) {
  static constexpr std::array<std::string_view, 12> kSystem = {
      "libc.so",  "libm.so",  "libstdc++.so", "libgcc_s.so", "ld-linux",   "libpthread.so",
      "libdl.so", "librt.so", "libasan.so",   "libubsan.so", "libtsan.so", "libc++"};
  return std::any_of(kSystem.begin(), kSystem.end(),
                     [&](std::string_view s) { return library.compare(0, s.size(), s) == 0; });
}

std::vector<std::string> folders_of(std::string_view list, const std::string& origin) {
  std::vector<std::string> folders;
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(':'), list.size());
    std::string folder(list.substr(0, end));
    for (const std::string_view word : {"$ORIGIN", "${ORIGIN}"}) {
      const std::size_t at = folder.find(word);
      if (at != std::string::npos) folder.replace(at, word.size(), origin);
    }
    if (!folder.empty()) folders.push_back(folder);
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return folders;
}

std::optional<std::string> find_needed(const std::string& name, const LibraryPart& by) {
  const std::string origin = fs::path(by.path).parent_path().string();
  const char* variable = std::getenv("LD_LIBRARY_PATH");
  for (const std::string& list : {by.image.run_path(), std::string(variable ? variable : "")}) {
    for (const std::string& folder : folders_of(list, origin)) {
      std::error_code error;
      const fs::path path = fs::path(folder) / name;
      if (fs::is_regular_file(path, error)) return path.string();
    }
  }
  return std::nullopt;
}

class Reader {
 public:
  LibraryClosure closure;

  void add(const std::string& name, const std::string& path) {
    LibraryPart part{name, path, ElfImage(read_file(path))};
    for (const std::string& needed : part.image.needed()) {
      if (belongs_to_the_system(needed) || !seen_.insert(needed).second) continue;
      const std::optional<std::string> file = find_needed(needed, part);
      if (file && needed.compare(0, 3, "lib") == 0 && soname_of(*file) == needed) {
        add(needed, *file);
      } else {
        closure.shared.push_back(needed);
      }
    }
    closure.parts.push_back(std::move(part));  // after what it needs
  }

 private:
  static std::string soname_of(const std::string& path) {
    return ElfImage(read_file(path)).soname();
  }
  std::set<std::string> seen_;
};

}  // namespace

ByteBuffer read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::invalid_argument("cannot be read: " + path);
  ByteBuffer bytes(static_cast<std::size_t>(file.tellg()));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) throw std::invalid_argument("cannot be read: " + path);
  return bytes;
}

LibraryClosure read_closure(const std::string& path) {
  Reader reader;
  reader.add(fs::path(path).filename().string(), path);
  return std::move(reader.closure);
}

void rename_parts(LibraryClosure& closure, const std::string& code) {
  std::map<std::string, std::string> names;
  for (std::size_t i = 0; i + 1 < closure.parts.size(); ++i) {
    const std::string& name = closure.parts[i].name;
    names[name] = code + name.substr(3);
  }
  for (LibraryPart& part : closure.parts) part.image.rename_libraries(names);
}

}  // namespace orrery::internal
