#include <orrery/models/atmosphere/nrlmsise00_atmosphere.hpp>
#include <orrery/models/atmosphere/nrlmsise00_tables.hpp>
#include <orrery/models/frames/geodetic.hpp>

#include <algorithm>
#include <chrono>
#include <utility>

namespace orrery {
namespace {

constexpr double k1970_JD = 2440587.5;

// The model turns degrees and hours into angles by rounded rates, 1.74533e-2 and 0.2618: 24 h are a
// turn and 1.5e-5 rad, so that density jumps by 1e-5 where local time or longitude begins anew.
// These give it the angles that are meant, in units of its own.
constexpr double kDegreesPerRadian = 1 / nrlmsise00::kDegree_rad;
constexpr double kHoursPerHour = 3.141592653589793 / 12 / nrlmsise00::kHour_rad;

int day_of_year(const JulianDate& utc) {
  const std::chrono::sys_days day{std::chrono::days(static_cast<int>(utc.day - k1970_JD))};
  const std::chrono::year year = std::chrono::year_month_day(day).year();
  return static_cast<int>((day - std::chrono::sys_days(year / 1 / 1)).count()) + 1;
}

double local_solar_time_h(double utc_s, double longitude_rad) {
  const double hours = utc_s / 3600 + longitude_rad * (12 / 3.141592653589793);
  return kHoursPerHour * (hours < 0 ? hours + 24 : hours >= 24 ? hours - 24 : hours);
}

}  // namespace

Nrlmsise00Atmosphere::Nrlmsise00Atmosphere(Nrlmsise00AtmosphereOptions options)
    : options_(std::move(options)) {}

Nrlmsise00Input Nrlmsise00Atmosphere::arguments(SimTime t, const Vec3& r_ECEF) const {
  const JulianDate utc = gps_to_utc(t);
  const Geodetic place = to_geodetic(r_ECEF);
  SpaceWeatherIndices weather = options_.weather.at(utc);
  if (!options_.three_hourly_ap) weather.ap_history.reset();

  const double utc_s = 86400 * utc.fraction;
  // The last bit of a conversion must not carry a pole out of range.
  const double latitude_deg = std::clamp(kDegreesPerRadian * place.latitude_rad, -90.0, 90.0);
  const double longitude_deg = std::clamp(kDegreesPerRadian * place.longitude_rad, -180.0, 180.0);
  return {.day_of_year = day_of_year(utc),
          .ut_s = utc_s,
          .altitude_km = 1e-3 * place.height_m,
          .latitude_deg = latitude_deg,
          .longitude_deg = longitude_deg,
          .local_solar_time_h = local_solar_time_h(utc_s, place.longitude_rad),
          .f107a_sfu = weather.f107a_sfu,
          .f107_sfu = weather.f107_sfu,
          .ap_daily = weather.ap_daily,
          .ap_history = weather.ap_history};
}

std::optional<SimTime> Nrlmsise00Atmosphere::next_discontinuity(SimTime t) const {
  const SimTime midnight = next_utc_multiple(t, 24h);
  const std::optional<SimTime> change = options_.weather.next_change(t);
  return change && *change < midnight ? change : midnight;
}

}  // namespace orrery
