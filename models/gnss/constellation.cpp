#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/gnss/constellation.hpp>
#include <orrery/models/gnss/lnav.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace orrery {
namespace {

constexpr Duration kKnots = 120s;
constexpr double kKnots_s = 120;
constexpr Duration kIssue = 2h;  // a week has a whole number of them
constexpr double kGuard_m = 1e-4;
constexpr double kTwoPi = 2 * std::numbers::pi;

// Steps of the LNAV message, IS-GPS-200 Tables 20-I and 20-III.
constexpr double kStepAngle_rad = 0x1p-31 * kGpsPi;
constexpr double kStepRate_radps = 0x1p-43 * kGpsPi;
// Coarser than the message's 2^-43, so that two hours are whole steps of angle and of af0.
constexpr double kStepNodeRate_radps = 0x1p-36 * kGpsPi;
constexpr double kStepAf1_sps = 0x1p-36;

double rounded(double value, double step) {
  return step * std::round(value / step);
}
double wrapped(double angle_rad) {
  return std::remainder(angle_rad, kTwoPi);
}

std::string label(int prn) {
  return (prn < 10 ? "G0" : "G") + std::to_string(prn);
}

double mean_motion(const BroadcastEphemeris& e) {
  const double a_m = e.sqrt_a_sqrtm * e.sqrt_a_sqrtm;
  return std::sqrt(gps::kMu_m3ps2 / (a_m * a_m * a_m)) + e.delta_n_radps;
}

/// The delta n below 64 steps for which an issue's worth of motion is closest to whole steps of M0.
double aligned_delta_n(double n_radps) {
  double best = 0, least = 1;
  for (int k = -64; k < 64; ++k) {
    const double steps = (n_radps + k * kStepRate_radps) * to_seconds(kIssue) / kStepAngle_rad;
    const double miss = std::abs(steps - std::round(steps));
    if (miss < least) least = miss, best = k * kStepRate_radps;
  }
  return best;
}

int six_bit_health(int almanac_health) {
  const int six = almanac_health & 63;
  return almanac_health != 0 && six == 0 ? 63 : six;
}

/// The elements of an issue at `toe`: the truth's, carried on to its instant.
BroadcastEphemeris carried_on(const BroadcastEphemeris& base, SimTime toe) {
  const double dt_s = to_seconds(toe - time_of_ephemeris(base));
  BroadcastEphemeris e = base;
  e.week = gps::week_of(toe);
  e.toe_s = e.toc_s = gps::second_of_week(toe);
  e.mean_anomaly_rad = wrapped(base.mean_anomaly_rad + mean_motion(base) * dt_s);
  // The node is counted from Greenwich at the start of the week, which has turned since base's.
  const double weeks_s = to_seconds((e.week - base.week) * gps::kWeek);
  e.raan0_rad =
      wrapped(base.raan0_rad + base.raan_rate_radps * dt_s - gps::kOmegaEarth_radps * weeks_s);
  e.af0_s = base.af0_s + base.af1_sps * dt_s;
  return e;
}

/// An almanac entry, in the week that it is taken to be of, as the truth at `toe`. First carried
/// there as it is, then rounded: at `toe` the satellite stands where the almanac puts it.
BroadcastEphemeris as_ephemeris(const GpsAlmanacEntry& entry, int week, SimTime toe) {
  BroadcastEphemeris e;
  e.prn = entry.prn;
  e.week = week;
  e.toe_s = e.toc_s = entry.toa_s;
  e.sqrt_a_sqrtm = entry.sqrt_a_sqrtm;
  e.raan0_rad = entry.raan0_rad;
  e.raan_rate_radps = entry.raan_rate_radps;
  e.mean_anomaly_rad = entry.mean_anomaly_rad;
  e = carried_on(e, toe);
  e.sqrt_a_sqrtm = rounded(entry.sqrt_a_sqrtm, 0x1p-19);
  e.eccentricity = rounded(entry.eccentricity, 0x1p-33);
  e.i0_rad = rounded(entry.inclination_rad, kStepAngle_rad);
  e.argument_of_perigee_rad = rounded(wrapped(entry.argument_of_perigee_rad), kStepAngle_rad);
  e.mean_anomaly_rad = rounded(e.mean_anomaly_rad, kStepAngle_rad);
  e.raan0_rad = rounded(e.raan0_rad, kStepAngle_rad);
  e.raan_rate_radps = rounded(entry.raan_rate_radps, kStepNodeRate_radps);
  e.delta_n_radps = aligned_delta_n(mean_motion(e));
  // The clock reads at the epoch what the almanac gives at toa: years of drift would leave af0's
  // field.
  e.af0_s = rounded(entry.af0_s, 0x1p-31);
  e.af1_sps = rounded(entry.af1_sps, kStepAf1_sps);
  e.health = six_bit_health(entry.health);
  return e;
}

int almanac_week(const GpsAlmanacEntry& entry, int epoch_week, bool shift) {
  if (shift) return epoch_week;
  const int behind = (epoch_week - entry.week) % 1024;
  return epoch_week - (behind > 512 ? behind - 1024 : behind < -512 ? behind + 1024 : behind);
}

/// Moves a state by a vector that is constant in RTN; RTN turns with h/r^2. The node's precession,
/// 8e-9 rad/s, is left out of the derivatives: 1e-8 m/s for a metre, and 1e-6 m between knots.
void move(SatelliteState& s, const Vec3& d_RTN) {
  const Vec3 omega_E{0, 0, gps::kOmegaEarth_radps};
  const Vec3 h = cross(s.r_ECEF, s.v_ECEF + cross(omega_E, s.r_ECEF));
  const Vec3 R = unit(s.r_ECEF), N = unit(h), T = cross(N, R);
  const Vec3 d = d_RTN.x * R + d_RTN.y * T + d_RTN.z * N;
  const double r2 = dot(s.r_ECEF, s.r_ECEF);
  const Vec3 omega_orbit = h / r2, omega = omega_orbit - omega_E;
  // In ECEF the plane of the orbit turns back with the Earth; h/r^2 changes with r.
  const Vec3 omega_rate =
      cross(omega_orbit, omega_E) - 2 * dot(s.r_ECEF, s.v_ECEF) / r2 * omega_orbit;
  const Vec3 d_rate = cross(omega, d);
  s.r_ECEF += d;
  s.v_ECEF += d_rate;
  s.a_ECEF += cross(omega, d_rate) + cross(omega_rate, d);
}

/// From a to b as w goes from 0 to 1 in `span_s`: 6w^5 - 15w^4 + 10w^3.
SatelliteState blended(const SatelliteState& a, const SatelliteState& b, double w, double span_s) {
  const double s = w * w * w * (10 + w * (-15 + 6 * w));
  const double d = 30 * w * w * (1 - w) * (1 - w) / span_s;
  const double dd = 60 * w * (1 - w) * (1 - 2 * w) / (span_s * span_s);
  const auto mixed = [=](auto& x, const auto& xa, const auto& xb) { x = xa + s * (xb - xa); };
  const Vec3 dr = b.r_ECEF - a.r_ECEF, dv = b.v_ECEF - a.v_ECEF;
  const double dc = b.clock_s - a.clock_s, dc_rate = b.clock_rate_sps - a.clock_rate_sps;
  SatelliteState out;
  mixed(out.r_ECEF, a.r_ECEF, b.r_ECEF);
  mixed(out.v_ECEF, a.v_ECEF, b.v_ECEF);
  mixed(out.a_ECEF, a.a_ECEF, b.a_ECEF);
  mixed(out.clock_s, a.clock_s, b.clock_s);
  mixed(out.clock_rate_sps, a.clock_rate_sps, b.clock_rate_sps);
  mixed(out.clock_acceleration_sps2, a.clock_acceleration_sps2, b.clock_acceleration_sps2);
  out.v_ECEF += d * dr;
  out.a_ECEF += dd * dr + 2 * d * dv;
  out.clock_rate_sps += d * dc;
  out.clock_acceleration_sps2 += dd * dc + 2 * d * dc_rate;
  return out;
}

std::int64_t interval_index(SimTime t) {
  const std::int64_t ns = to_ns(t), h = to_ns(kKnots);
  return ns >= 0 ? ns / h : -((-ns + h - 1) / h);
}

void check_prn(int prn) {
  if (prn >= 1 && prn <= gps::kSatellites) return;
  throw std::invalid_argument("GpsConstellation: prn = " + std::to_string(prn) +
                              "; accepted: 1 to 32");
}

}  // namespace

