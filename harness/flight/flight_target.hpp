/// A flight process whose library runs on a target (harness/remote).
#pragma once

#include <orrery/harness/flight/flight_options.hpp>
#include <orrery/harness/remote/remote_flight.hpp>

#include <cstdint>
#include <optional>
#include <orrery_flight.h>
#include <vector>

namespace orrery::internal {

/// Reaches it, and makes of its HELLO the table that a loaded library would have.
class FlightTarget {
 public:
  /// @throws std::invalid_argument  naming the process: the target cannot be reached, or says no
  ///                                HELLO.
  explicit FlightTarget(const FlightProcessOptions& options);
  FlightTarget(const FlightTarget&) = delete;  // the table points into it
  FlightTarget& operator=(const FlightTarget&) = delete;

  const orrery_flight* flight() const { return &table_; }
  RemoteFlight& remote() { return *remote_; }

 private:
  std::optional<RemoteFlight> remote_;
  std::vector<orrery_port> ports_;
  orrery_flight table_{};
};

}  // namespace orrery::internal
