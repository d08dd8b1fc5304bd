#include <orrery/harness/flight/port_table.hpp>

#include <orrery_flight.h>
#include <stdexcept>
#include <string>

namespace orrery::internal {
namespace {

[[noreturn]] void refuse(const std::string& reason) {
  throw std::invalid_argument(reason);
}

const char* direction_name(PortDirection direction) {
  return direction == PortDirection::kIn ? "input" : "output";
}

void check_table(const ::orrery_flight* flight) {
  if (flight == nullptr) refuse("orrery_flight_entry returned null");
  // The version stands at the same place in every version; nothing else is read before it.
  if (flight->abi_version != ORRERY_ABI_VERSION) {
    refuse("it has ABI version " + std::to_string(flight->abi_version) + ", this harness has " +
           std::to_string(ORRERY_ABI_VERSION));
  }
  if (flight->size < sizeof(::orrery_flight)) {
    refuse("its orrery_flight has " + std::to_string(flight->size) + " bytes, at least " +
           std::to_string(sizeof(::orrery_flight)) + " are needed");
  }
  if (flight->name == nullptr) refuse("its name is null");
  if (flight->create == nullptr) refuse("its function create is null");
  if (flight->input == nullptr) refuse("its function input is null");
  if (flight->destroy == nullptr) refuse("its function destroy is null");
  if (flight->ports == nullptr && flight->port_count > 0) {
    refuse("it has " + std::to_string(flight->port_count) + " ports, and a null port table");
  }
}

FlightPort checked_port(const ::orrery_port& row, std::uint32_t number) {
  const std::string where = "row " + std::to_string(number) + " of its port table";
  if (row.name == nullptr || *row.name == 0) refuse(where + " has no name");
  if (row.direction != ORRERY_IN && row.direction != ORRERY_OUT) {
    refuse(where + " (" + row.name + "): direction " + std::to_string(row.direction) +
           " is neither ORRERY_IN nor ORRERY_OUT");
  }
  if (row.kind != ORRERY_PACKET && row.kind != ORRERY_STREAM) {
    refuse(where + " (" + row.name + "): kind " + std::to_string(row.kind) +
           " is neither ORRERY_PACKET nor ORRERY_STREAM");
  }
  if (row.max_bytes == 0) refuse(where + " (" + row.name + "): max_bytes is 0");
  return {row.name, row.direction == ORRERY_IN ? PortDirection::kIn : PortDirection::kOut,
          row.kind == ORRERY_PACKET ? PortKind::kPacket : PortKind::kStream, row.id, row.max_bytes};
}

}  // namespace

std::vector<FlightPort> checked_ports(const ::orrery_flight* flight) {
  check_table(flight);
  std::vector<FlightPort> ports;
  for (std::uint32_t i = 0; i < flight->port_count; ++i) {
    const FlightPort port = checked_port(flight->ports[i], i);
    for (const FlightPort& other : ports) {
      if (other.direction != port.direction) continue;
      const std::string what = std::string("two ") + direction_name(port.direction) + " ports ";
      if (other.name == port.name) refuse(what + "are called \"" + port.name + "\"");
      if (other.id == port.id) {
        refuse(what + "have id " + std::to_string(port.id) + ": \"" + other.name + "\" and \"" +
               port.name + "\"");
      }
    }
    ports.push_back(port);
  }
  return ports;
}

std::uint32_t find_port(const std::vector<FlightPort>& ports, std::string_view name,
                        PortDirection direction) {
  for (std::uint32_t i = 0; i < ports.size(); ++i) {
    if (ports[i].direction == direction && ports[i].name == name) return i;
  }
  return UINT32_MAX;
}

std::uint32_t require_input_port(std::string_view function, const std::string& process,
                                 const std::vector<FlightPort>& ports, std::string_view name) {
  const std::uint32_t index = find_port(ports, name, PortDirection::kIn);
  if (index != UINT32_MAX) return index;
  std::string known;
  for (const FlightPort& port : ports) {
    if (port.direction == PortDirection::kIn) known += (known.empty() ? "" : ", ") + port.name;
  }
  throw std::invalid_argument(std::string(function) + ": " + process + " has no input port \"" +
                              std::string(name) + "\"; it has " + (known.empty() ? "none" : known));
}

}  // namespace orrery::internal