GpsConstellation::GpsConstellation(const GpsConstellationOptions& options, SimTime epoch,
                                   RandomStreams& streams)
    : interpolate_(options.interpolate) {
  if (!(options.sigma_orbit_m >= 0 && options.sigma_orbit_m <= 1000)) {
    throw std::invalid_argument("GpsConstellation: sigma_orbit_m = " +
                                to_text(options.sigma_orbit_m) + "; accepted: 0 to 1000");
  }
  if (!options.ephemerides.empty()) {
    add_from_file(options.ephemerides);
  } else {
    add_from_almanac(options.almanac.empty() ? carried_almanac() : options.almanac, epoch,
                     options.shift_almanac_to_epoch);
  }
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    if ((satellites_ >> (prn - 1) & 1u) == 0) continue;
    RandomStream& stream = streams.stream("gps", "orbit perturbation", label(prn));
    Vec3& d = vehicle(prn).perturbation_RTN;
    d.x = stream.normal(0, options.sigma_orbit_m);
    d.y = stream.normal(0, options.sigma_orbit_m);
    d.z = stream.normal(0, options.sigma_orbit_m);
  }
}

void GpsConstellation::add_from_almanac(const GpsAlmanac& almanac, SimTime epoch, bool shift) {
  const SimTime toe(epoch.time_since_epoch() / kIssue * kIssue);
  for (const GpsAlmanacEntry& entry : almanac) {
    check_prn(entry.prn);
    Vehicle& v = vehicle(entry.prn);
    v.from_almanac = true;
    v.base = as_ephemeris(entry, almanac_week(entry, gps::week_of(epoch), shift), toe);
    v.health = v.base.health;
    (void)lnav::quantised(v.base);  // refuses now what the message could not carry later
    satellites_ |= 1u << (entry.prn - 1);
  }
}

