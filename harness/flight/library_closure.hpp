/// The libraries that belong to one flight library, and their private copies.
#pragma once

#include <orrery/harness/flight/elf_image.hpp>

#include <string>
#include <vector>

namespace orrery::internal {

/// One shared library of the team's own.
struct LibraryPart {
  std::string name;  // as others need it: its SONAME; of the flight library itself its file
  std::string path;
  ElfImage image;
  LifeFunctions life = {};
};

/// A flight library and, before it, what it links of the team's own, dependencies first.
struct LibraryClosure {
  std::vector<LibraryPart> parts;   // the last is the flight library
  std::vector<std::string> shared;  // not copied: libraries of the system beyond the usual ones,
                                    // and those whose name cannot be changed in place
};

/// Reads them. Looks where the loader would: DT_RUNPATH, LD_LIBRARY_PATH; what lies only in the
/// system's own folders belongs to the system.
/// @throws std::invalid_argument  a file cannot be read or is no shared library.
LibraryClosure read_closure(const std::string& path);

/// Makes the loader take these for other libraries than those on disk: "lib" at the beginning of
/// their names becomes `code`, wherever one of them names another. 3 characters.
void rename_parts(LibraryClosure& closure, const std::string& code);

ByteBuffer read_file(const std::string& path);

}  // namespace orrery::internal
