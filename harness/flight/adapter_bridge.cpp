#include <orrery/harness/flight/adapter_bridge.hpp>
#include <orrery/harness/flight/containment.hpp>
#include <orrery/harness/flight/flight_adapter.hpp>
#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/port_table.hpp>

#include <cstdio>
#include <utility>

namespace orrery {

// One per life, in the heap of the process. Its functions are flight code.
struct AdapterBridge {
  Process process;
  std::unique_ptr<FlightAdapter> adapter = nullptr;

  AdapterBridge(const orrery_host& host, const internal::AdaptedProcess& of)
      : process(host, *of.ports, *of.library) {}

  static std::int32_t create(void** self, const orrery_host* host, const orrery_boot* boot) {
    const internal::AdaptedProcess of = internal::adapted_process(host);
    auto* bridge = new AdapterBridge(*host, of);
    *self = bridge;
    bridge->process.spacecraft_ = of.options->spacecraft;
    bridge->process.config_ = of.options->config;
    bridge->process.boot_count_ = boot->boot_count;
    bridge->adapter = of.options->adapter(bridge->process);
    return bridge->adapter == nullptr ? ORRERY_FATAL : ORRERY_OK;
  }
  static std::int32_t input(void* self, std::int64_t, std::uint32_t port, const void* data,
                            std::uint32_t bytes) {
    AdapterBridge& bridge = *static_cast<AdapterBridge*>(self);
    bridge.adapter->input(bridge.process, bridge.process.ports_[port].name,
                          Bytes(static_cast<const std::byte*>(data), bytes));
    return ORRERY_OK;
  }
  static std::int32_t tick(void* self, std::int64_t now_ns) {
    AdapterBridge& bridge = *static_cast<AdapterBridge*>(self);
    bridge.adapter->tick(bridge.process, now_ns);
    return ORRERY_OK;
  }
  static void destroy(void* self) { delete static_cast<AdapterBridge*>(self); }
};

std::int32_t Process::output(std::string_view port, Bytes bytes) {
  const std::uint32_t index = internal::find_port(ports_, port, PortDirection::kOut);
  const std::int32_t status = index == UINT32_MAX
                                  ? ORRERY_NOT_FOUND
                                  : host_.output(host_.context, ports_[index].id, bytes.data(),
                                                 static_cast<std::uint32_t>(bytes.size()));
  if (status < 0) {
    char line[128];
    std::snprintf(
        line, sizeof line, "output of %zu bytes on port \"%.*s\": %s", bytes.size(),
        static_cast<int>(port.size()), port.data(),
        status == ORRERY_NOT_FOUND ? "there is none (FlightOptions::adapter_ports)" : "too long");
    log(LogLevel::kWarning, line);
  }
  return status;
}

void Process::request_tick(std::int64_t at_ns) {
  host_.request_tick(host_.context, at_ns);
}

void Process::log(LogLevel level, const char* line) {
  host_.log(host_.context, static_cast<std::int32_t>(level), line);
}

void* Process::address(const char* name) const {
  const internal::SimulatorScope scope;  // what the loader notes down is not the spacecraft's
  return library_.symbol(name);
}

std::vector<FlightPort> FlightAdapter::usual_ports() {
  constexpr std::uint32_t kPacket_bytes = 4096;
  std::vector<FlightPort> ports;
  for (const char* name : {"gnss", "crosslink", "command"}) {
    ports.push_back({.name = name, .max_bytes = kPacket_bytes});
  }
  ports.front().kind = PortKind::kStream;
  for (const char* name : {"crosslink", "thruster", "estimate", "gnss", "telemetry"}) {
    ports.push_back({.name = name, .direction = PortDirection::kOut, .max_bytes = kPacket_bytes});
  }
  return ports;
}

namespace internal {

// Ids are places in the table, whatever the options say.
AdapterTable::AdapterTable(const FlightProcessOptions& options) {
  for (const FlightPort& port : options.adapter_ports) {
    ports_.push_back({static_cast<std::uint32_t>(ports_.size()),
                      static_cast<std::uint16_t>(port.direction),
                      static_cast<std::uint16_t>(port.kind), port.name.c_str(), port.max_bytes});
  }
  flight_ = {sizeof flight_,          ORRERY_ABI_VERSION,
             options.library.c_str(), "adapter",
             ports_.data(),           static_cast<std::uint32_t>(ports_.size()),
             AdapterBridge::create,   AdapterBridge::input,
             AdapterBridge::tick,     AdapterBridge::destroy};
}

}  // namespace internal
}  // namespace orrery
