/// Simulated time: integer nanoseconds of GPS time on a clock that cannot be asked for the time.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <chrono>
#include <cstdint>
#include <string>

namespace orrery {

using namespace std::chrono_literals;  // 20min, 500ms

/// Integral: 90, 0.5s and 1.5h do not convert to it.
using Duration = std::chrono::nanoseconds;

/// GPS time, epoch 1980-01-06 00:00:00 UTC. It has no now(): nothing in a run can read the wall
/// clock through it.
struct GpsClock {
  using duration = Duration;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<GpsClock, Duration>;
  static constexpr bool is_steady = true;
};

/// An instant of truth [ns since the GPS epoch]. Range about +-292 years.
using SimTime = std::chrono::time_point<GpsClock, Duration>;

/// `10d` is a calendar day of <chrono>; these are spans.
constexpr Duration days(std::int64_t n) {
  return n * 24h;
}
constexpr Duration weeks(std::int64_t n) {
  return n * 168h;
}

constexpr std::int64_t to_ns(Duration d) {
  return d.count();
}
constexpr std::int64_t to_ns(SimTime t) {
  return t.time_since_epoch().count();
}
constexpr SimTime from_ns(std::int64_t ns_since_gps_epoch) {
  return SimTime(Duration(ns_since_gps_epoch));
}
/// For use inside a step or a report; never for ordering.
constexpr double to_seconds(Duration d) {
  return 1e-9 * static_cast<double>(d.count());
}
/// Nearest nanosecond. @throws std::invalid_argument  not finite, or outside +-9.2e9 s.
Duration from_seconds(double seconds);

/// Midnight of a civil date, read as GPS time (no leap seconds). Proleptic Gregorian.
/// @throws std::invalid_argument  not a date, or outside 1980-2200.
SimTime gps_midnight(int year, int month, int day);

/// "2025-03-20T00:00:10.000000000 GPST"
std::string to_string(SimTime t);
/// "12.5 s", "-3 ns": exact, shortest.
std::string to_string(Duration d);
/// "2025-03-20T00:00:10.000000000", as CCSDS messages write it.
std::string to_calendar(SimTime t);

}  // namespace orrery
