// An independent client of the receiver's bytes: RTKLIB turns the streams of two spacecraft into
// RINEX and solves them. Skipped where the package rtklib is not installed.
#include <orrery/models/attitude/pointing.hpp>
#include <orrery/models/frames/geodetic.hpp>
#include <orrery/models/gnss/receiver.hpp>
#include <orrery/models/orbit/gravity_force.hpp>
#include <orrery/models/orbit/mean_elements.hpp>
#include <orrery/models/orbit/relative_elements.hpp>
#include <orrery/models/orbit/space_environment.hpp>
#include <orrery/models/orbit/spacecraft_orbit.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "../../../unit/models/support/fake_device_context.hpp"

namespace orrery {
namespace {

namespace fs = std::filesystem;

const SimTime kEpoch = gps_midnight(2025, 3, 20);
constexpr Duration kOrbit = 5739s;  // of 6928 km

/// (second since kEpoch, PRN).
using Mark = std::pair<int, int>;

GnssReceiverOptions every_second(bool noise) {
  using novatel::LogTrigger;
  GnssReceiverOptions options;
  options.period = 1s;
  options.tracking.noise = noise;
  options.logs = {{novatel::kRawEphemId, LogTrigger::kOnChanged},
                  {novatel::kIonUtcId, LogTrigger::kOnTime, 1h},
                  {novatel::kRangeId, LogTrigger::kOnTime, 1s},
                  {novatel::kBestXyzId, LogTrigger::kOnTime, 10s}};
  return options;
}

/// One spacecraft that points to the zenith, its receiver, and what that should be seen to do.
class Observer {
 public:
  Observer(const QuasiNonsingularElements& mean, std::uint64_t seed, const GnssReceiverOptions& o,
           std::shared_ptr<GpsConstellation> gps, std::shared_ptr<const SpaceEnvironment> space,
           std::shared_ptr<const ForceModel> gravity)
      : orbit_(initial(mean), {.forces = {std::move(gravity)}, .environment = space}),
        io_(kEpoch, seed),
        receiver_(o, std::move(gps)),
        lever_arm_B_(o.lever_arm_B),
        space_(space) {
    io_.truth_at = [this](SimTime t) { return orbit_.at(t); };
    io_.surroundings_at = [space](SimTime t) { return space->surroundings(t); };
    point();
    receiver_.start(io_);
  }

  /// Runs the epoch at `second`, with a slip of `cycles` on a satellite if prn > 0.
  void epoch(int second, int prn = 0, double cycles = 0) {
    const std::string name = "slip " + std::string(prn < 10 ? "G0" : "G") + std::to_string(prn);
    if (prn > 0) io_.faults[name] = cycles;
    io_.run_until(kEpoch + second * 1s - 1ns);
    point_at(kEpoch + second * 1s);
    io_.run_until(kEpoch + second * 1s);
    io_.faults.clear();
    for (const auto& sent : io_.to_flight_log) {
      stream_.write(reinterpret_cast<const char*>(sent.bytes.data()),
                    static_cast<std::streamsize>(sent.bytes.size()));
    }
    io_.to_flight_log.clear();
    note_arcs(second);
  }

  /// Antenna, ECEF.
  Vec3 antenna_ECEF(int second) const { return antennas_.at(static_cast<std::size_t>(second)); }
  /// First observations of arcs of satellites that had been observed before.
  const std::set<Mark>& arcs() const { return arcs_; }
  /// Those of satellites seen for the first time: a slip or not, as the reader likes.
  const std::set<Mark>& first_arcs() const { return first_arcs_; }
  int epochs() const { return static_cast<int>(antennas_.size()); }
  bool tracks(int prn) const {
    for (const GnssChannel& c : receiver_.tracker()->channels()) {
      if (c.prn == prn && c.reported && c.acquired < last_ - 60s) return true;
    }
    return false;
  }
  void write(const fs::path& path) const { std::ofstream(path, std::ios::binary) << stream_.str(); }

