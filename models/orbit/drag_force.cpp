#include <orrery/models/frames/earth_orientation.hpp>
#include <orrery/models/orbit/drag_force.hpp>
#include <orrery/models/orbit/earth.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace orrery {
namespace {

void require_not_negative(const char* name, double value) {
  if (value >= 0 && std::isfinite(value)) return;
  throw std::invalid_argument(std::string("DragForce: ") + name + " = " + std::to_string(value) +
                              "; accepted: 0 or more");
}

// Height above an ellipsoid of the Earth's flattening, to first order in it. Anything smooth would
// do: it is subtracted at the knots and added at the place.
double height_m(const Vec3& r_ECI) {
  constexpr double kFlattening = 1 / 298.257;
  const double r2 = dot(r_ECI, r_ECI);
  return std::sqrt(r2) - kRadiusEarth_m * (1 - kFlattening * (r_ECI.z * r_ECI.z / r2));
}

Vec3 oblate_gravity(const Vec3& r, const Vec3& pole) {
  const double r2 = dot(r, r), z = dot(r, pole);
  const double point = kMuEarth_m3ps2 / (r2 * std::sqrt(r2));
  const double j = 1.5 * kJ2Earth * (kRadiusEarth_m * kRadiusEarth_m / r2);
  return -point * ((1 + j * (1 - 5 * z * z / r2)) * r + (2 * j * z) * pole);
}

// Position after dt_s in the field up to J2: RK4 in steps of up to 30 s, each within 2 mm.
Vec3 predicted(const OrbitState& state, const Vec3& pole, double dt_s) {
  const int steps = 1 + static_cast<int>(std::abs(dt_s) / 30);
  const double h = dt_s / steps;
  Vec3 r = state.r_ECI, v = state.v_ECI;
  for (int i = 0; i < steps; ++i) {
    const Vec3 a1 = oblate_gravity(r, pole);
    const Vec3 a2 = oblate_gravity(r + (h / 2) * v, pole);
    const Vec3 a3 = oblate_gravity(r + (h / 2) * v + (h * h / 4) * a1, pole);
    const Vec3 a4 = oblate_gravity(r + h * v + (h * h / 2) * a2, pole);
    r += h * v + (h * h / 6) * (a1 + a2 + a3);
    v += (h / 6) * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return r;
}

// ForceMemory as this force uses it: the knots' instants and values, the coefficients of Newton's
// form of the cubic through them, the scale height.
constexpr int kValue = 0, kNewton = 4, kScaleHeight = 8;

void fit(ForceMemory& memory) {
  std::array<double, 4> d{};
  for (int i = 0; i < 4; ++i) d[i] = memory.numbers[kValue + i];
  for (int order = 1; order < 4; ++order) {
    for (int i = 3; i >= order; --i) {
      const double span_s = to_seconds(memory.instants[i] - memory.instants[i - order]);
      d[i] = (d[i] - d[i - 1]) / span_s;
    }
  }
  for (int i = 0; i < 4; ++i) memory.numbers[kNewton + i] = d[i];
}

double interpolated(const ForceMemory& memory, SimTime t) {
  const auto since = [&](int i) { return to_seconds(t - memory.instants[i]); };
  const double* c = &memory.numbers[kNewton];
  return c[0] + since(0) * (c[1] + since(1) * (c[2] + since(2) * c[3]));
}

}  // namespace

DragForce::DragForce(std::shared_ptr<const AtmosphereModel> atmosphere, DragForceOptions options)
    : atmosphere_(std::move(atmosphere)), options_(std::move(options)) {
  if (atmosphere_ == nullptr) throw std::invalid_argument("DragForce: no atmosphere given");
  require_not_negative("area_m2", options_.area_m2);
  require_not_negative("drag_coefficient", options_.drag_coefficient);
  if (options_.knot_spacing <= Duration::zero()) {
    throw std::invalid_argument("DragForce: knot_spacing = " + to_string(options_.knot_spacing) +
                                "; accepted: above 0");
  }
}

Vec3 DragForce::drag_ECI(const OrbitState& state, const Surroundings& around,
                         double density_kgpm3) const {
  const Mat3 R_IE = transpose(around.R_EI);
  Vec3 v_air_ECI = cross(R_IE * around.omega_EI_ECEF, state.r_ECI);
  if (options_.wind_ECEF) {
    v_air_ECI += R_IE * options_.wind_ECEF(state.t, around.R_EI * state.r_ECI);
  }
  const Vec3 v_rel_ECI = state.v_ECI - v_air_ECI;
  const double per_mass_m2pkg = options_.drag_coefficient * options_.area_m2 / state.mass_kg;
  return -0.5 * density_kgpm3 * per_mass_m2pkg * norm(v_rel_ECI) * v_rel_ECI;
}

Vec3 DragForce::acceleration_ECI(const OrbitState& state, const Surroundings& around) const {
  return drag_ECI(state, around, atmosphere_->density_kgpm3(state.t, around.R_EI * state.r_ECI));
}

Vec3 DragForce::acceleration_ECI(const OrbitState& state, const Surroundings& around,
                                 const ForceMemory& memory) const {
  return drag_ECI(state, around, density_kgpm3(state, around, memory));
}

double DragForce::density_kgpm3(const OrbitState& state, const Surroundings& around,
                                const ForceMemory& memory) const {
  const bool has_knots = memory.numbers[kScaleHeight] != 0;
  if (!has_knots || state.t < memory.instants[0] || state.t > memory.instants[3]) {
    return atmosphere_->density_kgpm3(state.t, around.R_EI * state.r_ECI);
  }
  return std::exp(interpolated(memory, state.t) -
                  height_m(state.r_ECI) / memory.numbers[kScaleHeight]);
}

double DragForce::scale_height_m(const OrbitState& state, const Surroundings& around) const {
  constexpr double kBelow_m = 1000;
  const Vec3 r_ECEF = around.R_EI * state.r_ECI;
  const Vec3 below_ECEF = (1 - kBelow_m / norm(r_ECEF)) * r_ECEF;
  return kBelow_m / std::log(atmosphere_->density_kgpm3(state.t, below_ECEF) /
                             atmosphere_->density_kgpm3(state.t, r_ECEF));
}

double DragForce::knot(SimTime t, const OrbitState& state, const Surroundings& around,
                       double scale_height_m) const {
  const double dt_s = to_seconds(t - state.t);
  const Vec3 r_ECI = predicted(state, around.R_EI.row_z, dt_s);
  // The Earth turns about its axis meanwhile; precession of a minute is 1e-10 rad.
  const Vec3 r_ECEF = rotation_about_z(around.omega_EI_ECEF.z * dt_s) * (around.R_EI * r_ECI);
  return std::log(atmosphere_->density_kgpm3(t, r_ECEF)) + height_m(r_ECI) / scale_height_m;
}

// The last instant before the density jumps.
SimTime DragForce::last_instant(SimTime t) const {
  const std::optional<SimTime> jump = atmosphere_->next_discontinuity(t);
  return jump ? *jump - 1ns : SimTime::max();
}

ForceMemory DragForce::begin(const OrbitState& state, const Surroundings& around) const {
  ForceMemory memory;
  memory.instants.fill(state.t);
  if (!options_.interpolate_density) return memory;
  const Duration room = last_instant(state.t) - state.t;
  const Duration spacing = std::min(options_.knot_spacing, room / 3);
  if (spacing < 1ms) return memory;  // the atmosphere itself is asked until the jump
  const double H = memory.numbers[kScaleHeight] = scale_height_m(state, around);
  for (int i = 0; i < 4; ++i) {
    memory.instants[i] = state.t + i * spacing;
    memory.numbers[kValue + i] = knot(memory.instants[i], state, around, H);
  }
  fit(memory);
  return memory;
}

ForceMemory DragForce::next(const ForceMemory& memory, const OrbitState& state,
                            const Surroundings& around) const {
  if (!options_.interpolate_density) return memory;
  if (state.t > memory.instants[3]) return begin(state, around);
  if (state.t < memory.instants[2]) return memory;
  const SimTime newest = memory.instants[3], last = last_instant(newest);
  if (newest >= last) return memory;  // no further knot before the jump
  const bool is_last = last - newest < options_.knot_spacing * 3 / 2;
  ForceMemory moved = memory;
  for (int i = 0; i < 3; ++i) {
    moved.instants[i] = memory.instants[i + 1];
    moved.numbers[kValue + i] = memory.numbers[kValue + i + 1];
  }
  moved.instants[3] = is_last ? last : newest + options_.knot_spacing;
  moved.numbers[kValue + 3] = knot(moved.instants[3], state, around, memory.numbers[kScaleHeight]);
  fit(moved);
  return moved;
}

}  // namespace orrery
