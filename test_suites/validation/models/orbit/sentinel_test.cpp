// The real orbit: Sentinel-3A, 800 km, as CNES determined it to a few centimetres from DORIS and
// GPS.
#include <orrery/models/atmosphere/nrlmsise00_atmosphere.hpp>
#include <orrery/models/ephemeris/sp3.hpp>
#include <orrery/models/orbit/drag_force.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/radiation_force.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>
#include <orrery/models/orbit/third_body_force.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "../../accuracy.hpp"
#include "../frames/reference_file.hpp"
#include "orbit_fit.hpp"

namespace orrery {
namespace {

constexpr double kArea_m2 = 7.5, kMass_kg = 1130;

/// The tide that the Moon and the Sun raise in the solid Earth, of degree 2 with a single Love
/// number: Montenbruck & Gill, Satellite Orbits (2000), 3.7.2. Less its constant part, which a
/// zero-tide field like GGM05S holds already: -4.2e-9 in C20 (IERS Conventions 2010, 6.2.2). To
/// show what our forces lack.
class SolidTide final : public ForceModel {
 public:
  std::string_view name() const override { return "solid_tide"; }
  Vec3 acceleration_ECI(const OrbitState& state, const Surroundings& around) const override {
    const double r = norm(state.r_ECI), q = kRadiusEarth_m / r;
    const Vec3 u = state.r_ECI / r;
    const auto raised_by = [&](const Vec3& body_ECI, double mu_m3ps2) {
      const double d = norm(body_ECI), c = dot(u, body_ECI) / d;
      const double k = kLoveNumber / 2 * mu_m3ps2 / (d * d * d) * r * (q * q * q * q * q);
      return k * ((3 - 15 * c * c) * u + (6 * c / d) * body_ECI);
    };
    const Vec3 pole_ECI = around.R_EI.row_z;
    const double c = dot(u, pole_ECI);
    const double k = 4.2e-9 * std::sqrt(5.0) * kMuEarth_m3ps2 * q * q / (r * r);
    return raised_by(around.r_sun_ECI, kMuSun_m3ps2) + raised_by(around.r_moon_ECI, kMuMoon_m3ps2) +
           k * (3 * c * pole_ECI - (7.5 * c * c - 1.5) * u);
  }

 private:
  static constexpr double kLoveNumber = 0.3019;
};

struct SentinelValidation : testing::Test {
  struct Data {
    std::vector<Sp3Record> records;  // one a minute
    std::shared_ptr<const SpaceEnvironment> earth;
    std::shared_ptr<const AtmosphereModel> atmosphere;
  };

  static void SetUpTestSuite() {
    const auto sp3_text = reference_text("leo_pod/sentinel3a_2018-12-25_27.sp3.gz");
    const auto eop_text = reference_text("eop/EOP-All-v1.1_2025-01-10.txt.gz");
    const auto weather_text = reference_text("space_weather/SW-All_v1.2.txt.gz");
    if (!sp3_text || !eop_text || !weather_text) return;
    data = std::make_unique<Data>(
        Data{parse_sp3(*sp3_text, "sentinel3a", {.excerpt = true}).satellite("L74").records,
             std::make_shared<const EarthEnvironment>(
                 EarthOrientationTable::parse(*eop_text, "EOP-All")),
             std::make_shared<const Nrlmsise00Atmosphere>(Nrlmsise00AtmosphereOptions{
                 .weather = SpaceWeather::parse_celestrak(*weather_text, "SW-All")})});
  }
  static void TearDownTestSuite() { data.reset(); }
  void SetUp() override {
    if (data == nullptr)
      GTEST_SKIP() << "no leo_pod/, eop/, space_weather/ in " << ORRERY_REFERENCE_DATA;
  }

  static SimTime after_begin(Duration d) { return data->records.front().t + d; }
  static const Sp3Record& record_at(SimTime t) {
    return data->records.at(static_cast<std::size_t>((t - after_begin(0s)) / 60s));
  }

  static OrbitState published(SimTime t) {
    const Sp3Record& at = record_at(t);
    const Surroundings around = data->earth->surroundings(t);
    const InertialState s = to_inertial(EarthFixedState{at.r_ECEF, at.v_ECEF.value()}, around.R_EI,
                                        around.omega_EI_ECEF);
    return {t, s.r_ECI, s.v_ECI, kMass_kg};
  }

  static std::vector<Vec3> published_positions(SimTime begin, Duration span) {
    std::vector<Vec3> r_ECEF;
    for (Duration d = 0s; d <= span; d += 60s) r_ECEF.push_back(record_at(begin + d).r_ECEF);
    return r_ECEF;
  }

  struct Arc {
    SimTime begin;
    Duration span;
    Duration step = 10s;
    int degree = 60;
    bool solid_tide = false;
  };

  static OrbitDynamics::Forces forces(const Arc& arc, double drag_scale, double light_scale) {
    OrbitDynamics::Forces all = {
        make_earth_gravity(arc.degree), make_sun_gravity(), make_moon_gravity(),
        std::make_shared<const DragForce>(
            data->atmosphere,
            DragForceOptions{.area_m2 = kArea_m2, .drag_coefficient = 2.2 * drag_scale}),
        std::make_shared<const RadiationForce>(RadiationForceOptions{
            .area_m2 = kArea_m2, .radiation_coefficient = 1.8 * light_scale})};
    if (arc.solid_tide) all.push_back(std::make_shared<const SolidTide>());
    return all;
  }