void GpsConstellation::add_from_file(const std::vector<BroadcastEphemeris>& ephemerides) {
  for (const BroadcastEphemeris& e : ephemerides) {
    check_prn(e.prn);
    vehicle(e.prn).issues.push_back(e);
    satellites_ |= 1u << (e.prn - 1);
  }
  for (Vehicle& v : vehicles_) {
    const auto earlier = [](const BroadcastEphemeris& a, const BroadcastEphemeris& b) {
      return time_of_ephemeris(a) < time_of_ephemeris(b);
    };
    std::stable_sort(v.issues.begin(), v.issues.end(), earlier);
    // Of several uploads for one toe the first holds: files are merged from many stations.
    const auto same_toe = [](const BroadcastEphemeris& a, const BroadcastEphemeris& b) {
      return time_of_ephemeris(a) == time_of_ephemeris(b);
    };
    v.issues.erase(std::unique(v.issues.begin(), v.issues.end(), same_toe), v.issues.end());
    if (v.issues.empty()) continue;
    group_delays_s_[static_cast<std::size_t>(v.issues.front().prn - 1)] = v.issues.front().tgd_s;
  }
}

const GpsConstellation::Vehicle& GpsConstellation::vehicle(int prn) const {
  check_prn(prn);
  return vehicles_[static_cast<std::size_t>(prn - 1)];
}

std::optional<SatelliteState> GpsConstellation::unperturbed(const Vehicle& v, SimTime t) const {
  if (v.from_almanac) return broadcast_state(v.base, t);
  const auto after = std::find_if(v.issues.begin(), v.issues.end(),
                                  [t](const auto& e) { return time_of_ephemeris(e) > t; });
  const bool has_next = after != v.issues.end() && time_of_ephemeris(*after) - t <= kIssue;
  const bool has_last =
      after != v.issues.begin() && t - time_of_ephemeris(*std::prev(after)) <= kIssue;
  if (!has_last && !has_next) return {};
  if (!has_next) return broadcast_state(*std::prev(after), t);
  if (!has_last) return broadcast_state(*after, t);
  const SimTime begin = time_of_ephemeris(*std::prev(after));
  const double span_s = to_seconds(time_of_ephemeris(*after) - begin);
  return blended(broadcast_state(*std::prev(after), t), broadcast_state(*after, t),
                 to_seconds(t - begin) / span_s, span_s);
}

std::optional<SatelliteState> GpsConstellation::exact(int prn, SimTime t) const {
  const Vehicle& v = vehicle(prn);
  if ((satellites_ >> (prn - 1) & 1u) == 0) return {};
  std::optional<SatelliteState> state = unperturbed(v, t);
  if (state) move(*state, v.perturbation_RTN);
  return state;
}

