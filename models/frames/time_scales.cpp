#include <orrery/models/frames/time_scales.hpp>

#include <erfa.h>

#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr double kGpsEpoch_JD = 2444244.5;  // 1980-01-06
constexpr std::int64_t kDay_ns = 86'400'000'000'000;
constexpr Duration kTaiMinusGps = 19s;

JulianDate to_julian_date(std::int64_t ns_since_gps_epoch) {
  std::int64_t day = ns_since_gps_epoch / kDay_ns;
  std::int64_t rest = ns_since_gps_epoch % kDay_ns;
  if (rest < 0) {
    --day;
    rest += kDay_ns;
  }
  return {kGpsEpoch_JD + static_cast<double>(day),
          static_cast<double>(rest) / static_cast<double>(kDay_ns)};
}

// TAI - UTC on the UTC day that contains this UTC instant.
int leap_seconds_on(const JulianDate& utc) {
  int year = 0, month = 0, day = 0;
  double fraction = 0, delta_s = 0;
  eraJd2cal(utc.day, utc.fraction, &year, &month, &day, &fraction);
  if (year < 1980 || year > 2200) {
    throw std::invalid_argument("leap_seconds: year " + std::to_string(year) +
                                "; accepted: 1980 to 2200");
  }
  // Status 1 says that the date is far beyond ERFA's release, where leap seconds may be missing:
  // the simulated UTC then simply has none.
  eraDat(year, month, day, fraction, &delta_s);
  return static_cast<int>(delta_s);
}

}  // namespace

JulianDate gps_to_tt(SimTime t) {
  return to_julian_date(to_ns(t + 51s + 184ms));
}

double gps_to_tt_centuries(SimTime t) {
  const JulianDate tt = gps_to_tt(t);
  return ((tt.day - 2451545.0) + tt.fraction) / 36525.0;
}

int leap_seconds(SimTime t) {
  // The TAI date has the new value at most a minute too early; taken off, it leads to the UTC date.
  const std::int64_t tai_ns = to_ns(t + kTaiMinusGps);
  const int guess = leap_seconds_on(to_julian_date(tai_ns));
  return leap_seconds_on(to_julian_date(tai_ns - to_ns(guess * 1s)));
}

JulianDate gps_to_utc(SimTime t) {
  return to_julian_date(to_ns(t + kTaiMinusGps - leap_seconds(t) * 1s));
}

}  // namespace orrery
