/// Epochs as CCSDS messages write them: a calendar and a time system.
#pragma once

#include <orrery/harness/kernel/time.hpp>

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace orrery {

/// TIME_SYSTEM of an orbit data message (CCSDS 502.0-B, annex).
enum class TimeSystem { kUTC, kTAI, kGPS, kTT, kTDB, kTCB, kTCG, kUT1, kGMST, kMET, kMRT, kSCLK };

/// "UTC"
std::string_view name_of(TimeSystem system);
/// Any case. None: no such time system.
std::optional<TimeSystem> time_system_named(std::string_view name);

/// What a calendar and clock of some time system show. Kept as written, to the nanosecond, so that
/// a message can be written again unchanged; to_sim_time says when that is.
struct CcsdsEpoch {
  std::int32_t day = 0;        // since 1970-01-01, proleptic Gregorian
  std::int64_t ns_of_day = 0;  // 86400 s and above in a leap second (UTC only)

  friend auto operator<=>(const CcsdsEpoch&, const CcsdsEpoch&) = default;
};

/// "YYYY-MM-DDThh:mm:ss[.d...][Z]" or "YYYY-DDDThh:mm:ss[.d...][Z]" (CCSDS 502.0-B, 7.5.10); digits
/// beyond the ninth are dropped. None: anything else, a date that does not exist, 24:00:00. Second
/// 60 is accepted at 23:59 (whether that day had one is to_sim_time's to say).
std::optional<CcsdsEpoch> read_epoch(std::string_view text);

/// "2017-04-11T22:31:43.121856": as many digits as it takes, at least whole seconds.
std::string to_text(const CcsdsEpoch& epoch);

/// TAI, GPS, TT exactly; UTC exactly, with ERFA's leap seconds; TDB within 10 us (eraDtdb at the
/// geocentre).
/// @throws std::invalid_argument  another time system; a year outside 1980-2200; a leap second on a
///                                day that has none.
SimTime to_sim_time(const CcsdsEpoch& epoch, TimeSystem system);
/// The inverse: exact, for TDB to 1 ns. @throws as to_sim_time.
CcsdsEpoch to_epoch(SimTime t, TimeSystem system);

}  // namespace orrery
