/// An impulsive manoeuvre of the spacecraft that manoeuvres.
#pragma once

#include <cstdint>

#include "support/matrix.hpp"

namespace flight_support {

/// A burn as commanded: middle of it, and delta-v in the burning spacecraft's RTN at that instant.
struct Burn {
  std::int64_t t_ns = 0;  ///< GPS time, ns since 1980-01-06
  Vec3 dv_RTN;            ///< [m/s]
};

}  // namespace flight_support