bool GpsConstellation::silent(int prn, SimTime t) const {
  return std::any_of(outages_.begin(), outages_.end(),
                     [=](const Window& w) { return w.prn == prn && t >= w.from && t < w.until; });
}

const GpsSnapshot& GpsConstellation::at(SimTime t) {
  if (has_snapshot_ && snapshot_.t == t) return snapshot_;
  snapshot_.t = t;
  has_snapshot_ = true;
  if (interpolate_) {
    const std::int64_t index = interval_index(t);
    if (index != interval_) make_interval(index);
    const double s = to_seconds(t - from_ns(index * to_ns(kKnots))) / kKnots_s;
    snapshot_.transmitting = interval_valid_;
    for (std::size_t i = 0; i < vehicles_.size(); ++i) {
      if ((interval_valid_ >> i & 1u) != 0) {
        snapshot_.satellites[i] = evaluate(polynomials_[i], s);
      }
    }
  } else {
    snapshot_.transmitting = 0;
    for (int prn = 1; prn <= gps::kSatellites; ++prn) {
      const std::optional<SatelliteState> state = exact(prn, t);
      if (!state) continue;
      snapshot_.satellites[static_cast<std::size_t>(prn - 1)] = *state;
      snapshot_.transmitting |= 1u << (prn - 1);
    }
  }
  for (const Window& w : outages_) {
    if (silent(w.prn, t)) snapshot_.transmitting &= ~(1u << (w.prn - 1));
  }
  return snapshot_;
}

void GpsConstellation::fill_knots(std::int64_t index,
                                  std::array<SatelliteState, gps::kSatellites>& knots,
                                  std::uint32_t& valid) const {
  valid = 0;
  const SimTime t = from_ns(index * to_ns(kKnots));
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    const std::optional<SatelliteState> state = exact(prn, t);
    if (!state) continue;
    knots[static_cast<std::size_t>(prn - 1)] = *state;
    valid |= 1u << (prn - 1);
  }
}

void GpsConstellation::make_interval(std::int64_t index) {
  std::array<SatelliteState, gps::kSatellites> left;
  std::uint32_t left_valid = 0;
  const bool first = interval_ == INT64_MIN;
  if (!first && index == interval_ + 1) {
    left = right_knots_;
    left_valid = right_valid_;
  } else {
    fill_knots(index, left, left_valid);
  }
  fill_knots(index + 1, right_knots_, right_valid_);
  interval_ = index;
  interval_valid_ = left_valid & right_valid_;
  const double h = kKnots_s;
  for (std::size_t i = 0; i < vehicles_.size(); ++i) {
    if ((interval_valid_ >> i & 1u) == 0) continue;
    const SatelliteState &a = left[i], &b = right_knots_[i];
    Polynomial& p = polynomials_[i];
    const auto channel = [&p, h](int k, double xa, double va, double aa, double xb, double vb,
                                 double ab) {
      const double d = xb - xa - h * va - 0.5 * h * h * aa;
      const double dv = h * (vb - va - h * aa), da = h * h * (ab - aa);
      p.c[0][k] = xa, p.c[1][k] = h * va, p.c[2][k] = 0.5 * h * h * aa;
      p.c[3][k] = 10 * d - 4 * dv + 0.5 * da;
      p.c[4][k] = -15 * d + 7 * dv - da;
      p.c[5][k] = 6 * d - 3 * dv + 0.5 * da;
    };
    for (int k = 0; k < 3; ++k) {
      channel(k, a.r_ECEF[k], a.v_ECEF[k], a.a_ECEF[k], b.r_ECEF[k], b.v_ECEF[k], b.a_ECEF[k]);
    }
    channel(3, a.clock_s, a.clock_rate_sps, a.clock_acceleration_sps2, b.clock_s, b.clock_rate_sps,
            b.clock_acceleration_sps2);
    // All of them once, then one after another: the orbits do not change their character.
    if (first || static_cast<std::int64_t>(i) == (index & 31))
      guard(static_cast<int>(i) + 1, index);
  }
}

void GpsConstellation::guard(int prn, std::int64_t index) const {
  const SimTime middle = from_ns(index * to_ns(kKnots)) + kKnots / 2;
  const std::optional<SatelliteState> truth = exact(prn, middle);
  if (!truth) return;
  const SatelliteState got = evaluate(polynomials_[static_cast<std::size_t>(prn - 1)], 0.5);
  const double error_m = norm(got.r_ECEF - truth->r_ECEF);
  if (error_m <= kGuard_m) return;
  throw std::logic_error("GpsConstellation: orbit of " + label(prn) + " interpolated at " +
                         to_string(middle) + " is " + to_text(error_m) +
                         " m off; accepted: " + to_text(kGuard_m) + " m; set interpolate = false");
}

