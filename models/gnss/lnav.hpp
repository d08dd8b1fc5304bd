/// Packing of the LNAV message, subframes 1 to 3, as NovAtel's RAWEPHEM carries them: ten words of
/// 24 data bits each, parity removed, most significant bit first.
///
/// Source      IS-GPS-200, Figure 20-1 and Tables 20-I, 20-III
/// Rounding    to the nearest step of the message, ties away from zero. Against rounded elements a
///             satellite moves by up to 5 cm (angles in steps of 2^-31 semicircles); so let the
///             truth be quantised().
/// Checked by  test_suites/unit/models/gnss/lnav_test.cpp, against a bit-by-bit packer
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/models/gnss/broadcast_ephemeris.hpp>

#include <array>
#include <cstddef>

namespace orrery::lnav {

constexpr std::size_t kSubframeBytes = 30;
using Subframe = std::array<std::byte, kSubframeBytes>;
using Subframes = std::array<Subframe, 3>;  // subframes 1, 2 and 3

/// The three subframes of a frame that starts at `tow_s` [s of week, a multiple of 30]: their
/// hand-over words count to the subframe that follows each. Alert and anti-spoof flags are 0 and 1.
/// @throws std::invalid_argument  a value that its field cannot hold, named with the accepted
/// range;
///                                iode other than iodc % 256; `tow_s` outside 0 to 604799.
Subframes pack(const BroadcastEphemeris& ephemeris, int tow_s);

/// The reverse; the 10 bits of the week are completed to the week nearest `reference_week`, and toe
/// is taken as within half a week of the transmission.
/// @throws std::invalid_argument  preamble or ids other than 1, 2, 3; issues that differ.
BroadcastEphemeris unpack(const Subframes& subframes, int prn, int reference_week);

/// What a user of the message computes with: unpack(pack(ephemeris)).
BroadcastEphemeris quantised(const BroadcastEphemeris& ephemeris);

/// User range accuracy [m] of an index, 0 to 15: 20.3.3.3.1.3's nominal 2^(1 + N/2), rounded as
/// printed there; 15 gives 6144, the limit above which there is no prediction.
double ura_m(int ura_index);

}  // namespace orrery::lnav
