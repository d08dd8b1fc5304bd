/// Reference data for validation: read where ORRERY_REFERENCE_DATA has it, never copied.
#pragma once

#include <array>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

namespace orrery {

/// The text of a file, unpacked if its name ends in .gz; none if the file is not there.
inline std::optional<std::string> reference_text(const std::string& path_below_the_folder) {
  const std::string path = std::string(ORRERY_REFERENCE_DATA) + "/" + path_below_the_folder;
  if (!std::filesystem::exists(path)) return {};
  const std::string command = (path.ends_with(".gz") ? "gzip -dc '" : "cat '") + path + "'";
  std::FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return {};
  std::string text;
  std::array<char, 65536> part;
  for (std::size_t n; (n = fread(part.data(), 1, part.size(), pipe)) > 0;)
    text.append(part.data(), n);
  return pclose(pipe) == 0 ? std::optional(text) : std::nullopt;
}

}  // namespace orrery
