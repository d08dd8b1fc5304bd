// Property: whatever the bytes, the readers of space weather return a table that answers for every
// day it covers, or throw std::invalid_argument. Anything else ends the program.
#include <orrery/models/atmosphere/space_weather.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>

namespace orrery {
namespace {

JulianDate midnight(const std::string& date) {
  // "2020-02-29": days since 1970-01-01 by way of GPS time, which knows no leap seconds.
  const SimTime t = gps_midnight(std::stoi(date.substr(0, 4)), std::stoi(date.substr(5, 2)),
                                 std::stoi(date.substr(8, 2)));
  return {2444244.5 + static_cast<double>(to_ns(t) / to_ns(24h)), 0};
}

void ask_for_every_day(const SpaceWeather& weather) {
  const std::string covered = weather.covered();                // "<first> to <last> UTC"
  if (covered < "1980" || covered.substr(14) > "2200") return;  // beyond the calendar of SimTime
  const JulianDate last = midnight(covered.substr(14, 10));
  for (JulianDate utc = midnight(covered.substr(0, 10)); utc.day <= last.day; ++utc.day) {
    for (utc.fraction = 0; utc.fraction < 1; utc.fraction += 0.125) {
      const SpaceWeatherIndices now = weather.at(utc);
      const bool plausible = now.f107_sfu > 0 && now.f107a_sfu > 0 && now.ap_daily >= 0;
      if (!plausible) std::abort();
    }
    utc.fraction = 0;
  }
}

void read(SpaceWeather (*parse)(std::string_view, std::string_view), std::string_view text) {
  try {
    ask_for_every_day(parse(text, "fuzz"));
  } catch (const std::invalid_argument&) {
    // What a damaged file is answered with.
  }
}

}  // namespace
}  // namespace orrery

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  orrery::read(orrery::SpaceWeather::parse_celestrak, text);
  orrery::read(orrery::SpaceWeather::parse_monthly, text);
  return 0;
}
