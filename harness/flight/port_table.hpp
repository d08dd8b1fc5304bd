/// Reads and checks what a flight library says about itself.
#pragma once

#include <orrery/harness/flight/flight_process.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

struct orrery_flight;

namespace orrery::internal {

/// The ports of a library, in the order of its table.
/// @throws std::invalid_argument  the library breaks the ABI: another version, a function missing
///                                that must be there, a port without name, or two of one direction
///                                with the same id or name. The message says which, not for whom.
std::vector<FlightPort> checked_ports(const ::orrery_flight* flight);

/// Its place in the table; UINT32_MAX: none.
std::uint32_t find_port(const std::vector<FlightPort>& ports, std::string_view name,
                        PortDirection direction);
/// @throws std::invalid_argument  no such input; the message lists those of `process`.
std::uint32_t require_input_port(std::string_view function, const std::string& process,
                                 const std::vector<FlightPort>& ports, std::string_view name);

}  // namespace orrery::internal
