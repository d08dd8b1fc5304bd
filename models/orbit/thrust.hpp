/// Finite burns: a thrust that is constant between valve edges, what turns it with the body, and
/// what it has delivered.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/frames/frames.hpp>

#include <optional>

namespace orrery {

constexpr double kStandardGravity_mps2 = 9.80665;  // exact: 3rd CGPM, 1901; in m' = -F / (g0 Isp)

/// All nozzles together, from one valve edge to the next. Force and flow are constants, so the mass
/// falls linearly and the acceleration is force / mass(t).
struct Thrust {
  Vec3 force_B;               // body-fixed part [N]: follows the attitude during the burn
  Vec3 force_ECI;             // inertially fixed part [N]
  double mass_flow_kgps = 0;  // propellant leaving, not negative
  double nozzle_N = 0;        // sum of the magnitudes over the nozzles; for the account alone

  /// Of one nozzle. @param isp_s  Specific impulse, above 0.
  static Thrust body_fixed(const Vec3& force_B, double isp_s);
  static Thrust inertial(const Vec3& force_ECI, double isp_s);

  bool is_off() const { return *this == Thrust{}; }
  friend bool operator==(const Thrust&, const Thrust&) = default;
  friend Thrust operator+(const Thrust& a, const Thrust& b);
};

/// The attitude as a function of the instant and of the orbit. Pure: same arguments, same bits.
class AttitudeLaw {
 public:
  virtual ~AttitudeLaw() = default;
  /// f_B = R_BI f_ECI.
  virtual Mat3 R_BI(SimTime t, const InertialState& state) const = 0;
  /// The first instant after `t` at which a derivative of the attitude jumps: a burn's step ends
  /// there.
  virtual std::optional<SimTime> next_discontinuity(SimTime t) const {
    (void)t;
    return {};
  }
};

/// What thrusters and impulses have delivered.
struct Propulsion {
  double delta_v_mps = 0;  // sum over firings of |vector impulse over mass|
  double impulse_Ns = 0;   // of the nozzles, sum over them of force times time
};

/// Adds up Propulsion, in closed form: over an arc at constant force and flow the vector integral
/// of F/m is F ln(m0/m1) / flow.
///
/// Firing  From a thrust other than zero to the next zero. Its vector impulse is taken in the axes
///         in which the force is fixed, so that nozzles of one firing that burn one after the other
///         count as one vector; those that oppose each other cancel in delta_v_mps, not in
///         impulse_Ns.
class PropulsionAccount {
 public:
  /// From `t` on, at mass `mass_kg`.
  void thrust(SimTime t, const Thrust& thrust, double mass_kg);
  void impulse(double dv_mps, double mass_kg);
  /// @param t  Not before the last edge.
  Propulsion at(SimTime t) const;

 private:
  struct Firing {
    Vec3 dv_B, dv_ECI;  // [m/s]
  };
  Firing firing_until(SimTime t) const;

  Propulsion closed_;  // impulses, firings that ended, and the nozzles' impulse up to begin_
  Firing firing_;      // up to begin_
  Thrust thrust_;      // since begin_
  SimTime begin_;
  double mass_kg_ = 0;  // at begin_
};

}  // namespace orrery
