/// The ABI over a FlightAdapter: what a process calls where the library has no entry of its own.
#pragma once

#include <orrery/harness/flight/flight_options.hpp>

#include <orrery_flight.h>
#include <vector>

namespace orrery {
class FlightLibrary;
}

namespace orrery::internal {

/// The table of functions and ports; it refers to `options`.
class AdapterTable {
 public:
  explicit AdapterTable(const FlightProcessOptions& options);
  const orrery_flight* flight() const { return &flight_; }

 private:
  std::vector<orrery_port> ports_;
  orrery_flight flight_{};
};

/// What the functions of the table need of the process whose host table they were given.
struct AdaptedProcess {
  const FlightProcessOptions* options = nullptr;
  const FlightLibrary* library = nullptr;
  const std::vector<FlightPort>* ports = nullptr;
};
/// Of a host table; defined by the process (host_callbacks.cpp).
AdaptedProcess adapted_process(const orrery_host* host);

}  // namespace orrery::internal
