/// The atmosphere of NRLMSISE-00 around the WGS 84 ellipsoid, under a given space weather.
#pragma once

#include <orrery/models/atmosphere/atmosphere_model.hpp>
#include <orrery/models/atmosphere/space_weather.hpp>

namespace orrery {

struct Nrlmsise00AtmosphereOptions {
  SpaceWeather weather = SpaceWeather::constant({});  // F10.7 = F10.7A = 150 sfu, Ap = 15
  bool three_hourly_ap = true;  // use the history of ap where `weather` has one, else the daily Ap
};

/// Density for drag: with anomalous oxygen (gtd7d).
///
/// Arguments  Day of the year and seconds of UTC (for UT1: within 0.9 s, 1e-5 of the density);
/// geodetic
///            place on WGS 84; local time = UTC + longitude / 15, without the equation of time. The
///            day is a whole number, as in the published model, so that density steps by up to 1 %
///            at midnight UTC: next_discontinuity() says when. Angles are handed over so that a
///            turn is a turn: the published model's rounded rates make steps of up to 1e-5 at local
///            midnight and at the date line.
/// Valid for  heights of 0 to 1000 km, and instants that `weather` covers.
class Nrlmsise00Atmosphere final : public AtmosphereModel {
 public:
  explicit Nrlmsise00Atmosphere(Nrlmsise00AtmosphereOptions options = {});

  /// @throws std::domain_error  height outside 0 to 1000 km, position not finite.
  /// @throws std::out_of_range  instant outside the space weather.
  double density_kgpm3(SimTime t, const Vec3& r_ECEF) const override {
    return evaluate(t, r_ECEF).drag_density_kgpm3;
  }
  std::optional<SimTime> next_discontinuity(SimTime t) const override;

  /// All that the model gives there, and what it was asked.
  Nrlmsise00Output evaluate(SimTime t, const Vec3& r_ECEF) const {
    return evaluate_nrlmsise00(arguments(t, r_ECEF));
  }
  Nrlmsise00Input arguments(SimTime t, const Vec3& r_ECEF) const;

 private:
  Nrlmsise00AtmosphereOptions options_;
};

}  // namespace orrery
