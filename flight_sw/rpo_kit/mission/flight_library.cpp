// The class behind the flight ABI: ports in, ports out, one instance per spacecraft.

#include "orrery_flight.hpp"
#include "orrery_messages.h"
#include "rpo_kit/imaging/star_file.hpp"
#include "rpo_kit/mission/rpo_kit.hpp"
#include "rpo_kit/rpo_kit_messages.h"

namespace rpo_kit {
namespace {

using orrery_abi::Bytes;
using orrery_abi::Host;
using Port = orrery_abi::Port<class Library>;

enum PortId : std::uint32_t {
  kGnss = 1,
  kCrosslink = 2,
  kCommand = 3,
  kThruster = 4,
  kEstimate = 5,
  kMode = 6,
  kTelemetry = 7,
  kBearing = 8,
  kKeypoints = 9,
  kTarget = 10,
  kImage = 11,
  kImaging = 12,
  kView = 13,
  kObservation = 14
};

constexpr int kPorts = 16;
constexpr std::uint32_t kMostImageBytes = 1u << 20;

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
  parse_configuration(static_cast<const char*>(boot.config), boot.config_bytes, &configuration,
                      message, sizeof message);
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
  void out_target(const unsigned char* message, std::uint32_t bytes) override {
    host_.output(kTarget, {message, bytes});
  }
  void out_observation(const unsigned char* packet, std::uint32_t bytes) override {
    host_.output(kObservation, {packet, bytes});
  }
  void out_imaging(const unsigned char* message, std::uint32_t bytes) override {
    host_.output(kImaging, {message, bytes});
  }
  void out_telemetry(const unsigned char* packet, std::uint32_t bytes) override {
    host_.output(kTelemetry, {packet, bytes});
  }
  void request_tick(std::int64_t at_ns) override { host_.request_tick(at_ns); }
  void log(LogLevel level, const char* line) override {
    host_.log(static_cast<std::int32_t>(level), line);
  }

 private:
  Host host_;
};

class Library {
 public:
  Library(Host host, const orrery_boot& boot)
      : outputs_(host), kit_(outputs_, configuration_of(boot), {boot.now_ns, boot.boot_count}) {}

  std::int32_t gnss(std::int64_t now_ns, Bytes bytes) {
    return status(kit_.in_gnss(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t crosslink(std::int64_t now_ns, Bytes bytes) {
    return status(kit_.in_crosslink(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t command(std::int64_t now_ns, Bytes bytes) {
    return status(kit_.in_command(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t bearing(std::int64_t, Bytes bytes) {
    return status(kit_.in_bearing(data_of(bytes), bytes.size));
  }
  std::int32_t observation(std::int64_t now_ns, Bytes bytes) {
    return status(kit_.in_observation(now_ns, data_of(bytes), bytes.size));
  }
  std::int32_t keypoints(std::int64_t, Bytes bytes) {
    return status(kit_.in_keypoints(data_of(bytes), bytes.size));
  }
  std::int32_t image(std::int64_t, Bytes bytes) {
    return status(kit_.in_image(data_of(bytes), bytes.size));
  }
  std::int32_t view(std::int64_t, Bytes bytes) {
    return status(kit_.in_view(data_of(bytes), bytes.size));
  }
  std::int32_t tick(std::int64_t now_ns) {
    kit_.in_tick(now_ns);
    return ORRERY_OK;
  }
  static const Port (&ports())[kPorts];

 private:
  HostOutputs outputs_;
  RpoKit kit_;
};

const Port (&Library::ports())[kPorts] {
  static const Port table[kPorts] = {
      {kGnss, ORRERY_IN, ORRERY_STREAM, "gnss", 4096, &Library::gnss},
      {kCrosslink, ORRERY_IN, ORRERY_PACKET, "crosslink", 256, &Library::crosslink},
      {kCommand, ORRERY_IN, ORRERY_PACKET, "command", 256, &Library::command},
      {kBearing, ORRERY_IN, ORRERY_PACKET, "bearing", RPO_KIT_BEARING_BYTES, &Library::bearing},
      {kObservation, ORRERY_IN, ORRERY_PACKET, "observation", 256, &Library::observation},
      {kKeypoints, ORRERY_IN, ORRERY_PACKET, "keypoints", RPO_KIT_KEYPOINTS_BYTES,
       &Library::keypoints},
      {kImage, ORRERY_IN, ORRERY_PACKET, "camera", kMostImageBytes, &Library::image},
      {kView, ORRERY_IN, ORRERY_PACKET, "view", kMostImageBytes, &Library::view},
      {kCrosslink, ORRERY_OUT, ORRERY_PACKET, "crosslink", formation_keeping::kCrosslinkBytes,
       nullptr},
      {kThruster, ORRERY_OUT, ORRERY_PACKET, "thruster", ORRERY_THRUSTER_BYTES, nullptr},
      {kEstimate, ORRERY_OUT, ORRERY_PACKET, "estimate", ORRERY_ESTIMATE_BYTES, nullptr},
      {kMode, ORRERY_OUT, ORRERY_PACKET, "mode", ORRERY_MODE_BYTES, nullptr},
      {kTelemetry, ORRERY_OUT, ORRERY_PACKET, "telemetry", RPO_KIT_TELEMETRY_BYTES, nullptr},
      {kTarget, ORRERY_OUT, ORRERY_PACKET, "target", RPO_KIT_TARGET_BYTES, nullptr},
      {kImaging, ORRERY_OUT, ORRERY_PACKET, "imaging", RPO_KIT_IMAGING_BYTES, nullptr},
      {kObservation, ORRERY_OUT, ORRERY_PACKET, "observation", RPO_KIT_OBSERVATION_BYTES, nullptr},
  };
  return table;
}

// In front of the C++ face's own create(), which has no way to fail: a wrong configuration is a
// boot failure with its reason in the log.
std::int32_t create_checked(void** self, const orrery_host* host,
                            const orrery_boot* boot) noexcept {
  Configuration configuration;
  char message[192];
  const bool good = parse_configuration(static_cast<const char*>(boot->config), boot->config_bytes,
                                        &configuration, message, sizeof message) &&
                    (*configuration.star_catalogue == '\0' ||
                     load_stars(configuration.star_catalogue, nullptr, message, sizeof message));
  if (!good) {
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
}  // namespace rpo_kit

extern "C" ORRERY_EXPORT const orrery_flight* ORRERY_FLIGHT_ENTRY(void) {
  using rpo_kit::Library;
  static orrery_port ports[sizeof(Library::ports()) / sizeof(Library::ports()[0])];
  static const orrery_flight flight =
      rpo_kit::with_checked_create(orrery_abi::describe(Library::ports(), ports, "rpo_kit", "1.0"));
  return &flight;
}
