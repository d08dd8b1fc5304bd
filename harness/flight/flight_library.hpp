/// Finds flight libraries by name and loads them, each instance with its own globals.
#pragma once

#include <orrery/harness/flight/elf_image.hpp>
#include <orrery/harness/flight/flight_options.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// Makes a library known by name. orrery_add_test writes the calls; they run before main.
void register_flight_target(const char* name, const char* path);

/// Where the sources of the test program lie: orrery_add_test writes the call. Empty: not known.
void register_source_folder(const char* path);
std::string source_folder();

/// The file of a library: lib<name>.so or <name>.so in the folders of ORRERY_FLIGHT_PATH, separated
/// by colons, else what register_flight_target knows.
/// @throws std::invalid_argument  not found; the message says where it looked and what is known.
std::string find_flight_library(const std::string& name);

/// A loaded library.
///
/// kCopy    A private file, so that the loader takes it for another library: symbols that are one
///          per program are made weak in it, and its static constructors and destructors are left
///          to run_constructors() and run_destructors(). Files lie in a cache by content
///          (XDG_CACHE_HOME, else the folder for temporary files), named after the process, and
///          stay there for 30 days after their last use: core dumps and debuggers need them. What
///          the library links of the team's own is copied with it, under other names ("lib" in
///          them becomes a code of the instance), so that each copy finds its own.
/// kShared  The file itself; the loader runs constructors and destructors.
class FlightLibrary {
 public:
  /// @throws std::invalid_argument  not found, not a library, or refused by the loader.
  explicit FlightLibrary(const FlightProcessOptions& options);
  /// Unloads, unless keep_loaded() was called.
  ~FlightLibrary();
  FlightLibrary(const FlightLibrary&) = delete;
  FlightLibrary& operator=(const FlightLibrary&) = delete;

  /// Null if there is none.
  void* symbol(const char* name) const;
  const std::string& path() const { return path_; }  // that was found
  const std::string& loaded_path() const { return loaded_path_; }
  std::vector<std::string> loaded_paths() const;  // of what was copied with it, too
  std::uintptr_t base() const;                    // where it is loaded
  /// Symbols that the copy had to change, demangled.
  const std::vector<std::string>& edited_symbols() const { return edited_symbols_; }
  /// Libraries that it links beyond the C and C++ run time and were not copied with it: the
  /// system's, and those without a SONAME that begins with "lib". One load of them serves all.
  const std::vector<std::string>& shared_dependencies() const { return shared_dependencies_; }

  /// Flight code: call these within the boundary. Nothing with kShared.
  void run_constructors() const;
  void run_destructors() const;

  /// For a process that crashed where the C library still knows of its destructors.
  void keep_loaded() { keep_loaded_ = true; }

 private:
  void make_copy(const FlightProcessOptions& options);
  struct Part {
    std::string path = {};
    internal::LifeFunctions life = {};
    void* handle = nullptr;
    std::uintptr_t base = 0;
  };
  static void load(Part& part);
  void unload();

  std::string name_, path_, loaded_path_;
  std::vector<std::string> edited_symbols_, shared_dependencies_;
  std::vector<Part> parts_;  // what it links first; itself last
  std::string code_;         // of its private libraries, if it has any
  bool is_copy_ = false;
  bool keep_loaded_ = false;
};

}  // namespace orrery
