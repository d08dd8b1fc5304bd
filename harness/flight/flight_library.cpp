#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/floating_point.hpp>
#include <orrery/harness/kernel/hash.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <link.h>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <sys/stat.h>
#include <unistd.h>

namespace orrery {
namespace {

namespace fs = std::filesystem;

std::map<std::string, std::string>& known_targets() {
  static std::map<std::string, std::string> targets;
  return targets;
}

// Files of copies that are loaded in this program: the loader goes by the file, so no two instances
// may share one.
struct CopiesInUse {
  std::mutex mutex;
  std::set<std::string> paths;
};
CopiesInUse& copies_in_use() {
  static CopiesInUse copies;
  return copies;
}

[[noreturn]] void refuse(const std::string& name, const std::string& path,
                         const std::string& reason) {
  throw std::invalid_argument("flight library \"" + name + "\" (" + path + "): " + reason);
}

std::vector<std::string> flight_path_folders() {
  std::vector<std::string> folders;
  const char* variable = std::getenv("ORRERY_FLIGHT_PATH");
  std::string_view rest = variable == nullptr ? "" : variable;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    if (end > 0) folders.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return folders;
}

template <class Strings>
std::string joined(const Strings& strings) {
  std::string result;
  for (const std::string& s : strings) result += (result.empty() ? "" : ", ") + s;
  return result.empty() ? "none" : result;
}

// "vendor::gnc" is a target; its file is called libgnc.so.
std::string file_stem(const std::string& name) {
  const std::size_t colons = name.rfind("::");
  return colons == std::string::npos ? name : name.substr(colons + 2);
}

[[noreturn]] void report_missing(const std::string& name, const std::vector<std::string>& folders) {
  std::vector<std::string> known;
  for (const auto& [target, path] : known_targets()) known.push_back(target);
  throw std::invalid_argument("flight library \"" + name + "\" was not found: no lib" +
                              file_stem(name) + ".so or " + file_stem(name) +
                              ".so in the folders of ORRERY_FLIGHT_PATH (" + joined(folders) +
                              "), and this test program knows: " + joined(known) +
                              "; name it after FLIGHT in orrery_add_test");
}

ByteBuffer read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw std::invalid_argument("cannot be read");
  ByteBuffer bytes(static_cast<std::size_t>(file.tellg()));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file) throw std::invalid_argument("cannot be read");
  return bytes;
}

bool holds(const fs::path& path, const ByteBuffer& bytes) {
  std::error_code error;
  if (fs::file_size(path, error) != bytes.size() || error) return false;
  return read_file(path) == bytes;
}

// Files are compared in full before they are used again, so 64 bits are plenty.
std::string content_key(const ByteBuffer& bytes) {
  return hex_digits(hash_bytes(0, bytes), 16);
}

// A folder of our own. In the common folder for temporary files somebody else might have made it.
fs::path cache_folder() {
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  const bool has_xdg = xdg != nullptr && *xdg == '/';
  const fs::path folder = has_xdg
                              ? fs::path(xdg) / "orrery"
                              : fs::temp_directory_path() / ("orrery-" + std::to_string(geteuid()));
  fs::create_directories(folder.parent_path());
  mkdir(folder.c_str(), 0700);
  struct stat status {};
  if (lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
      status.st_uid != geteuid()) {
    throw std::invalid_argument("no private copy can be made: the folder " + folder.string() +
                                " cannot be made, or belongs to somebody else");
  }
  return folder / "flight";
}

// Temporary file and rename: another test program may be writing the same copy.
void write_atomically(const fs::path& path, const ByteBuffer& bytes) {
  fs::create_directories(path.parent_path());
  std::string temporary = path.string() + ".XXXXXX";
  const int file = mkstemp(temporary.data());
  const bool written =
      file >= 0 && write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
  if (file >= 0) {
    fchmod(file, 0755);
    close(file);
  }
  if (!written || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const std::string reason = std::strerror(errno);
    unlink(temporary.c_str());
    throw std::invalid_argument("no private copy can be made: " + path.string() + ": " + reason);
  }
}

bool is_loaded(const std::string& path) {
  void* handle = dlopen(path.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  if (handle == nullptr) return false;
  dlclose(handle);
  return true;
}

// dsc.gnc.so, or dsc.gnc.2.so if another instance of that name is alive, or could not be unloaded.
std::string reserve_path(const fs::path& folder, const FlightProcessOptions& options) {
  CopiesInUse& copies = copies_in_use();
  const std::lock_guard lock(copies.mutex);
  const std::string stem = options.spacecraft + "." + options.process;
  for (int n = 1;; ++n) {
    const std::string number = n == 1 ? "" : "." + std::to_string(n);
    const std::string path = (folder / (stem + number + ".so")).string();
    if (copies.paths.count(path) != 0 || is_loaded(path)) continue;
    copies.paths.insert(path);
    return path;
  }
}

void give_back_path(const std::string& path) {
  CopiesInUse& copies = copies_in_use();
  const std::lock_guard lock(copies.mutex);
  copies.paths.erase(path);
}

std::string demangled(const std::string& symbol) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> text(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), std::free);
  return status == 0 ? text.get() : symbol;
}

