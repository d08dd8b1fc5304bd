/// From the bytes of the own NovAtel receiver to epochs and ephemerides.
///
/// RANGE or RANGECMP give the observations (GPS L1 C/A in phase lock; the twelve strongest if there
/// are more), BESTXYZ the fix, RAWEPHEM or GPSEPHEM the ephemerides. Logs of one epoch carry one
/// time; an epoch is complete when both kinds have come, when a later log shows that no more will,
/// or when flush() is called after the last byte of what the receiver says at an epoch.
///
///     decoder.write(bytes, count);
///     for (auto what = decoder.next(); what != GnssDecoder::kNothing; what = decoder.next()) {
///       if (what == GnssDecoder::kEpoch) navigation.own_epoch(decoder.epoch(), q_BI);
///       if (what == GnssDecoder::kEphemeris) navigation.ephemeris(decoder.ephemeris());
///     }
///     if (decoder.flush()) navigation.own_epoch(decoder.epoch(), q_BI);
///
/// Checked by  test_suites/unit/flight_sw/formation_gnc/gnss_decoder_test.cpp
#pragma once

#include <cstddef>
#include <cstdint>

#include "formation_gnc/navigation/broadcast_ephemeris.hpp"
#include "formation_gnc/navigation/gnss_epoch.hpp"

namespace formation_gnc {

class GnssDecoder {
 public:
  enum What { kNothing, kEpoch, kEphemeris };

  GnssDecoder();
  GnssDecoder(const GnssDecoder&) = delete;  // the framer points into this object
  GnssDecoder& operator=(const GnssDecoder&) = delete;

  /// Takes bytes; what does not fit (4 kB, a bound for sound streams between two calls of next())
  /// is dropped and counted.
  void write(const unsigned char* bytes, std::size_t count);
  What next();
  /// True: an epoch that was still waiting for another log is given as it is.
  bool flush();

  const GnssEpoch& epoch() const { return given_; }
  const BroadcastEphemeris& ephemeris() const { return ephemeris_; }
  std::uint32_t bytes_dropped() const { return bytes_dropped_; }

 private:
  bool take(const novatel_frame& frame);
  bool is_complete() const;
  What give();

  unsigned char room_[4096];
  novatel_framer framer_;
  GnssEpoch waiting_, given_;
  bool has_range_ = false, has_fix_log_ = false;  // of what is waiting
  GnssEpoch held_;                                // begun by the log that showed the end of another
  bool held_back_ = false, held_has_range_ = false;
  BroadcastEphemeris ephemeris_;
  std::uint32_t bytes_dropped_ = 0;
};

}  // namespace formation_gnc
