/// A library with an interface of its own as flight software: a class of the test that calls it.
#pragma once

#include <orrery/harness/flight/flight_port.hpp>
#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

struct orrery_host;

namespace orrery {

class FlightLibrary;

/// What an adapter may ask of its host, within a call of it.
class Process {
 public:
  std::string_view spacecraft() const { return spacecraft_; }
  std::string_view config() const { return config_; }
  std::uint32_t boot_count() const { return boot_count_; }

  /// 0; negative, and a warning in the log, if there is no such output or the message is too long.
  std::int32_t output(std::string_view port, Bytes bytes);
  /// As the ABI's: one pending, negative withdraws it.
  void request_tick(std::int64_t at_ns);
  void log(LogLevel level, const char* line);

  /// A function or variable that the library exports, by its linker's name: of this process's own
  /// copy under Isolation::kCopy. Null: none. symbol<int(double)>("gnc_mode")
  template <class T>
  T* symbol(const char* name) const {
    return reinterpret_cast<T*>(address(name));
  }

 private:
  friend struct AdapterBridge;
  Process(const orrery_host& host, const std::vector<FlightPort>& ports,
          const FlightLibrary& library)
      : host_(host), ports_(ports), library_(library) {}
  void* address(const char* name) const;

  const orrery_host& host_;
  const std::vector<FlightPort>& ports_;
  const FlightLibrary& library_;
  std::string_view spacecraft_, config_;
  std::uint32_t boot_count_ = 0;
};

/// Called in flight context: it lives in the process's heap, may crash, and is then dropped without
/// its destructor. What it calls by linking is shared by all its processes (Isolation::kShared); a
/// library that is flown under Isolation::kCopy must not be linked by the test program, and is
/// reached by Process::symbol().
class FlightAdapter {
 public:
  virtual ~FlightAdapter() = default;
  virtual void input(Process& process, std::string_view port, Bytes bytes) = 0;
  virtual void tick(Process& process, std::int64_t now_ns) {
    (void)process;
    (void)now_ns;
  }

  /// Inputs gnss (a stream), crosslink and command; outputs crosslink, thruster, estimate, gnss and
  /// telemetry: what FlightOptions::adapter_ports are by default.
  static std::vector<FlightPort> usual_ports();
};

/// Makes the adapter at each boot, in flight context.
using AdapterFactory = std::function<std::unique_ptr<FlightAdapter>(Process&)>;

}  // namespace orrery
