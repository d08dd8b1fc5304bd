// The class behind the flight ABI: ports in, ports out, one instance per spacecraft.
//
// Built once more for each of five defects that packages of this kind have had (Bell & D'Amico), so
// that regression tests can show what catches them, FORMATION_GNC_DEFECT_ and:
//   NO_RETRANSMISSION  here: transitions are sent once and not waited for; the passive side
//                      takes it that it knows of each
//   ORDERED_QUEUE      here: measurements are taken to arrive in the order sent
//   SWAPPED_STATES     navigation/integer_resolution.cpp: a satellite is taken to have the same
//                      channel, and so the same place in the covariance, in both receivers
//   ANGLE_WRAP         control/science_orbit.cpp: an angle that wraps within Newton's iteration
//   HIDDEN_STATIC      support/orbit/earth_rotation.cpp: a cache that outlives its user

#include <cassert>
#include <cstring>

#include "formation_gnc/mission/formation_gnc.hpp"
#include "orrery_flight.hpp"
#include "orrery_messages.h"

namespace formation_gnc {
namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using Port = orrery_abi::Port<class Library>;

enum PortId : std::uint32_t {
  kGnss = 1,
  kBus = 2,
  kCrosslink = 3,
  kCommand = 4,
  kThruster = 5,
  kObservation = 6,
  kMode = 7,
  kEstimate = 8,
  kTelemetry = 9
};

const unsigned char* data_of(Bytes bytes) {
  return static_cast<const unsigned char*>(bytes.data);
}

std::int32_t status(bool accepted) {
  return accepted ? ORRERY_OK : ORRERY_REJECTED;
}

// Read again after create() checked it, so it is sound.
Configuration configuration_of(const orrery_boot& boot) {
  Configuration configuration;
  char message[192];
  parse_configuration(static_cast<const char*>(boot.config), boot.config_bytes, boot.spacecraft,
                      &configuration, message, sizeof message);
#ifdef FORMATION_GNC_DEFECT_NO_RETRANSMISSION
  configuration.link.retransmit = false;
  configuration.mission.transition.await_acknowledgement = false;
#endif
  return configuration;
}

// What the class says, as messages on ports.
class HostOutputs final : public Outputs {
 public:
  explicit HostOutputs(Host host) : host_(host) {}

  void out_crosslink(const unsigned char* packet, std::uint32_t bytes) override {
    host_.output(kCrosslink, {packet, bytes});
  }
  bool out_maneuver(std::int64_t mid_burn_ns, const double dv_ECI[3]) override {
    unsigned char message[ORRERY_THRUSTER_BYTES];
    orrery_put_thruster(message, mid_burn_ns, dv_ECI);
    return host_.output(kThruster, {message, sizeof message}) == ORRERY_OK;
  }
  void out_observation(std::int64_t begin_ns, std::int64_t end_ns) override {
    unsigned char message[ORRERY_OBSERVATION_BYTES];
    orrery_put_observation(message, begin_ns, end_ns);
    host_.output(kObservation, {message, sizeof message});
  }
  void out_mode(std::int64_t t_ns, std::uint32_t mode) override {
    unsigned char message[ORRERY_MODE_BYTES];
    orrery_put_mode(message, t_ns, mode);
    host_.output(kMode, {message, sizeof message});
  }
  void out_estimate(const RelativeOutput& e) override {
    unsigned char message[ORRERY_ESTIMATE_BYTES];
    orrery_put_estimate(message, e.t_ns, e.r_DC_RTN, e.v_DC_RTN, e.sigma_r_m, e.sigma_v_mps);
    host_.output(kEstimate, {message, sizeof message});
  }
  void out_telemetry(const unsigned char* packet, std::uint32_t bytes) override {
    host_.output(kTelemetry, {packet, bytes});
  }
  void out_gnss(const char* command) override {
    host_.output(kGnss, {command, static_cast<std::uint32_t>(std::strlen(command))});
  }
  void request_tick(std::int64_t onboard_ns) override { host_.request_tick(onboard_ns); }
  void log(LogLevel level, const char* line) override {
    host_.log(static_cast<std::int32_t>(level), line);
  }
  std::int32_t load(std::uint32_t slot, unsigned char* to, std::uint32_t capacity) override {
    if (!ORRERY_HAS(host_.operator->(), nv_load)) return ORRERY_NOT_FOUND;
    return host_->nv_load(host_->context, slot, to, capacity);
  }
  void store(std::uint32_t slot, const unsigned char* from, std::uint32_t bytes) override {
    if (ORRERY_HAS(host_.operator->(), nv_store)) {
      host_->nv_store(host_->context, slot, from, bytes);
    }
  }

 private:
  Host host_;
};

class Library {
 public:
  Library(Host host, const orrery_boot& boot)
      : outputs_(host), gnc_(outputs_, configuration_of(boot), {boot.now_ns, boot.boot_count}) {}