 private:
  static OrbitState initial(const QuasiNonsingularElements& mean) {
    const InertialState s = to_inertial(mean_to_osculating(mean));
    return {kEpoch, s.r_ECI, s.v_ECI, 11};
  }
  void point() { io_.attitude = zenith_pointing(inertial_state(orbit_.at(kEpoch))).R_BI; }
  void point_at(SimTime t) {
    const OrbitState s = orbit_.at(t);
    io_.attitude = zenith_pointing(inertial_state(s)).R_BI;
    antennas_.push_back(space_->surroundings(t).R_EI *
                        (s.r_ECI + transpose(io_.attitude) * lever_arm_B_));
    last_ = t;
  }
  void note_arcs(int second) {
    for (const GnssChannel& c : receiver_.tracker()->channels()) {
      if (!c.reported) continue;
      const auto known = acquired_.find(c.prn);
      if (known == acquired_.end()) first_arcs_.insert({second, c.prn});
      if (known != acquired_.end() && known->second != c.acquired) arcs_.insert({second, c.prn});
      acquired_[c.prn] = c.acquired;
    }
  }

  SpacecraftOrbit orbit_;
  FakeDeviceContext io_;
  GnssReceiver receiver_;
  Vec3 lever_arm_B_;
  std::shared_ptr<const SpaceEnvironment> space_;
  std::ostringstream stream_;
  std::vector<Vec3> antennas_;
  std::map<int, SimTime> acquired_;
  std::set<Mark> arcs_, first_arcs_;
  SimTime last_;
};

void run(const std::string& command) {
  const std::string quiet = command + " > rtklib.log 2>&1";
  ASSERT_EQ(std::system(quiet.c_str()), 0) << command;
}

/// Rows of a solution file by second since kEpoch: quality (1: fixed, 2: float, 5: single) and
/// three coordinates.
struct Row {
  int quality;
  Vec3 x;
};

std::map<int, Row> rows_of(const fs::path& path) {
  std::map<int, Row> rows;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '%') continue;
    std::istringstream fields(line);
    int week = 0;
    double tow = 0;
    Row row{};
    fields >> week >> tow >> row.x.x >> row.x.y >> row.x.z >> row.quality;
    const double since = (week - 2358) * 604800.0 + tow - 4 * 86400.0;
    rows[static_cast<int>(std::lround(since))] = row;
  }
  return rows;
}

/// Loss-of-lock marks of the phase in a RINEX 3 observation file: bit 0 slip, bit 1 half cycle.
struct Flags {
  std::set<Mark> slips, half_cycles;
  int phases = 0;
};

Flags flags_of(const fs::path& path) {
  Flags flags;
  std::ifstream file(path);
  int second = 0, phase_column = -1;
  for (std::string line; std::getline(file, line);) {
    if (line.find("SYS / # / OBS TYPES") != line.npos && line[0] == 'G') {
      const std::size_t at = line.find("L1C");
      EXPECT_NE(at, line.npos);
      phase_column = 3 + 16 * static_cast<int>((at - 7) / 4);
    }
    if (line[0] == '>') {
      std::istringstream fields(line.substr(2));
      int y = 0, month = 0, d = 0, h = 0, m = 0;
      double s = 0;
      fields >> y >> month >> d >> h >> m >> s;
      second = static_cast<int>(
          std::lround(to_seconds(gps_midnight(y, month, d) - kEpoch) + h * 3600 + m * 60 + s));
    }
    if (line[0] != 'G' || phase_column < 0 || line.find("OBS TYPES") != line.npos) continue;
    const auto lli = static_cast<std::size_t>(phase_column + 14);
    const std::string phase = line.substr(std::min(lli - 14, line.size()), 14);
    if (phase.find_first_not_of(' ') == phase.npos) continue;
    ++flags.phases;
    const Mark mark{second, std::stoi(line.substr(1, 2))};
    const char flag = lli < line.size() ? line[lli] : ' ';
    if (flag == ' ') continue;
    if (((flag - '0') & 1) != 0) flags.slips.insert(mark);
    if (((flag - '0') & 2) != 0) flags.half_cycles.insert(mark);
  }
  return flags;
}

