#include <orrery/harness/flight/program_links.hpp>

#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <link.h>
#include <set>
#include <vector>

namespace orrery::internal {
namespace {

namespace fs = std::filesystem;

// The loader has put addresses into these entries, but where they cannot be written: in the
// kernel's vDSO they still are offsets.
const char* strings_of(const link_map& object) {
  for (const ElfW(Dyn)* entry = object.l_ld; entry->d_tag != DT_NULL; ++entry) {
    if (entry->d_tag != DT_STRTAB) continue;
    const ElfW(Addr) at = entry->d_un.d_ptr;
    return reinterpret_cast<const char*>(at < object.l_addr ? at + object.l_addr : at);
  }
  return nullptr;
}

std::vector<std::string> needed_by(const link_map& object) {
  std::vector<std::string> names;
  const char* strings = strings_of(object);
  for (const ElfW(Dyn)* entry = object.l_ld; strings != nullptr && entry->d_tag != DT_NULL;
       ++entry) {
    if (entry->d_tag == DT_NEEDED) names.emplace_back(strings + entry->d_un.d_val);
  }
  return names;
}

bool is_named(const link_map& object, const std::string& name) {
  const char* strings = strings_of(object);
  for (const ElfW(Dyn)* entry = object.l_ld; strings != nullptr && entry->d_tag != DT_NULL;
       ++entry) {
    if (entry->d_tag == DT_SONAME) return name == strings + entry->d_un.d_val;
  }
  return fs::path(object.l_name).filename() == name;
}

const link_map* program() {
  void* handle = dlopen(nullptr, RTLD_LAZY);
  link_map* map = nullptr;
  if (handle == nullptr || dlinfo(handle, RTLD_DI_LINKMAP, &map) != 0) return nullptr;
  while (map->l_prev != nullptr) map = map->l_prev;
  return map;
}

// The first of each name: those of the program were loaded before anything else.
const link_map* find(const link_map* first, const std::string& name) {
  for (const link_map* object = first; object != nullptr; object = object->l_next) {
    if (object->l_name != nullptr && *object->l_name != 0 && is_named(*object, name)) return object;
  }
  return nullptr;
}

// With the system's libraries among them: a few dozen entries, once per program.
std::set<std::string> files_of_program() {
  std::set<std::string> files;
  const link_map* first = program();
  if (first == nullptr) return files;
  std::vector<const link_map*> left = {first};
  while (!left.empty()) {
    const link_map* object = left.back();
    left.pop_back();
    for (const std::string& name : needed_by(*object)) {
      const link_map* needed = find(first, name);
      std::error_code error;
      if (needed != nullptr && files.insert(fs::canonical(needed->l_name, error).string()).second) {
        left.push_back(needed);
      }
    }
  }
  return files;
}

}  // namespace

bool program_links(const std::string& path) {
  static const std::set<std::string> files = files_of_program();
  std::error_code error;
  const fs::path file = fs::canonical(path, error);
  return !error && files.count(file.string()) != 0;
}

std::string program_path() {
  std::error_code error;
  const fs::path path = fs::read_symlink("/proc/self/exe", error);
  return error ? "this program" : path.string();
}

}  // namespace orrery::internal
