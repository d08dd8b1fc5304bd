/// Finds NovAtel BESTXYZ logs in a byte stream that may be cut anywhere.
///
/// Method  Only a header that announces exactly a BESTXYZ body is collected; every other byte is
///         scanned over. No length field is trusted before its CRC, so a corrupted or unknown log
///         can neither stall the parser nor make it skip the log behind it: after a bad CRC the
///         scan resumes one byte behind the false start, inside the bytes already held.
/// Memory  One frame of 144 bytes. No allocation.
/// Source  NovAtel OEM7 Commands and Logs Reference: binary header, BESTXYZ (241), CRC-32.
#pragma once

#include <cstdint>

#include "support/matrix.hpp"

namespace formation_keeping {

/// A position and velocity solution of one receiver, of its antenna.
struct GnssFix {
  std::int64_t epoch_ns = 0;    ///< GPS ns since 1980-01-06
  flight_support::Vec3 r_ECEF;  ///< [m]
  flight_support::Vec3 v_ECEF;  ///< [m/s], relative to the rotating Earth
  double sigma_r_m = 0.0;       ///< 1-sigma per axis: root mean square of the three axes
  double sigma_v_mps = 0.0;     ///< likewise
};

/// Finite, between 6300 km and 50000 km from the Earth's centre, slower than 12 km/s, sigmas above
/// zero, time between 1980 and 2099.
bool is_plausible(const GnssFix& fix);

class BestxyzParser {
 public:
  static constexpr int kFrameBytes = 28 + 112 + 4;

  enum class Event {
    kNothing,   ///< the byte completed nothing
    kFix,       ///< fix() is a new solution
    kNoFix,     ///< a sound frame without a usable solution: not computed, no time, out of range
    kBadFrame,  ///< a frame was dropped for its CRC
  };

  /// Takes one byte of the stream.
  Event push(unsigned char byte);
  /// The last solution; valid after kFix.
  const GnssFix& fix() const { return fix_; }

 private:
  bool could_be_frame() const;
  void drop_first_and_resynchronise();
  bool decode();

  unsigned char held_[kFrameBytes] = {};
  int count_ = 0;
  GnssFix fix_;
};

}  // namespace formation_keeping