// Libraries whose state the whole program shares anyway.
bool belongs_to_the_system(const std::string& library) {
  static constexpr std::array<std::string_view, 12> kSystem = {
      "libc.so",  "libm.so",  "libstdc++.so", "libgcc_s.so", "ld-linux",   "libpthread.so",
      "libdl.so", "librt.so", "libasan.so",   "libubsan.so", "libtsan.so", "libc++"};
  return std::any_of(kSystem.begin(), kSystem.end(),
                     [&](std::string_view s) { return library.compare(0, s.size(), s) == 0; });
}

}  // namespace

void register_flight_target(const char* name, const char* path) {
  known_targets()[name] = path;
}

std::string find_flight_library(const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos) {
    throw std::invalid_argument("flight library \"" + name +
                                "\": a library is named by its CMake target, not by a path");
  }
  const std::vector<std::string> folders = flight_path_folders();
  for (const std::string& folder : folders) {
    for (const char* prefix : {"lib", ""}) {
      const fs::path path = fs::path(folder) / (prefix + file_stem(name) + ".so");
      std::error_code error;
      if (fs::is_regular_file(path, error)) return path.string();
    }
  }
  const auto target = known_targets().find(name);
  if (target == known_targets().end()) report_missing(name, folders);
  return target->second;
}

FlightLibrary::FlightLibrary(const FlightProcessOptions& options)
    : name_(options.library),
      path_(find_flight_library(options.library)),
      loaded_path_(path_),
      is_copy_(options.isolation == Isolation::kCopy) {
  try {
    if (is_copy_) make_copy(options);
    load();
  } catch (const std::exception& error) {
    if (is_copy_) give_back_path(loaded_path_);
    refuse(name_, path_, error.what());
  }
}

FlightLibrary::~FlightLibrary() {
  if (keep_loaded_) return;  // its path stays reserved
  const internal::FloatingPointControl control = internal::FloatingPointControl::read();
  dlclose(handle_);
  control.restore();
  if (is_copy_) give_back_path(loaded_path_);
}

void FlightLibrary::make_copy(const FlightProcessOptions& options) {
  internal::ElfImage image(read_file(path_));
  for (const std::string& symbol : image.make_unique_symbols_weak()) {
    edited_symbols_.push_back(demangled(symbol));
  }
  for (const std::string& library : image.needed()) {
    if (!belongs_to_the_system(library)) shared_dependencies_.push_back(library);
  }
  life_ = image.detach_life_functions();
  loaded_path_ = reserve_path(cache_folder() / content_key(image.bytes()), options);
  if (!holds(loaded_path_, image.bytes())) write_atomically(loaded_path_, image.bytes());
}

void FlightLibrary::load() {
  // Start-up code that -ffast-math links in sets the control registers of this thread.
  const internal::FloatingPointControl control = internal::FloatingPointControl::read();
  handle_ = dlopen(loaded_path_.c_str(), RTLD_NOW | RTLD_LOCAL);
  control.restore();
  if (handle_ == nullptr) throw std::invalid_argument(dlerror());
  link_map* map = nullptr;
  dlinfo(handle_, RTLD_DI_LINKMAP, &map);
  base_ = map->l_addr;
}

void* FlightLibrary::symbol(const char* name) const {
  return dlsym(handle_, name);
}

void FlightLibrary::run_constructors() const {
  using Constructor = void (*)(int, char**, char**);
  static char* no_arguments[] = {nullptr};
  if (life_.init != 0) reinterpret_cast<Constructor>(base_ + life_.init)(0, no_arguments, environ);
  const auto* functions = reinterpret_cast<const Constructor*>(base_ + life_.init_array);
  for (std::size_t i = 0; i < life_.init_array_bytes / sizeof(Constructor); ++i) {
    functions[i](0, no_arguments, environ);
  }
}

void FlightLibrary::run_destructors() const {
  using Destructor = void (*)();
  const auto* functions = reinterpret_cast<const Destructor*>(base_ + life_.fini_array);
  for (std::size_t i = life_.fini_array_bytes / sizeof(Destructor); i-- > 0;) functions[i]();
  if (life_.fini != 0) reinterpret_cast<Destructor>(base_ + life_.fini)();
}

}  // namespace orrery
