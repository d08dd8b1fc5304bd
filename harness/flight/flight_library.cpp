#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/floating_point.hpp>
#include <orrery/harness/flight/library_closure.hpp>
#include <orrery/harness/flight/program_links.hpp>
#include <orrery/harness/kernel/hash.hpp>
#include <orrery/harness/kernel/text.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cxxabi.h>
#include <dlfcn.h>
#include <filesystem>
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

bool holds(const fs::path& path, const ByteBuffer& bytes) {
  std::error_code error;
  if (fs::file_size(path, error) != bytes.size() || error) return false;
  return internal::read_file(path.string()) == bytes;
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

// "000" ... "zzz": what an instance's private libraries are called instead of "lib". The lowest
// free one, so that files of earlier runs fit.
struct CodesInUse {
  std::mutex mutex;
  std::set<std::string> codes;
};
CodesInUse& codes_in_use() {
  static CodesInUse codes;
  return codes;
}

std::string reserve_code() {
  static constexpr char kDigits[] =
      "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
  CodesInUse& in_use = codes_in_use();
  const std::lock_guard lock(in_use.mutex);
  for (std::size_t n = 0; n < 62 * 62 * 62; ++n) {
    const std::string code = {kDigits[n / 62 / 62], kDigits[n / 62 % 62], kDigits[n % 62]};
    if (code != "lib" && in_use.codes.insert(code).second) return code;
  }
  throw std::invalid_argument("too many instances with private libraries are loaded");
}

void give_back_code(const std::string& code) {
  CodesInUse& in_use = codes_in_use();
  const std::lock_guard lock(in_use.mutex);
  in_use.codes.erase(code);
}

std::string demangled(const std::string& symbol) {
  int status = 0;
  const std::unique_ptr<char, void (*)(void*)> text(
      abi::__cxa_demangle(symbol.c_str(), nullptr, nullptr, &status), std::free);
  return status == 0 ? text.get() : symbol;
}

// Copies that nobody has used for so long go; those that are loaded keep their files' content.
void prune_cache(const fs::path& folder) {
  static std::once_flag once;
  std::call_once(once, [&folder] {
    std::error_code error;
    const auto oldest = fs::file_time_type::clock::now() - days(30);
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
      if (entry.last_write_time(error) < oldest && !error) fs::remove_all(entry.path(), error);
    }
  });
}

}  // namespace

void register_flight_target(const char* name, const char* path) {
  known_targets()[name] = path;
}

namespace {
std::string& known_source_folder() {
  static std::string folder;
  return folder;
}
}  // namespace

void register_source_folder(const char* path) {
  known_source_folder() = path;
}

std::string source_folder() {
  return known_source_folder();
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
    if (is_copy_) {
      make_copy(options);
    } else {
      parts_.push_back({.path = path_});
    }
    for (Part& part : parts_) load(part);
  } catch (const std::exception& error) {
    unload();
    refuse(name_, path_, error.what());
  }
}

FlightLibrary::~FlightLibrary() {
  if (!keep_loaded_) unload();  // else its names stay reserved
}

void FlightLibrary::unload() {
  const internal::FloatingPointControl control = internal::FloatingPointControl::read();
  for (auto part = parts_.rbegin(); part != parts_.rend(); ++part) {
    if (part->handle != nullptr) dlclose(part->handle);
  }
  control.restore();
  if (is_copy_) give_back_path(loaded_path_);
  if (!code_.empty()) give_back_code(code_);
}

void FlightLibrary::make_copy(const FlightProcessOptions& options) {
  internal::LibraryClosure closure = internal::read_closure(path_);
  shared_dependencies_ = closure.shared;
  for (const internal::LibraryPart& part : closure.parts) {
    if (!internal::program_links(part.path)) continue;
    throw std::invalid_argument(
        "under Isolation::kCopy each process has a copy of its own, but the test program " +
        internal::program_path() + " itself links " + part.path +
        ", and what a program links is one for all copies; do not link it, or fly it with "
        "Isolation::kShared");
  }
  ByteBuffer all;
  for (internal::LibraryPart& part : closure.parts) {
    for (const std::string& symbol : part.image.make_unique_symbols_weak()) {
      edited_symbols_.push_back(demangled(symbol));
    }
    part.life = part.image.detach_life_functions();
    all.insert(all.end(), part.image.bytes().begin(), part.image.bytes().end());
  }
  const fs::path cache = cache_folder();
  const fs::path folder = cache / content_key(all);
  loaded_path_ = reserve_path(folder, options);
  if (closure.parts.size() > 1) {
    code_ = reserve_code();
    internal::rename_parts(closure, code_);
  }
  prune_cache(cache);
  for (const internal::LibraryPart& part : closure.parts) {
    const bool is_last = &part == &closure.parts.back();
    // dsc.gnc.so and, beside it, dsc.gnc.libecos.so
    std::string path = loaded_path_;
    if (!is_last) path.replace(path.size() - 2, 2, part.name);
    if (!holds(path, part.image.bytes())) write_atomically(path, part.image.bytes());
    parts_.push_back({.path = path, .life = part.life});
  }
  std::error_code error;  // for prune_cache: it is in use
  fs::last_write_time(folder, fs::file_time_type::clock::now(), error);
}

void FlightLibrary::load(Part& part) {
  // Start-up code that -ffast-math links in sets the control registers of this thread.
  const internal::FloatingPointControl control = internal::FloatingPointControl::read();
  part.handle = dlopen(part.path.c_str(), RTLD_NOW | RTLD_LOCAL);
  control.restore();
  if (part.handle == nullptr) throw std::invalid_argument(dlerror());
  link_map* map = nullptr;
  dlinfo(part.handle, RTLD_DI_LINKMAP, &map);
  part.base = map->l_addr;
}

void* FlightLibrary::symbol(const char* name) const {
  return dlsym(parts_.back().handle, name);
}

std::uintptr_t FlightLibrary::base() const {
  return parts_.back().base;
}

std::vector<std::string> FlightLibrary::loaded_paths() const {
  std::vector<std::string> paths;
  for (const Part& part : parts_) paths.push_back(part.path);
  return paths;
}

// Of what it links first, as the loader would.
void FlightLibrary::run_constructors() const {
  using Constructor = void (*)(int, char**, char**);
  static char* no_arguments[] = {nullptr};
  for (const Part& part : parts_) {
    const internal::LifeFunctions& life = part.life;
    if (life.init != 0) {
      reinterpret_cast<Constructor>(part.base + life.init)(0, no_arguments, environ);
    }
    const auto* functions = reinterpret_cast<const Constructor*>(part.base + life.init_array);
    for (std::size_t i = 0; i < life.init_array_bytes / sizeof(Constructor); ++i) {
      functions[i](0, no_arguments, environ);
    }
  }
}

void FlightLibrary::run_destructors() const {
  using Destructor = void (*)();
  for (auto part = parts_.rbegin(); part != parts_.rend(); ++part) {
    const internal::LifeFunctions& life = part->life;
    const auto* functions = reinterpret_cast<const Destructor*>(part->base + life.fini_array);
    for (std::size_t i = life.fini_array_bytes / sizeof(Destructor); i-- > 0;) functions[i]();
    if (life.fini != 0) reinterpret_cast<Destructor>(part->base + life.fini)();
  }
}

}  // namespace orrery
