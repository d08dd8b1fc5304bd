/// A flight process whose library runs on a target (harness/remote).
#pragma once

#include <orrery/harness/flight/flight_options.hpp>
#include <orrery/harness/remote/remote_flight.hpp>

#include <cstdint>
#include <optional>
#include <orrery_flight.h>
#include <string>
#include <vector>

namespace orrery::internal {

/// For a process on an emulator, else empty: the option with which it waits there for a debugger,
/// and the command that is one; both together in one line of a shell.
struct TargetDebugging {
  std::string option, debugger;
};
TargetDebugging target_debugging(const FlightProcessOptions& options);

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
  /// @throws TargetLost  simulated time depends on counted instructions, and there are none
  void check_cost(const TargetAnswer& answer) const;

 private:
  bool wants_instructions_;
  std::optional<RemoteFlight> remote_;
  std::vector<orrery_port> ports_;
  orrery_flight table_{};
};

}  // namespace orrery::internal
