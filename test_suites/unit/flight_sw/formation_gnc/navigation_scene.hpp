/// Two spacecraft in the truth models and what their receivers say, for tests of navigation: orbits
/// under all forces of Table 1, real NovAtel bytes, attitude with its knowledge error. Nothing of
/// the filter is used to make it but the decoder of the bytes.
#pragma once

#include <orrery/models/attitude/pointing_law.hpp>
#include <orrery/models/gnss/receiver.hpp>
#include <orrery/models/orbit/earth_forces.hpp>
#include <orrery/models/orbit/mean_elements.hpp>
#include <orrery/models/orbit/relative_elements.hpp>
#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "../../models/support/fake_device_context.hpp"
#include "formation_gnc/navigation/gnss_decoder.hpp"

namespace orrery {

/// Numbers of the reference mission where nothing else is said.
struct SceneOptions {
  std::uint64_t seed = 1;
  RelativeElements roe_m = {.dey = 28.3, .diy = 28.3};  // of spacecraft 1 relative to 0
  Duration period = 10s;
  int gravity_degree = 60;
  GnssTrackingOptions tracking = {};
  ReceiverClockOptions clock = {};
  double gps_orbit_m = 1;
  double knowledge_deg = 0.01;
  double drag_difference = 0.01;  // of Cd
  bool slew = false;  // both tip the antenna 75 deg off the zenith for 6 min at 0.4 orbit
};

class NavigationScene {
 public:
  /// What both receivers said at one epoch, as flight software decodes it, and the truth then.
  struct Epoch {
    std::int64_t t_ns = 0;
    std::optional<formation_gnc::GnssEpoch> measured[2];
    formation_gnc::Quaternion q_BI[2];  // as known on board
    std::vector<formation_gnc::BroadcastEphemeris> ephemerides[2];
    ByteBuffer bytes[2];  // all that the receivers sent
    OrbitState truth[2];
    double clock_m[2] = {};
  };

  static SimTime start() { return gps_midnight(2025, 3, 20); }

  explicit NavigationScene(const SceneOptions& options = {})
      : options_(options),
        streams_(options.seed),
        space_(std::make_shared<const EarthEnvironment>()) {
    gps_ = std::make_shared<GpsConstellation>(
        GpsConstellationOptions{.sigma_orbit_m = options.gps_orbit_m}, start(), streams_);
    const EarthForces forces({.gravity_degree = options.gravity_degree});
    const QuasiNonsingularElements chief = to_quasi_nonsingular(
        KeplerianElements{.a_m = 6928137, .e = 0.001, .i_rad = 1.70327, .raan_rad = 5.48});
    const QuasiNonsingularElements deputy = deputy_elements(chief, (1 / chief.a_m) * options.roe_m);
    for (int k = 0; k < 2; ++k) {
      const double drag = 2.2 * (1 + (k == 1 ? options.drag_difference : 0));
      craft_[k] = std::make_unique<Craft>(k == 0 ? chief : deputy, 1000 * options.seed + k, options,
                                          gps_, space_, forces.on({.drag_coefficient = drag}));
    }
  }

  SimTime now() const { return now_; }
  const GnssTracker& tracker(int k) const { return *craft_[k]->receiver.tracker(); }
  std::map<std::string, double, std::less<>>& faults(int k) { return craft_[k]->io.faults; }
  void apply_impulse(int k, SimTime t, const Vec3& dv_ECI) {
    craft_[k]->orbit.apply_impulse(t, dv_ECI);
  }
  OrbitState truth(int k, SimTime t) { return craft_[k]->orbit.at(t); }

  /// The next epoch; the first is at start().
  Epoch next() {
    Epoch e;
    if (started_) now_ += options_.period;
    e.t_ns = to_ns(now_);
    for (int k = 0; k < 2; ++k) observe(k, &e);
    started_ = true;
    return e;
  }

