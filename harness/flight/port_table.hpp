/// Reads and checks what a flight library says about itself.
#pragma once

#include <orrery/harness/flight/flight_process.hpp>

#include <vector>

struct orrery_flight;

namespace orrery::internal {

/// The ports of a library, in the order of its table.
/// @throws std::invalid_argument  the library breaks the ABI: another version, a function missing
///                                that must be there, a port without name, or two of one direction
///                                with the same id or name. The message says which, not for whom.
std::vector<FlightPort> checked_ports(const ::orrery_flight* flight);

}  // namespace orrery::internal
