// FormationFilter: looking at satellites, arcs, GRAPHIC.
#include <cmath>

#include "formation_gnc/navigation/filter_parts.hpp"

namespace formation_gnc {
namespace {

constexpr int kBadGraphicToRestart = 3;

}  // namespace

AntennaState FormationFilter::antenna(int who, const Quaternion& q_BI) const {
  AntennaState a;
  a.r_ECI = orbits_.r[who] + transpose(rotation_of(q_BI)) * options_.lever_arm_B;
  a.v_ECI = orbits_.v[who];
  a.clock_m = clock_m_[who];
  return a;
}

void FormationFilter::look(int who, const GnssEpoch& epoch, const Quaternion& q_BI,
                           const SatelliteTable& satellites, Sight* sight) const {
  const AntennaState a = antenna(who, q_BI);
  sight->count = 0;
  for (int k = 0; k < epoch.count; ++k) {
    if (!is_plausible(epoch.observation[k])) continue;
    const SatelliteState* satellite = satellites.find(epoch.observation[k].prn);
    if (satellite == nullptr) continue;
    sight->observation[sight->count] = &epoch.observation[k];
    sight->predicted[sight->count++] = predict(a, *satellite);
  }
}

// From the codes, so that a clock may do what it likes from epoch to epoch.
void FormationFilter::start_clock(int who, Sight* sight) {
  double residual_m[kChannels];
  for (int k = 0; k < sight->count; ++k) {
    residual_m[k] = sight->observation[k]->code_m - sight->predicted[k].range_m;
  }
  const double change_m = median(residual_m, sight->count);
  clock_m_[who] += change_m;
  for (int k = 0; k < sight->count; ++k) {
    sight->predicted[k].range_m += sight->predicted[k].clock_factor * change_m;
  }
}

void FormationFilter::start_ambiguity(int who, int channel, const Observation& o) {
  CarrierArc& arc = arcs_[who][channel];
  if (arc.prn != 0) release(arc.prn);
  arc = CarrierArc();
  arc.prn = o.prn;
  arc.half_cycle = o.half_cycle;
  arc.begin_ns = arc.walked_ns = t_ns_;
  const double difference = o.phase_cycles - o.code_m / kWavelength_m;
  arc.base_cycles = std::nearbyint(difference);
  arc.ambiguity_cycles = difference - arc.base_cycles;
  arc.lock_s = o.lock_s;
  arc.last_ns = t_ns_;
  release(o.prn);
  const double sigma =
      std::hypot(options_.ambiguity_sigma_cycles,
                 2.0 * code_sigma_m(static_cast<double>(o.cn0_dBHz)) / kWavelength_m);
  const int state = first_ambiguity(who) + channel;
  ud_.forget(state, sigma * sigma);
  correction_[state] = 0.0;
}

void FormationFilter::track_arcs(int who, const Sight& sight) {
  CarrierArcs& arcs = arcs_[who];
  for (int k = 0; k < sight.count; ++k) {
    const Observation& o = *sight.observation[k];
    const int channel = arcs.channel_for(o.prn);
    const bool same = arcs[channel].prn == o.prn && arcs.continues(channel, o, t_ns_);
    if (!same) start_ambiguity(who, channel, o);
    arcs[channel].lock_s = o.lock_s;
    arcs[channel].last_ns = t_ns_;
  }
}

bool FormationFilter::take(const SparseRow& h, double r, double innovation, UpdateReport* report) {
  const Projection projection = ud_.project(h);
  const double s = projection.variance + r;
  double nu = innovation;
  for (int k = 0; k < h.count; ++k) nu -= h.value[k] * correction_[h.state[k]];
  // Written so that a NaN is rejected.
  if (!(nu * nu <= options_.gate * options_.gate * s)) {
    ++report->rejected;
    return false;
  }
  double gain[kStates];
  ud_.measure(projection, r, gain);
  for (int k = 0; k < kStates; ++k) correction_[k] += nu * gain[k];
  ++report->used;
  ++report->degrees;
  report->chi2 += nu * nu / s;
  return true;
}

void FormationFilter::settle() {
  clock_m_[kSelf] += correction_[kClockSelf];
  clock_m_[kOther] += correction_[kClockSelf] + correction_[kClockDifference];
  for (int k = 0; k < 3; ++k) {
    const double r = correction_[kPositionSelf + k], v = correction_[kVelocitySelf + k];
    const double a = correction_[kAccelerationSelf + k];
    orbits_.r[kSelf][k] += r;
    orbits_.v[kSelf][k] += v;
    orbits_.empirical_RTN[kSelf][k] += a;
    orbits_.r[kOther][k] += r + correction_[kPositionDifference + k];
    orbits_.v[kOther][k] += v + correction_[kVelocityDifference + k];
    orbits_.empirical_RTN[kOther][k] += a + correction_[kAccelerationDifference + k];
  }
  for (int channel = 0; channel < kChannels; ++channel) {
    arcs_[kSelf][channel].ambiguity_cycles += correction_[kAmbiguitySelf + channel];
    arcs_[kOther][channel].ambiguity_cycles += correction_[kAmbiguityOther + channel];
  }
  for (double& c : correction_) c = 0.0;
}

UpdateReport FormationFilter::graphic_update(Who which, const GnssEpoch& epoch,
                                             const Quaternion& q_BI,
                                             const SatelliteTable& satellites) {
  UpdateReport report;
  const int who = static_cast<int>(which);
  Sight sight;
  look(who, epoch, q_BI, satellites, &sight);
  if (sight.count == 0) return report;
  start_clock(who, &sight);
  track_arcs(who, sight);
  for (int k = 0; k < sight.count; ++k) {
    const Observation& o = *sight.observation[k];
    const Predicted& p = sight.predicted[k];
    const int channel = arcs_[who].find(o.prn);
    const CarrierArc& arc = arcs_[who][channel];
    SparseRow h;
    h.add(kClockSelf, p.clock_factor);
    if (who == kOther) h.add(kClockDifference, p.clock_factor);
    for (int axis = 0; axis < 3; ++axis) h.add(kPositionSelf + axis, -p.line_of_sight[axis]);
    for (int axis = 0; axis < 3 && who == kOther; ++axis) {
      h.add(kPositionDifference + axis, -p.line_of_sight[axis]);
    }
    h.add(first_ambiguity(who) + channel, 0.5 * kWavelength_m);
    const double measured_m = 0.5 * (o.code_m + phase_m(arc, o));
    const double predicted_m = p.range_m + 0.5 * kWavelength_m * arc.ambiguity_cycles;
    const double r =
        square(0.5 * code_sigma_m(static_cast<double>(o.cn0_dBHz))) + square(options_.code_floor_m);
    const bool used = take(h, r, measured_m - predicted_m, &report);
    if (used && arc.begin_ns == t_ns_) --report.degrees;
  }
  report.degrees = report.degrees > 1 ? report.degrees - 1 : 0;
  settle();
  judge_graphic(who, report);
  return report;
}

// Codes do not lie by many sigmas in most channels: then it is the orbit.
void FormationFilter::judge_graphic(int who, const UpdateReport& report) {
  bad_graphic_[who] =
      most_rejected(report) ? static_cast<std::uint8_t>(bad_graphic_[who] + 1) : std::uint8_t{0};
  if (bad_graphic_[who] < kBadGraphicToRestart) return;
  bad_graphic_[who] = 0;
  if (who == kSelf) lost_ = true;
  if (who == kOther) other_started_ = false;
}

}  // namespace formation_gnc
