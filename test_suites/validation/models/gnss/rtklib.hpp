/// Runs RTKLIB's command-line programs (Debian package rtklib) and reads the RINEX they write. An
/// outside reader of the NovAtel stream: what it makes of the bytes is what any user's tool would.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace orrery::rtklib {

inline bool has_program(const std::string& name) {
  return std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0;
}

/// Skips the test, with the reason, where a program is absent.
#define ORRERY_NEED_RTKLIB(name)                                                               \
  if (!orrery::rtklib::has_program(name)) {                                                    \
    GTEST_SKIP() << "no program " << (name) << ": install the package rtklib (ci/setup test)"; \
  }

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Runs a command in `folder`; its chatter goes to log.txt there and is shown if it fails.
inline void run(const std::filesystem::path& folder, const std::string& command) {
  const std::string in_folder =
      "cd '" + folder.string() + "' && " + command + " >log.txt 2>&1 </dev/null";
  EXPECT_EQ(std::system(in_folder.c_str()), 0) << command << "\n" << read_text(folder / "log.txt");
}

/// One observation of a RINEX 3 file: the value, and the loss-of-lock indicator's digit or 0.
struct RinexValue {
  double value = 0;
  int loss_of_lock = 0;
};

using RinexSatellite = std::map<std::string, RinexValue>;  // by type, "C1C"

struct RinexEpoch {
  std::string time;  // "2025 03 20 00 00 10.0000000"
  std::map<std::string, RinexSatellite> satellites;
};

/// GPS observations of a RINEX 3 file with at most 13 types.
inline std::vector<RinexEpoch> read_rinex_observations(const std::filesystem::path& path) {
  std::vector<std::string> types;
  std::vector<RinexEpoch> epochs;
  std::istringstream file(read_text(path));
  bool header = true;
  for (std::string line; std::getline(file, line);) {
    if (header) {
      if (line.find("SYS / # / OBS TYPES") != line.npos && line[0] == 'G') {
        std::istringstream words(line.substr(1, 59));
        int count = 0;
        words >> count;
        types.resize(static_cast<std::size_t>(count));
        for (std::string& type : types) words >> type;
      }
      header = line.find("END OF HEADER") == line.npos;
    } else if (line[0] == '>') {
      epochs.push_back({line.substr(2, 27), {}});
    } else if (line[0] == 'G') {
      RinexSatellite& satellite = epochs.back().satellites[line.substr(0, 3)];
      for (std::size_t k = 0; k < types.size() && 3 + 16 * k + 14 <= line.size(); ++k) {
        const std::string value = line.substr(3 + 16 * k, 14);
        if (value.find_first_not_of(' ') == value.npos) continue;
        const std::size_t flag = 3 + 16 * k + 14;
        const bool flagged = flag < line.size() && line[flag] != ' ';
        satellite[types[k]] = {std::stod(value), flagged ? line[flag] - '0' : 0};
      }
    }
  }
  return epochs;
}

/// The 31 numbers of each GPS record of a RINEX 3 navigation file, in its order; by satellite.
inline std::map<std::string, std::vector<double>> read_rinex_navigation(const std::string& text) {
  std::map<std::string, std::vector<double>> records;
  std::istringstream file(text.substr(text.find("END OF HEADER")));
  std::string line, satellite;
  std::getline(file, line);
  while (std::getline(file, line)) {
    if (line[0] != ' ') satellite = line.substr(0, 3);
    const std::size_t first = line[0] != ' ' ? 23 : 4;
    for (std::size_t at = first; at + 19 <= line.size(); at += 19) {
      std::string number = line.substr(at, 19);
      if (number.find_first_not_of(' ') == number.npos) continue;
      if (const std::size_t d = number.find('D'); d != number.npos) number[d] = 'E';
      records[satellite].push_back(std::stod(number));
    }
  }
  return records;
}

}  // namespace orrery::rtklib