SatelliteState GpsConstellation::evaluate(const Polynomial& p, double s) {
  constexpr double kPer = 1 / kKnots_s, kPer2 = kPer * kPer;
  double x[4], d[4], dd[4];
  for (int k = 0; k < 4; ++k) {
    const double c1 = p.c[1][k], c2 = p.c[2][k], c3 = p.c[3][k], c4 = p.c[4][k], c5 = p.c[5][k];
    x[k] = p.c[0][k] + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))));
    d[k] = (c1 + s * (2 * c2 + s * (3 * c3 + s * (4 * c4 + s * (5 * c5))))) * kPer;
    dd[k] = (2 * c2 + s * (6 * c3 + s * (12 * c4 + s * (20 * c5)))) * kPer2;
  }
  return {{x[0], x[1], x[2]}, {d[0], d[1], d[2]}, {dd[0], dd[1], dd[2]}, x[3], d[3], dd[3]};
}

const BroadcastEphemeris* GpsConstellation::broadcast(int prn, SimTime t) {
  check_prn(prn);
  if ((satellites_ >> (prn - 1) & 1u) == 0 || silent(prn, t)) return nullptr;
  Vehicle& v = vehicle(prn);
  if (v.from_almanac) {
    const std::int64_t issue = t.time_since_epoch() / kIssue;
    Issue& kept = v.kept[static_cast<std::size_t>(issue & 1)];
    if (kept.number != issue) {
      const SimTime from(issue * kIssue);
      BroadcastEphemeris e = carried_on(v.base, from + kIssue);
      e.iodc = static_cast<int>(issue % 1024);
      e.iode = e.iodc % 256;
      e.health = v.health;
      for (const Window& w : healths_) {
        if (w.prn == prn && from >= w.from && from < w.until) e.health = w.health;
      }
      kept = {issue, lnav::quantised(e)};
    }
    return &kept.data;
  }
  // As the satellites do it: the issue whose toe comes next, and the last one if there is none.
  const BroadcastEphemeris* last = nullptr;
  for (const BroadcastEphemeris& e : v.issues) {
    const Duration ahead = time_of_ephemeris(e) - t;
    if (ahead > 0ns && ahead <= kIssue) return &e;
    if (ahead <= 0ns && ahead >= -kIssue) last = &e;
  }
  return last;
}

void GpsConstellation::add_outage(int prn, SimTime from, SimTime until) {
  check_prn(prn);
  outages_.push_back({prn, 0, from, until});
  has_snapshot_ = false;
}

void GpsConstellation::add_health(int prn, int health, SimTime from, SimTime until) {
  check_prn(prn);
  if (health < 0 || health > 63) {
    throw std::invalid_argument("GpsConstellation: health = " + std::to_string(health) +
                                "; accepted: 0 to 63");
  }
  healths_.push_back({prn, health, from, until});
  vehicle(prn).kept = {};
}

GpsAlmanac GpsConstellation::almanac(SimTime t) const {
  GpsAlmanac out;
  for (int prn = 1; prn <= gps::kSatellites; ++prn) {
    const Vehicle& v = vehicle(prn);
    if ((satellites_ >> (prn - 1) & 1u) == 0) continue;
    const BroadcastEphemeris e =
        v.from_almanac ? carried_on(v.base, SimTime(t.time_since_epoch() / kIssue * kIssue))
                       : v.issues.front();
    out.push_back({.prn = prn,
                   .week = e.week,
                   .health = e.health,
                   .toa_s = e.toe_s,
                   .eccentricity = e.eccentricity,
                   .inclination_rad = e.i0_rad,
                   .raan_rate_radps = e.raan_rate_radps,
                   .sqrt_a_sqrtm = e.sqrt_a_sqrtm,
                   .raan0_rad = e.raan0_rad,
                   .argument_of_perigee_rad = e.argument_of_perigee_rad,
                   .mean_anomaly_rad = e.mean_anomaly_rad,
                   .af0_s = e.af0_s,
                   .af1_sps = e.af1_sps});
  }
  return out;
}

}  // namespace orrery
