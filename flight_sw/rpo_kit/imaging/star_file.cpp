#include "rpo_kit/imaging/star_file.hpp"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "support/orbit/constants.hpp"

namespace rpo_kit {
namespace {

constexpr int kFewestStars = 4;

// @return false: not three numbers in range and nothing behind them.
bool star_of_line(const char* line, Star* star) {
  double x[3];
  for (double& value : x) {
    char* end = nullptr;
    value = std::strtod(line, &end);
    if (end == line) return false;
    line = end;
  }
  if (line[std::strspn(line, " \t\r\n")] != '\0') return false;
  if (!(x[0] >= 0.0 && x[0] <= 360.0) || !(std::fabs(x[1]) <= 90.0) || !(std::fabs(x[2]) <= 30.0)) {
    return false;
  }
  const double ra = x[0] * flight_support::kPi / 180.0, dec = x[1] * flight_support::kPi / 180.0;
  star->direction_ECI = flight_support::vec3(std::cos(dec) * std::cos(ra),
                                             std::cos(dec) * std::sin(ra), std::sin(dec));
  star->magnitude = x[2];
  return true;
}

}  // namespace

bool load_stars(const char* path, std::vector<Star>* stars, char* message,
                std::size_t message_bytes) {
  std::FILE* file = std::fopen(path, "r");
  if (file == nullptr) {
    std::snprintf(message, message_bytes, "star catalogue: no file '%.96s'", path);
    return false;
  }
  char line[128];
  int number = 0, count = 0;
  bool good = true;
  while (good && std::fgets(line, sizeof line, file) != nullptr) {
    ++number;
    const bool whole = std::strchr(line, '\n') != nullptr || std::feof(file) != 0;
    line[std::strcspn(line, "#")] = '\0';
    if (whole && line[std::strspn(line, " \t\r\n")] == '\0') continue;
    Star star;
    good = whole && star_of_line(line, &star);
    if (!good) break;
    ++count;
    if (stars != nullptr) stars->push_back(star);
  }
  std::fclose(file);
  if (!good) {
    std::snprintf(message, message_bytes, "star catalogue: line %d is no star", number);
  } else if (count < kFewestStars) {
    std::snprintf(message, message_bytes, "star catalogue: %d stars are too few", count);
    good = false;
  }
  return good;
}

}  // namespace rpo_kit
