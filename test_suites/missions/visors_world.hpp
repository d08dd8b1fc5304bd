/// The distributed telescope with all that its tests watch: telemetry, estimates against truth,
/// observations, distances.
#pragma once

#include <orrery/orrery.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "formation_gnc/formation_gnc_messages.h"

namespace orrery::visors {

constexpr Duration kOrbit = 5739s;  // 2 pi sqrt(a^3/mu) = 5738.9 s at a = 6928.137 km

inline const unsigned char* data_of(Bytes bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

/// Both telescopes, watched: telemetry, observations, distances.
struct VisorsWorld : FormationWorld {
  struct Observation {
    SimTime begin, end;
    std::vector<missions::ExposureSample> samples;
    bool good() const {
      return samples.size() == 11 &&
             std::all_of(samples.begin(), samples.end(), [](const auto& s) { return s.good(); });
    }
  };

  /// What one of the two believed at an epoch, against truth then.
  struct EstimateError {
    Duration t;  // since the start
    double r_m = 0, v_mps = 0;
    double normalised[6] = {};  // per axis, position and velocity
  };

  explicit VisorsWorld(FormationOptions options)
      : FormationWorld(missions::visors_like(std::move(options))) {
    for (const char* name : {"dsc", "osc"}) {
      flight(name).on_output("telemetry", [this, name](SimTime, Bytes bytes) {
        formation_gnc_telemetry& t = name == std::string("dsc") ? dsc : osc;
        ASSERT_EQ(formation_gnc_get_telemetry(data_of(bytes),
                                              static_cast<std::uint32_t>(bytes.size()), &t),
                  1);
      });
      flight(name).on_output("observation", [this, name](SimTime t, Bytes bytes) {
        note_observation(name, t, bytes);
      });
    }
    flight("osc").on_output("estimate",
                            [this](SimTime t, Bytes bytes) { note_estimate(t, bytes); });
    every(10s, [this] {
      const Vec3 r = r_DC_RTN();
      minimum_separation_m = std::min(minimum_separation_m, norm(r));
      minimum_radial_normal_m = std::min(minimum_radial_normal_m, std::hypot(r.x, r.z));
    });
  }

  void command(Duration when, const formation_gnc_command& c) {
    std::byte message[FORMATION_GNC_COMMAND_BYTES];
    formation_gnc_put_command(reinterpret_cast<unsigned char*>(message), &c);
    ground().command("dsc", at(when), message);
  }
  std::int64_t ns(Duration since_start) { return to_ns(missions::reference_epoch() + since_start); }

  void note_observation(const std::string& name, SimTime t, Bytes bytes) {
    std::int64_t begin_ns = 0, end_ns = 0;
    orrery_get_observation(data_of(bytes), &begin_ns, &end_ns);
    if (name == "dsc") {
      begun_dsc.push_back(from_ns(begin_ns));
      observations.push_back({from_ns(begin_ns), from_ns(end_ns), {}});
    } else {
      begun_osc.push_back(from_ns(begin_ns));
    }
    // In step: within the microsecond that clocks differ by, and what an epoch takes to be found.
    EXPECT_LE(std::abs(to_ns(t) - begin_ns), 1000) << name;
  }
  void note_estimate(SimTime t, Bytes bytes) {
    std::int64_t t_ns = 0;
    double r[3], v[3], sigma_r[3], sigma_v[3];
    orrery_get_estimate(data_of(bytes), &t_ns, r, v, sigma_r, sigma_v);
    const RelativeState truth = relative_state(inertial_state(spacecraft("dsc").truth()),
                                               inertial_state(spacecraft("osc").truth()));
    const Vec3 dr = Vec3{r[0], r[1], r[2]} - truth.r_DC_RTN;
    const Vec3 dv = Vec3{v[0], v[1], v[2]} - truth.v_DC_RTN;
    estimates.push_back({t - missions::reference_epoch(),
                         norm(dr),
                         norm(dv),
                         {dr.x / sigma_r[0], dr.y / sigma_r[1], dr.z / sigma_r[2],
                          dv.x / sigma_v[0], dv.y / sigma_v[1], dv.z / sigma_v[2]}});
  }
  /// Root mean square over the estimates of a span of something of each.
  template <class What>
  double rms_of_estimates(Duration from, Duration until, const What& what) const {
    double sum = 0;
    int count = 0;
    for (const EstimateError& e : estimates) {
      if (e.t < from || e.t >= until) continue;
      sum += what(e) * what(e);
      ++count;
    }
    return count == 0 ? std::numeric_limits<double>::infinity() : std::sqrt(sum / count);
  }
  double position_rms_m(Duration from, Duration until) const {
    return rms_of_estimates(from, until, [](const EstimateError& e) { return e.r_m; });
  }
  double velocity_rms_mps(Duration from, Duration until) const {
    return rms_of_estimates(from, until, [](const EstimateError& e) { return e.v_mps; });
  }
  double normalised_rms(int axis, Duration from, Duration until) const {
    return rms_of_estimates(from, until,
                            [axis](const EstimateError& e) { return e.normalised[axis]; });
  }
  void expose() {
    if (observations.empty() || now() < observations.back().begin ||
        now() > observations.back().end) {
      return;
    }
    observations.back().samples.push_back(
        missions::exposure_sample(spacecraft("dsc").truth(), spacecraft("osc").truth(), now()));
  }
  int good_observations() const {
    return static_cast<int>(std::count_if(observations.begin(), observations.end(),
                                          [](const Observation& o) { return o.good(); }));
  }

  formation_gnc_telemetry dsc = {}, osc = {};
  std::vector<Observation> observations;
  std::vector<SimTime> begun_dsc, begun_osc;
  std::vector<EstimateError> estimates;  // of osc
  double minimum_separation_m = std::numeric_limits<double>::infinity();
  double minimum_radial_normal_m = std::numeric_limits<double>::infinity();
};

inline FormationOptions options_of(RunId run) {
  FormationOptions options{.flight = {.library = "formation_gnc", .heap_bytes = 50_MB}, .run = run};
  return options;
}

inline FormationOptions in_science_orbit(RunId run) {
  FormationOptions options = options_of(run);
  options.roe_m = missions::science_orbit_m();
  return options;
}

inline void expect_sound(VisorsWorld& world) {
  for (const char* name : {"dsc", "osc"}) {
    EXPECT_EQ(world.flight(name).crashes(), 0u) << name;
    EXPECT_EQ(world.flight(name).rejected(), 0u) << name;
  }
  EXPECT_GT(world.crosslink("dsc", "osc").lost(), 0u);
}

inline double rms(const Channel& channel, Duration from, Duration until) {
  double sum = 0;
  int count = 0;
  for (const Channel::Sample& sample : channel.samples()) {
    const Duration t = sample.t - missions::reference_epoch();
    if (t < from || t >= until) continue;
    sum += sample.value * sample.value;
    ++count;
  }
  return count == 0 ? std::numeric_limits<double>::infinity() : std::sqrt(sum / count);
}
inline double largest(const Channel& channel, Duration from, Duration until) {
  double most = 0;
  for (const Channel::Sample& sample : channel.samples()) {
    const Duration t = sample.t - missions::reference_epoch();
    if (t >= from && t < until) most = std::max(most, sample.value);
  }
  return most;
}

struct VisorsTest : WorldTest<VisorsWorld>, testing::WithParamInterface<RunId> {
  explicit VisorsTest(const FormationOptions& options) : WorldTest(options) {}
};

}  // namespace orrery::visors
