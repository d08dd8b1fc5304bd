// Flight navigation and RTKLIB on the same bytes: two programs without a line in common. Skipped
// where the package rtklib is not installed.
#include <orrery/models/frames/geodetic.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "../../unit/flight_sw/formation_gnc/navigation_scene.hpp"
#include "../models/gnss/rtklib.hpp"
#include "formation_gnc/navigation/navigation.hpp"

namespace orrery {
namespace {

namespace fs = std::filesystem;

struct Row {
  int quality;  // 1: integers fixed
  Vec3 baseline_ENU;
};

/// Of a solution file of baselines, by second since the scene's start.
std::map<long, Row> rows_of(const fs::path& path) {
  std::map<long, Row> rows;
  std::istringstream file(rtklib::read_text(path));
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '%') continue;
    std::istringstream fields(line);
    double week = 0, tow = 0;
    Row row{};
    fields >> week >> tow >> row.baseline_ENU.x >> row.baseline_ENU.y >> row.baseline_ENU.z >>
        row.quality;
    rows[std::lround(week * 604800 + tow -
                     1e-9 * static_cast<double>(to_ns(NavigationScene::start())))] = row;
  }
  return rows;
}

Vec3 to_ENU(const Vec3& v_ECEF, const Vec3& place_ECEF) {
  const Geodetic at = to_geodetic(place_ECEF);
  const double sb = std::sin(at.latitude_rad), cb = std::cos(at.latitude_rad);
  const double sl = std::sin(at.longitude_rad), cl = std::cos(at.longitude_rad);
  return {dot(v_ECEF, Vec3{-sl, cl, 0}), dot(v_ECEF, Vec3{-sb * cl, -sb * sl, cb}),
          dot(v_ECEF, Vec3{cb * cl, cb * sl, sb})};
}

void write_settings(const fs::path& path) {
  std::ofstream(path) << "pos1-posmode=movingbase\npos1-frequency=l1\npos1-soltype=forward\n"
                         "pos1-elmask=5\npos1-dynamics=off\npos1-ionoopt=off\npos1-tropopt=off\n"
                         "pos1-sateph=brdc\npos1-navsys=1\npos2-armode=continuous\npos2-arthres=3\n"
                         "stats-eratio1=200\nstats-errphase=0.002\nstats-errphaseel=0.002\n"
                         "ant2-postype=single\nout-solformat=enu\nout-timesys=gpst\n"
                         "out-timeform=tow\nout-timendec=3\nout-degform=deg\n";
}

// Antenna to antenna over 75 min at 10 s, all noise on. Bound: what RTKLIB's epoch-wise solution is
// uncertain by (4.9 mm RMS against truth at 1 Hz, validation_gnss_rtklib) with room for its weaker
// geometry at 10 s; a wrong integer on either side would be 0.19 m. Seen: 5.0 mm RMS, 19 mm at
// most, 436 epochs.
TEST(NavigationRtklibTest, AgreesOnTheBaseline) {
  ORRERY_NEED_RTKLIB("convbin");
  ORRERY_NEED_RTKLIB("rnx2rtkp");
  const fs::path folder = fs::path(testing::TempDir()) / "orrery_navigation_rtklib";
  fs::remove_all(folder);
  fs::create_directories(folder);
  NavigationScene scene({.seed = 8});
  formation_gnc::Navigation navigation;
  std::map<long, Vec3> ours_ENU;
  {
    std::ofstream streams[2] = {std::ofstream(folder / "chief.nov", std::ios::binary),
                                std::ofstream(folder / "deputy.nov", std::ios::binary)};
    const EarthEnvironment space;
    for (int k = 0; k < 450; ++k) {
      const NavigationScene::Epoch e = scene.next();
      for (int craft = 0; craft < 2; ++craft) {
        streams[craft].write(reinterpret_cast<const char*>(e.bytes[craft].data()),
                             static_cast<std::streamsize>(e.bytes[craft].size()));
      }
      for (const auto& ephemeris : e.ephemerides[0]) navigation.ephemeris(ephemeris);
      navigation.own_epoch(*e.measured[0], e.q_BI[0]);
      navigation.remote_epoch(*e.measured[1], e.q_BI[1]);
      const formation_gnc::FormationEstimate estimate = navigation.at(e.t_ns);
      if (!estimate.fixed) continue;
      // The lever arms are parallel to 1e-5: their difference is 1 um.
      const Mat3 R_EI = space.surroundings(scene.now()).R_EI;
      const auto& r = estimate.r_relative_ECI;
      const auto& self = estimate.r_self_ECI;
      ours_ENU[10 * k] =
          to_ENU(R_EI * Vec3{r[0], r[1], r[2]}, R_EI * Vec3{self[0], self[1], self[2]});
    }
  }
  for (const char* name : {"chief", "deputy"}) {
    const std::string n = name;
    rtklib::run(folder,
                "convbin -r nov -od -os -v 3.04 -o " + n + ".obs -n " + n + ".nav " + n + ".nov");
  }
  write_settings(folder / "moving.conf");
  rtklib::run(folder, "rnx2rtkp -k moving.conf -o moving.pos deputy.obs chief.obs chief.nav");

  int compared = 0;
  double squares = 0, worst_m = 0;
  for (const auto& [second, row] : rows_of(folder / "moving.pos")) {
    const auto ours = ours_ENU.find(second);
    if (row.quality != 1 || ours == ours_ENU.end()) continue;
    const double apart_m = norm(row.baseline_ENU - ours->second);
    squares += apart_m * apart_m;
    worst_m = std::max(worst_m, apart_m);
    ++compared;
  }
  EXPECT_GT(compared, 300);
  const double rms_m = std::sqrt(squares / compared);
  EXPECT_LT(rms_m, 0.01);
  EXPECT_LT(worst_m, 0.09);
  std::printf("%d epochs, %.1f mm RMS apart, %.1f mm at most\n", compared, 1e3 * rms_m,
              1e3 * worst_m);
  if (!testing::Test::HasFailure()) fs::remove_all(folder);
}

}  // namespace
}  // namespace orrery