  // Positions once a minute. Parameters: what is added to the published state, in ECI, and the
  // scales of Cd = 2.2 and Cr = 1.8 where there are eight.
  static FitModel model(const Arc& arc) {
    return [arc](const std::vector<double>& p) {
      OrbitState initial = published(arc.begin);
      initial.r_ECI += {p[0], p[1], p[2]};
      initial.v_ECI += {p[3], p[4], p[5]};
      const bool scales = p.size() > 6;
      SpacecraftOrbit orbit(initial, {.step = arc.step,
                                      .forces = forces(arc, scales ? p[6] : 1, scales ? p[7] : 1),
                                      .environment = data->earth});
      std::vector<Vec3> r_ECEF;
      for (SimTime t = arc.begin; t <= arc.begin + arc.span; t += 60s)
        r_ECEF.push_back(data->earth->surroundings(t).R_EI * orbit.at(t).r_ECI);
      return r_ECEF;
    };
  }

  static Fit fit(const Arc& arc, bool with_scales) {
    std::vector<double> start(6), steps = {1, 1, 1, 1e-3, 1e-3, 1e-3};
    if (with_scales) start.insert(start.end(), {1, 1}), steps.insert(steps.end(), {0.1, 0.1});
    const Arc rough{arc.begin, arc.span, 60s, 20};
    return fitted(model(arc), model(rough), published_positions(arc.begin, arc.span), start, steps);
  }

  static std::unique_ptr<Data> data;
};

std::unique_ptr<SentinelValidation::Data> SentinelValidation::data;

// Errors from the end of the fit on: over all the time until the mark, and over the revolution
// before it, which is stricter and has the line in the table. Observed, worst of three starts: fit
// 0.22 m, then 1.4, 2.4, 4.1 m, and 2.0, 3.5, 6.7 m in the last revolution. What is left is the
// tides (see below) and Cd and Cr, which are not those of a box with a solar panel.
TEST_F(SentinelValidation, ThreeHoursAreFittedAndADayFollows) {
  struct Mark {
    std::size_t hours;
    double accepted_m, worst_m, worst_revolution_m;
  };
  std::array<Mark, 3> marks = {{{6, 3, 0, 0}, {12, 6, 0, 0}, {24, 10, 0, 0}}};
  double worst_fit_m = 0;
  for (const Duration begin : {0h, 22h, 44h}) {
    const SimTime t = after_begin(begin);
    const Fit found = fit({t, 3h}, false);
    worst_fit_m = std::max(worst_fit_m, found.rms_m);
    std::vector<Vec3> error = model({t, 27h})(found.parameters);
    const std::vector<Vec3> truth = published_positions(t, 27h);
    for (std::size_t i = 0; i < error.size(); ++i) error[i] -= truth[i];
    const auto rms_of_minutes = [&](std::size_t from, std::size_t to) {
      return rms({error.begin() + static_cast<std::ptrdiff_t>(from),
                  error.begin() + static_cast<std::ptrdiff_t>(to + 1)});
    };
    constexpr std::size_t kFit = 180, kRevolution = 101;  // minutes
    for (Mark& mark : marks) {
      const std::size_t end = kFit + 60 * mark.hours;
      mark.worst_m = std::max(mark.worst_m, rms_of_minutes(kFit, end));
      mark.worst_revolution_m =
          std::max(mark.worst_revolution_m, rms_of_minutes(end - kRevolution, end));
    }
  }
  expect_accuracy({"Sentinel-3A, state fitted to 3 h, rms", "CNES precise orbit", 0.4, "m"},
                  worst_fit_m);
  for (const Mark& mark : marks) {
    EXPECT_LE(mark.worst_m, mark.accepted_m) << mark.hours << " h";
    expect_accuracy(
        {"Sentinel-3A, " + std::to_string(mark.hours) + " h later, rms of the last orbit",
         "CNES precise orbit", mark.accepted_m, "m"},
        mark.worst_revolution_m);
  }
}

// Over a day Cd and Cr show. Observed at the begin and the end of the data: fit 1.5 and 0.4 m, Cd
// times 1.1 and 1.4, Cr times 1.4 and 1.5.
TEST_F(SentinelValidation, ADayGivesPlausibleScalesOfDragAndSunlight) {
  double worst_fit_m = 0;
  for (const Duration begin : {0h, 47h}) {
    const Fit found = fit({after_begin(begin), 24h, 20s}, true);
    worst_fit_m = std::max(worst_fit_m, found.rms_m);
    const double drag = found.parameters[6], light = found.parameters[7];
    const std::string hours = std::to_string(begin / 1h) + "_h";
    RecordProperty("drag_scale_from_" + hours, short_number(drag));
    RecordProperty("light_scale_from_" + hours, short_number(light));
    EXPECT_GT(drag, 0.3);
    EXPECT_LT(drag, 3);
    EXPECT_GT(light, 0.3);
    EXPECT_LT(light, 3);
  }
  // Not in the issue: what was seen, and half as much again.
  expect_accuracy(
      {"Sentinel-3A, state, Cd and Cr fitted to 24 h, rms", "CNES precise orbit", 2.2, "m"},
      worst_fit_m);
}

// What limits the fit of a day is a force that Table 1 does not have: with the solid Earth's tide
// it falls from 1.5 m to 0.33 m. That of three hours falls to half.
TEST_F(SentinelValidation, MostOfWhatIsLeftIsTheTideOfTheSolidEarth) {
  const Fit with_tide = fit({after_begin(0h), 24h, 20s, 60, true}, true);
  RecordProperty("rms_with_tide_m", short_number(with_tide.rms_m));
  EXPECT_LT(with_tide.rms_m, 0.5);
}

}  // namespace
}  // namespace orrery