 private:
  struct Craft {
    Craft(const QuasiNonsingularElements& mean, std::uint64_t seed, const SceneOptions& o,
          std::shared_ptr<GpsConstellation> gps, std::shared_ptr<const SpaceEnvironment> space,
          OrbitDynamics::Forces forces)
        : orbit(initial(mean), {.forces = std::move(forces), .environment = space}),
          io(start(), seed),
          receiver(receiver_options(o), std::move(gps)) {
      io.truth_at = [this](SimTime t) { return orbit.at(t); };
      io.surroundings_at = [space](SimTime t) { return space->surroundings(t); };
      io.attitude = law.R_BI(start(), inertial_state(orbit.at(start())));
    }
    static OrbitState initial(const QuasiNonsingularElements& mean) {
      const InertialState s = to_inertial(mean_to_osculating(mean));
      return {start(), s.r_ECI, s.v_ECI, 11};
    }
    static GnssReceiverOptions receiver_options(const SceneOptions& o) {
      using novatel::LogTrigger;
      GnssReceiverOptions r;
      r.period = o.period;
      r.tracking = o.tracking;
      r.clock = o.clock;
      r.logs = {{novatel::kRawEphemId, LogTrigger::kOnChanged},
                {novatel::kRangeId, LogTrigger::kOnTime, o.period},
                {novatel::kBestXyzId, LogTrigger::kOnTime, o.period}};
      return r;
    }
    SpacecraftOrbit orbit;
    PointingLaw law;
    FakeDeviceContext io;
    GnssReceiver receiver;
    formation_gnc::GnssDecoder decoder;
    bool on = false, tipped = false, back = false;
  };

  void observe(int k, Epoch* e) {
    Craft& c = *craft_[k];
    e->truth[k] = c.orbit.at(now_);
    point(c, e->truth[k]);
    c.io.attitude = c.law.R_BI(now_, inertial_state(e->truth[k]));
    c.io.body_rate_B = c.law.at(now_, inertial_state(e->truth[k])).omega_BI_B;
    if (!c.on) c.receiver.start(c.io);
    c.on = true;
    c.io.run_until(now_);
    const Quaternion q = with_knowledge_error(to_quaternion(c.io.attitude), options_.knowledge_deg,
                                              c.io.random("knowledge"));
    e->q_BI[k] = {q.w, q.x, q.y, q.z};
    e->clock_m[k] = 299792458.0 * c.receiver.clock().bias_s();
    decode(k, e);
  }

  // Tips the antenna off the zenith at 0.4 orbit and back 6 min later.
  void point(Craft& c, const OrbitState& state) const {
    if (!options_.slew) return;
    const SimTime begin = start() + 2296s;
    if (now_ >= begin && !c.tipped) {
      const Quaternion zenith = to_quaternion(c.law.R_BI(now_, inertial_state(state)));
      const double half = 0.5 * 75 * std::numbers::pi / 180;
      c.law.point(now_, inertial_state(state),
                  AttitudeMode::target(Quaternion{std::cos(half), std::sin(half), 0, 0} * zenith));
      c.tipped = true;
    }
    if (now_ >= begin + 360s && !c.back) {
      c.law.point(now_, inertial_state(state), AttitudeMode::zenith());
      c.back = true;
    }
  }

  void decode(int k, Epoch* e) {
    Craft& c = *craft_[k];
    const auto take = [&](formation_gnc::GnssDecoder::What what) {
      if (what == formation_gnc::GnssDecoder::kEpoch) e->measured[k] = c.decoder.epoch();
      if (what == formation_gnc::GnssDecoder::kEphemeris) {
        e->ephemerides[k].push_back(c.decoder.ephemeris());
      }
    };
    for (const FakeDeviceContext::ToFlight& sent : c.io.to_flight_log) {
      e->bytes[k].insert(e->bytes[k].end(), sent.bytes.begin(), sent.bytes.end());
      const auto* bytes = reinterpret_cast<const unsigned char*>(sent.bytes.data());
      for (std::size_t at = 0; at < sent.bytes.size(); at += 512) {
        c.decoder.write(bytes + at, std::min<std::size_t>(512, sent.bytes.size() - at));
        for (auto what = c.decoder.next(); what != formation_gnc::GnssDecoder::kNothing;
             what = c.decoder.next()) {
          take(what);
        }
      }
      if (c.decoder.flush()) take(formation_gnc::GnssDecoder::kEpoch);
    }
    c.io.to_flight_log.clear();
  }

  SceneOptions options_;
  RandomStreams streams_;
  std::shared_ptr<const SpaceEnvironment> space_;
  std::shared_ptr<GpsConstellation> gps_;
  std::unique_ptr<Craft> craft_[2];
  SimTime now_ = start();
  bool started_ = false;
};

}  // namespace orrery