class RtklibTest : public testing::Test {
 protected:
  void SetUp() override {
    if (std::string(ORRERY_CONVBIN).empty() || std::string(ORRERY_RNX2RTKP).empty()) {
      GTEST_SKIP() << "convbin and rnx2rtkp were not found at configuration (Debian: rtklib)";
    }
    folder_ =
        fs::path(testing::TempDir()) /
        ("orrery_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    before_ = fs::current_path();
    fs::current_path(folder_);
  }
  void TearDown() override {
    if (folder_.empty()) return;
    fs::current_path(before_);
    if (!HasFailure()) fs::remove_all(folder_);
  }

  void observe(const GpsConstellationOptions& gps_options, const GnssReceiverOptions& options) {
    RandomStreams streams(1);
    const auto gps = std::make_shared<GpsConstellation>(gps_options, kEpoch, streams);
    const auto space = std::make_shared<const EarthEnvironment>();
    const std::shared_ptr<const ForceModel> gravity = make_earth_gravity(30);
    const QuasiNonsingularElements chief = to_quasi_nonsingular(
        KeplerianElements{.a_m = 6928137, .e = 0.001, .i_rad = 1.7033, .raan_rad = 5.48});
    const double a = chief.a_m;
    const QuasiNonsingularElements deputy = deputy_elements(chief, {.dl = 40 / a});
    chief_ = std::make_unique<Observer>(chief, 11, options, gps, space, gravity);
    deputy_ = std::make_unique<Observer>(deputy, 12, options, gps, space, gravity);
  }

  void convert(const char* name, const Observer& observer) {
    observer.write(std::string(name) + ".nov");
    run(std::string(ORRERY_CONVBIN) + " -r nov -od -os -oi -ot -ol -v 3.04 -o " + name +
        ".obs -n " + name + ".nav " + name + ".nov");
    ASSERT_TRUE(fs::exists(std::string(name) + ".nav")) << "no ephemerides were understood";
  }

  /// Settings that work for two spacecraft (moving base, no dynamics, no atmosphere).
  void write_settings(const char* file, const char* mode, const char* format) {
    std::ofstream(file)
        << "pos1-posmode=" << mode
        << "\npos1-frequency=l1\npos1-soltype=forward\npos1-elmask=5\n"
           "pos1-dynamics=off\npos1-ionoopt=off\npos1-tropopt=off\n"
           "pos1-sateph=brdc\npos1-navsys=1\npos2-armode=continuous\n"
           "pos2-arthres=3\nstats-eratio1=200\nstats-errphase=0.002\n"
           "stats-errphaseel=0.002\nant2-postype=single\nout-solformat="
        << format << "\nout-timesys=gpst\nout-timeform=tow\nout-timendec=6\nout-degform=deg\n";
  }

  /// 3D RMS of single point positions against the antenna's truth.
  double single_point_rms_m(const char* name, const Observer& observer) {
    write_settings("single.conf", "single", "xyz");
    run(std::string(ORRERY_RNX2RTKP) + " -k single.conf -o " + name + ".single " + name + ".obs " +
        name + ".nav");
    double squares = 0, n = 0;
    for (const auto& [second, row] : rows_of(std::string(name) + ".single")) {
      if (second < 0 || second >= observer.epochs()) continue;
      const Vec3 error = row.x - observer.antenna_ECEF(second);
      squares += dot(error, error), ++n;
    }
    EXPECT_GT(n, 0.99 * observer.epochs());
    return std::sqrt(squares / n);
  }

  fs::path folder_, before_;
  std::unique_ptr<Observer> chief_, deputy_;
};

/// The direction from east, north and up at a place.
Vec3 from_ENU(const Vec3& enu, const Vec3& place_ECEF) {
  const Geodetic at = to_geodetic(place_ECEF);
  const double sb = std::sin(at.latitude_rad), cb = std::cos(at.latitude_rad);
  const double sl = std::sin(at.longitude_rad), cl = std::cos(at.longitude_rad);
  return enu.x * Vec3{-sl, cl, 0} + enu.y * Vec3{-sb * cl, -sb * sl, cb} +
         enu.z * Vec3{cb * cl, cb * sl, sb};
}

void expect_flags(const char* name, const Observer& observer, const std::set<Mark>& expected) {
  Flags flags = flags_of(std::string(name) + ".obs");
  for (const Mark& mark : observer.first_arcs()) flags.slips.erase(mark);
  EXPECT_GT(flags.phases, 5739 * 8);
  EXPECT_EQ(flags.slips, expected) << name;
  EXPECT_TRUE(flags.half_cycles.empty()) << name;
}

// One orbit at 1 Hz, everything on: noise by the C/N0 law of the reference mission (code 0.14 to
// 2.3 m, phase 0.66 to 10.5 mm), GPS orbits off their broadcast by 1 m per axis, ionosphere of 5
// TECU, clocks of their own, and five slips in the deputy's receiver.
TEST_F(RtklibTest, FixesTheBaselineOfTwoSpacecraftOverOneOrbit) {
  observe({}, every_second(true));
  std::set<Mark> slips;
  const int orbit_s = static_cast<int>(kOrbit / 1s);
  for (int second = 0; second < orbit_s; ++second) {
    int prn = 0;
    if (second % 1000 == 500) {
      for (int candidate = 1; candidate <= 32 && prn == 0; ++candidate) {
        if (deputy_->tracks(candidate)) prn = candidate;
      }
      slips.insert({second, prn});
    }
    chief_->epoch(second);
    deputy_->epoch(second, prn, 37);
  }
  ASSERT_EQ(slips.size(), 6u);
  convert("chief", *chief_);
  convert("deputy", *deputy_);
  // Slip flags: the injected ones and the first epochs of arcs, nothing else.
  expect_flags("chief", *chief_, chief_->arcs());
  slips.insert(deputy_->arcs().begin(), deputy_->arcs().end());
  expect_flags("deputy", *deputy_, slips);

  const double chief_rms_m = single_point_rms_m("chief", *chief_);
  const double deputy_rms_m = single_point_rms_m("deputy", *deputy_);
  EXPECT_LT(chief_rms_m, 6);
  EXPECT_LT(deputy_rms_m, 6);

  write_settings("moving.conf", "movingbase", "enu");
  run(std::string(ORRERY_RNX2RTKP) +
      " -k moving.conf -o moving.pos deputy.obs chief.obs chief.nav");
  int fixed = 0, wrong = 0;
  double squares = 0;
  for (const auto& [second, row] : rows_of("moving.pos")) {
    if (row.quality != 1 || second < 0 || second >= orbit_s) continue;
    ++fixed;
    const Vec3 baseline = deputy_->antenna_ECEF(second) - chief_->antenna_ECEF(second);
    const double error_m = norm(from_ENU(row.x, chief_->antenna_ECEF(second)) - baseline);
    squares += error_m * error_m;
    wrong += error_m > 0.1;
  }
  const double baseline_rms_m = std::sqrt(squares / fixed);
  EXPECT_GT(fixed, 0.95 * orbit_s);
  EXPECT_LT(baseline_rms_m, 0.020);
  EXPECT_LE(wrong, 0.001 * orbit_s);
  std::printf("single point %.2f and %.2f m; fixed %.2f %%, baseline RMS %.1f mm, wrong %d\n",
              chief_rms_m, deputy_rms_m, 100.0 * fixed / orbit_s, 1e3 * baseline_rms_m, wrong);
}

// Without noise, perturbation and ionosphere RTKLIB's single point is a check of geometry, clocks,
// relativity, Earth rotation and signs. It keeps RINEX's millimetre; M0's rounding and geometry
// (PDOP up to 3) leave millimetres more: the gate of the guide is 5 mm. Seen: 1 mm.
TEST_F(RtklibTest, SinglePointOfTheNoiselessStreamIsTheTruth) {
  GnssReceiverOptions options = every_second(false);
  options.tracking.vertical_tecu = 0;
  observe({.sigma_orbit_m = 0}, options);
  for (int second = 0; second < 1200; ++second) chief_->epoch(second);
  convert("chief", *chief_);
  const double rms_m = single_point_rms_m("chief", *chief_);
  EXPECT_LT(rms_m, 0.005);
  std::printf("single point without noise: %.2f mm RMS\n", 1e3 * rms_m);
}

}  // namespace
}  // namespace orrery