  std::int32_t gnss(std::int64_t now_ns, Bytes bytes) {
    return status(gnc_.in_gnss(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t bus(std::int64_t now_ns, Bytes bytes) {
    return status(gnc_.in_bus(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t crosslink(std::int64_t now_ns, Bytes bytes) {
    expect_order(bytes);
    expect_known(now_ns);
    return status(gnc_.in_crosslink(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t command(std::int64_t now_ns, Bytes bytes) {
    return status(gnc_.in_command(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t tick(std::int64_t now_ns) {
    gnc_.in_tick(now_ns);
    return ORRERY_OK;
  }
  static const Port (&ports())[11];

 private:
#ifdef FORMATION_GNC_DEFECT_ORDERED_QUEUE
  void expect_order(Bytes bytes) {
    formation_gnc_header header;
    formation_gnc_measurement m;
    const unsigned char* packet = data_of(bytes);
    if (formation_gnc_get_packet(packet, bytes.size, &header) == 0 ||
        formation_gnc_get_measurement(packet + FORMATION_GNC_HEADER_BYTES, header.body_bytes, &m) ==
            0) {
      return;
    }
    assert(m.t_ns > newest_ns_);
    newest_ns_ = m.t_ns;
  }
  std::int64_t newest_ns_ = 0;
#else
  void expect_order(Bytes) {}
#endif
#ifdef FORMATION_GNC_DEFECT_NO_RETRANSMISSION
  // An announcement may be overtaken; a minute after the commitment it should be there.
  void expect_known(std::int64_t now_ns) {
    const TransitionRecord& record = gnc_.mission().protocol().record();
    const std::uint32_t known = record.has_pending ? record.pending.id : record.executed_id;
    if (record.committed_id <= known) unknown_since_ns_ = now_ns;
    assert(now_ns - unknown_since_ns_ < INT64_C(60000000000));
  }
  std::int64_t unknown_since_ns_ = 0;
#else
  void expect_known(std::int64_t) {}
#endif

  HostOutputs outputs_;
  FormationGnc gnc_;
};

const Port (&Library::ports())[11] {
  static const Port table[11] = {
      {kGnss, ORRERY_IN, ORRERY_STREAM, "gnss", 4096, &Library::gnss},
      {kBus, ORRERY_IN, ORRERY_PACKET, "bus", ORRERY_BUS_BYTES, &Library::bus},
      {kCrosslink, ORRERY_IN, ORRERY_PACKET, "crosslink", 1024, &Library::crosslink},
      {kCommand, ORRERY_IN, ORRERY_PACKET, "command", 1024, &Library::command},
      {kGnss, ORRERY_OUT, ORRERY_STREAM, "gnss", 256, nullptr},
      {kCrosslink, ORRERY_OUT, ORRERY_PACKET, "crosslink", FORMATION_GNC_PACKET_BYTES, nullptr},
      {kThruster, ORRERY_OUT, ORRERY_PACKET, "thruster", ORRERY_THRUSTER_BYTES, nullptr},
      {kObservation, ORRERY_OUT, ORRERY_PACKET, "observation", ORRERY_OBSERVATION_BYTES, nullptr},
      {kMode, ORRERY_OUT, ORRERY_PACKET, "mode", ORRERY_MODE_BYTES, nullptr},
      {kEstimate, ORRERY_OUT, ORRERY_PACKET, "estimate", ORRERY_ESTIMATE_BYTES, nullptr},
      {kTelemetry, ORRERY_OUT, ORRERY_PACKET, "telemetry", FORMATION_GNC_TELEMETRY_BYTES, nullptr},
  };
  return table;
}

// In front of the C++ face's own create(), which has no way to fail: a wrong configuration is a
// boot failure with its reason in the log.
std::int32_t create_checked(void** self, const orrery_host* host,
                            const orrery_boot* boot) noexcept {
  Configuration configuration;
  char message[192];
  if (!parse_configuration(static_cast<const char*>(boot->config), boot->config_bytes,
                           boot->spacecraft, &configuration, message, sizeof message)) {
    host->log(host->context, ORRERY_ERROR, message);
    return ORRERY_FATAL;
  }
  return orrery_abi::Thunks<Library>::create(self, host, boot);
}

orrery_flight with_checked_create(orrery_flight flight) {
  flight.create = &create_checked;
  return flight;
}

}  // namespace
}  // namespace formation_gnc

extern "C" ORRERY_EXPORT const orrery_flight* ORRERY_FLIGHT_ENTRY(void) {
  using formation_gnc::Library;
  static orrery_port ports[sizeof(Library::ports()) / sizeof(Library::ports()[0])];
  static const orrery_flight flight = formation_gnc::with_checked_create(
      orrery_abi::describe(Library::ports(), ports, "formation_gnc", "1.0"));
  return &flight;
}
