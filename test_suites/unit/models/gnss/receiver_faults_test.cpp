// The receiver as flight software meets it: logs, commands, start-up and faults, read from bytes.
#include <orrery/models/gnss/lnav.hpp>
#include <orrery/models/gnss/receiver.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "../../harness/kernel/allocations.hpp"
#include "../support/fake_device_context.hpp"
#include "../support/orbiting_device_context.hpp"
#include "leo_scene.hpp"

namespace orrery {
namespace {

using novatel::LogTrigger;

struct Frame {
  SimTime sent;
  std::uint16_t id, week;
  std::uint32_t ms;
  std::uint8_t time_status;
  ByteBuffer bytes;

  template <class T>
  T body(std::size_t offset) const {
    T value;
    std::memcpy(&value, bytes.data() + 28 + offset, sizeof value);
    return value;
  }
  Vec3 position() const { return {body<double>(8), body<double>(16), body<double>(24)}; }
};

/// A receiver on the scene's orbit, every second.
class ReceiverScene {
 public:
  explicit ReceiverScene(const GnssReceiverOptions& options)
      : io_(kSceneEpoch), receiver_(options) {
    io_.truth_at = [this](SimTime t) {
      const double s = to_seconds(t - kSceneEpoch);
      return OrbitState{t, leo_.r(s), leo_.v(s), 11};
    };
    io_.surroundings_at = [](SimTime t) {
      const double angle = kSceneOmega_radps * to_seconds(t - kSceneEpoch);
      return Surroundings{.R_EI = {turned({1, 0, 0}, -angle), turned({0, 1, 0}, -angle), {0, 0, 1}},
                          .omega_EI_ECEF = {0, 0, kSceneOmega_radps},
                          .r_sun_ECI = {1.5e11, 0, 0}};
    };
    point(0);
    receiver_.start(io_);
  }

  void run_until(Duration t) {
    for (; elapsed_ <= t; elapsed_ += 1s) {
      point(to_seconds(elapsed_));
      io_.run_until(kSceneEpoch + elapsed_);
    }
  }
  FakeDeviceContext& io() { return io_; }
  GnssReceiver& receiver() { return receiver_; }
  void command(std::string_view text) {
    receiver_.from_flight(io_, std::as_bytes(std::span(text.data(), text.size())));
  }

  /// All whole frames so far, in order; text between them is passed over.
  std::vector<Frame> frames() const {
    std::vector<Frame> out;
    for (const auto& sent : io_.to_flight_log) {
      for (std::size_t at = 0; at + 32 <= sent.bytes.size();) {
        std::uint16_t length = 0;
        std::memcpy(&length, sent.bytes.data() + at + 8, 2);
        const std::size_t whole = 32u + length;
        if (sent.bytes[at] != std::byte{0xAA} || at + whole > sent.bytes.size()) break;
        Frame f;
        f.sent = sent.t;
        f.bytes.assign(sent.bytes.begin() + static_cast<std::ptrdiff_t>(at),
                       sent.bytes.begin() + static_cast<std::ptrdiff_t>(at + whole));
        std::memcpy(&f.id, f.bytes.data() + 4, 2);
        std::memcpy(&f.week, f.bytes.data() + 14, 2);
        std::memcpy(&f.ms, f.bytes.data() + 16, 4);
        f.time_status = std::to_integer<std::uint8_t>(f.bytes[13]);
        out.push_back(f);
        at += whole;
      }
    }
    return out;
  }
  std::vector<Frame> frames(std::uint16_t id) const {
    std::vector<Frame> out = frames();
    std::erase_if(out, [id](const Frame& f) { return f.id != id; });
    return out;
  }

 private:
  void point(double s) {
    const Vec3 up = unit(leo_.r(s)), along = unit(leo_.v(s));
    const Vec3 x = unit(along - dot(along, up) * up);
    io_.attitude = {x, cross(up, x), up};
  }

  LeoScene leo_;
  FakeDeviceContext io_;
  GnssReceiver receiver_;
  Duration elapsed_ = 0s;
};

GnssReceiverOptions every_second(std::vector<novatel::LogRequest> logs = {}) {
  GnssReceiverOptions options;
  options.period = 1s;
  options.logs = std::move(logs);
  return options;
}

TEST(GnssReceiverLogsTest, CommandsSetWhatIsSentAndHowOften) {
  ReceiverScene scene(every_second());
  scene.run_until(9s);
  EXPECT_EQ(scene.frames(novatel::kBestXyzId).size(), 10u);
  scene.command("UNLOG BESTXYZB\r\nLOG RANGEB ONTIME 5\r\nLOG TIMEB ONTI");
  scene.command("ME 2 1\r\n");
  scene.run_until(29s);
  EXPECT_EQ(scene.frames(novatel::kBestXyzId).size(), 10u);
  EXPECT_EQ(scene.frames(novatel::kRangeId).size(), 4u);  // 10, 15, 20, 25
  EXPECT_EQ(scene.frames(novatel::kTimeId).size(), 10u);  // odd seconds
  EXPECT_EQ(scene.frames(novatel::kTimeId)[0].ms % 2000, 1000u);
}

TEST(GnssReceiverLogsTest, EveryLogIsAFrameWithItsCrc) {
  std::vector<novatel::LogRequest> logs;
  for (const std::uint16_t id :
       {novatel::kBestXyzId, novatel::kBestPosId, novatel::kRangeId, novatel::kRangeCmpId,
        novatel::kTimeId, novatel::kRawEphemId, novatel::kGpsEphemId, novatel::kIonUtcId,
        novatel::kAlmanacId, novatel::kVersionId}) {
    logs.push_back({.message_id = id, .trigger = LogTrigger::kOnce});
  }
  ReceiverScene scene(every_second(logs));
  scene.run_until(0s);
  std::map<int, int> seen;
  for (const Frame& f : scene.frames()) {
    EXPECT_EQ(novatel::crc32(f.bytes), 0u) << f.id;
    EXPECT_EQ(f.week, 2358);
    EXPECT_EQ(f.ms, 345600000u);
    ++seen[f.id];
  }
  EXPECT_EQ(seen.size(), 10u);
  EXPECT_EQ(seen[novatel::kRawEphemId], 31);
  EXPECT_EQ(seen[novatel::kGpsEphemId], 31);
  // BESTPOS and BESTXYZ are of one solution: height 550 km within the ellipsoid's 21 km.
  EXPECT_NEAR(scene.frames(novatel::kBestPosId)[0].body<double>(24), 550e3, 30e3);
  // TIME: 2025-03-19 23:59:42 UTC.
  const Frame time = scene.frames(novatel::kTimeId)[0];
  EXPECT_EQ(time.body<double>(20), -18);
  EXPECT_EQ(time.body<std::uint32_t>(28), 2025u);
  EXPECT_EQ(time.body<std::uint8_t>(33), 19);
  EXPECT_EQ(time.body<std::uint8_t>(34), 23);
  EXPECT_EQ(time.body<std::uint8_t>(35), 59);
  EXPECT_EQ(time.body<std::uint32_t>(36), 42000u);
}

/// PRN and IODC of each RAWEPHEM sent after an instant.
std::map<int, std::pair<int, SimTime>> ephemerides_after(const ReceiverScene& scene, Duration t) {
  std::map<int, std::pair<int, SimTime>> out;
  for (const Frame& f : scene.frames(novatel::kRawEphemId)) {
    if (f.sent <= kSceneEpoch + t) continue;
    lnav::Subframes subframes;
    std::memcpy(subframes.data(), f.bytes.data() + 28 + 12, sizeof subframes);
    const int prn = static_cast<int>(f.body<std::uint32_t>(0));
    EXPECT_EQ(out.count(prn), 0u) << "twice the same issue";
    out[prn] = {lnav::unpack(subframes, prn, 2358).iodc, f.sent};
  }
  return out;
}

// A new issue every 2 h, received with the first whole frame: its three subframes end 18 s after
// the issue begins.
TEST(GnssReceiverEphemerisTest, NewIssueIsSentOnceOfEachSatelliteInLock) {
  ReceiverScene scene(every_second({{novatel::kRawEphemId, LogTrigger::kOnChanged}}));
  scene.run_until(119min + 59s);
  const int first = ephemerides_after(scene, -1s).begin()->second.first;
  std::set<int> locked;
  for (const GnssChannel& c : scene.receiver().tracker()->channels()) {
    if (c.locked) locked.insert(c.prn);
  }
  scene.run_until(2h + 25s);
  std::set<int> renewed;
  for (const auto& [prn, issue] : ephemerides_after(scene, 2h - 1s)) {
    renewed.insert(prn);
    EXPECT_EQ(issue.first, (first + 1) % 1024);
    EXPECT_EQ(issue.second, kSceneEpoch + 2h + 18s);
  }
  EXPECT_EQ(renewed, locked);
}

TEST(GnssReceiverEphemerisTest, WithheldOnesDoNotCome) {
  ReceiverScene scene(every_second({{novatel::kRawEphemId, LogTrigger::kOnChanged}}));
  scene.run_until(119min);
  const int prn = scene.receiver().tracker()->channels()[0].prn;
  scene.io().faults[std::string("withhold ") + (prn < 10 ? "G0" : "G") + std::to_string(prn)] = 1;
  scene.run_until(2h + 60s);
  const auto renewed = ephemerides_after(scene, 2h - 1s);
  EXPECT_EQ(renewed.count(prn), 0u);
  EXPECT_GE(renewed.size(), 6u);
}

// Cold: the sky is searched (20 to 90 s), parity and a frame of 18 s at the next 30 s follow. Until
// the first solution the time is unknown, and then nothing is off by more than its own noise.
TEST(GnssReceiverStartTest, ColdStartFindsTimeAndPositionWithinMinutes) {
  GnssReceiverOptions options = every_second();
  options.start = GnssStart::kCold;
  ReceiverScene scene(options);
  scene.run_until(240s);
  Duration first_fix{};
  for (const Frame& f : scene.frames(novatel::kBestXyzId)) {
    const bool computed = f.body<std::uint32_t>(0) == 0;
    if (computed && first_fix == 0s) first_fix = f.sent - kSceneEpoch;
    EXPECT_EQ(f.time_status == 20, !computed) << to_seconds(f.sent - kSceneEpoch);
    if (!computed) continue;
    EXPECT_NEAR(norm(f.position()), 6928137, 20);
  }
  EXPECT_GE(first_fix, 38s);
  EXPECT_LE(first_fix, 150s);
  EXPECT_LT(std::abs(scene.receiver().clock().bias_s()), 1e-7);
}

TEST(GnssReceiverStartTest, WarmRestartKeepsTheEphemerides) {
  ReceiverScene scene(every_second());
  scene.run_until(60s);
  const std::uint32_t known = scene.receiver().ephemerides_known();
  scene.io().faults["restart"] = 1;
  scene.run_until(61s);
  scene.io().faults.clear();
  EXPECT_TRUE(scene.frames(novatel::kBestXyzId).back().body<std::uint32_t>(0) != 0);
  EXPECT_EQ(scene.receiver().ephemerides_known(), known);
  scene.run_until(95s);
  EXPECT_EQ(scene.frames(novatel::kBestXyzId).back().body<std::uint32_t>(0), 0u);
}

TEST(GnssReceiverFaultTest, SectorIsNotHeard) {
  ReceiverScene scene(every_second());
  const std::string south =
      GnssReceiver::sector_fault({.azimuth_from_deg = 90, .azimuth_to_deg = 270});
  scene.receiver().fault_set(south);
  scene.run_until(30s);
  const std::size_t before = scene.receiver().tracker()->channels().size();
  scene.io().faults[south] = 1;
  scene.run_until(40s);
  const std::size_t during = scene.receiver().tracker()->channels().size();
  EXPECT_LT(during, before);
  EXPECT_GT(during, 0u);
  // South of the receiver is where the satellite's direction has no northern part.
  const AntennaPlace antenna = antenna_at({}, 40s);
  RandomStreams streams(0);
  GpsConstellation gps({.sigma_orbit_m = 0}, kSceneEpoch, streams);
  const Vec3 up = unit(antenna.r_ECEF), north = unit(Vec3{0, 0, 1} - up.z * up);
  for (const GnssChannel& c : scene.receiver().tracker()->channels()) {
    EXPECT_GT(dot(north, gps.at(kSceneEpoch + 40s)[c.prn].r_ECEF - antenna.r_ECEF), 0) << c.prn;
  }
}

TEST(GnssReceiverFaultTest, SolutionFreezesAndIsBiased) {
  GnssReceiverOptions options = every_second();
  options.sigma_position_m = 0;
  ReceiverScene scene(options), clean(options);
  scene.run_until(10s), clean.run_until(20s);
  scene.io().faults["freeze"] = 1;
  scene.run_until(14s);
  scene.io().faults.clear();
  EXPECT_EQ(GnssReceiver::bias_fault({0, 250, 0}), "bias 0 250 0");
  scene.receiver().fault_set("bias 0 250 0");
  scene.receiver().fault_set("bias 9 9 9");
  scene.receiver().fault_set("bias 0 250 0");  // given twice, it is one
  scene.io().faults["bias 0 250 0"] = 1;
  scene.run_until(15s);
  scene.io().faults.clear();
  scene.run_until(16s);
  const auto got = scene.frames(novatel::kBestXyzId), truth = clean.frames(novatel::kBestXyzId);
  for (std::size_t i = 11; i <= 14; ++i) {
    EXPECT_EQ(got[i].position(), got[10].position());
    EXPECT_EQ(got[i].ms, got[10].ms + 1000 * (i - 10));  // but time goes on
  }
  EXPECT_LT(norm(got[15].position() - truth[15].position() - Vec3{0, 250, 0}), 1e-8);
  EXPECT_EQ(got[16].position(), truth[16].position());
}

TEST(GnssReceiverFaultTest, SolutionIsNoisierThanItSays) {
  GnssReceiverOptions exact = every_second();
  exact.sigma_position_m = exact.sigma_velocity_mps = 0;
  ReceiverScene scene(every_second()), usual(every_second()), truth(exact);
  scene.run_until(10s), usual.run_until(30s), truth.run_until(30s);
  scene.io().faults["noise"] = 20;
  scene.run_until(20s);
  scene.io().faults.clear();
  scene.run_until(30s);
  const auto got = scene.frames(novatel::kBestXyzId), same = usual.frames(novatel::kBestXyzId),
             zero = truth.frames(novatel::kBestXyzId);
  constexpr std::size_t kSigma = 32;  // three floats after the position
  for (std::size_t i = 5; i <= 30; ++i) {
    const Vec3 noise = same[i].position() - zero[i].position();
    const double times = i > 10 && i <= 20 ? 20 : 1;
    // Positions of 7e6 m are written to 1e-9 m, which the factor enlarges.
    EXPECT_LT(norm(got[i].position() - zero[i].position() - times * noise), 1e-7) << i;
    EXPECT_GT(norm(noise), 0.01) << i;
    EXPECT_EQ(got[i].body<float>(kSigma), same[i].body<float>(kSigma)) << i;
  }
}

TEST(GnssReceiverFaultTest, NamesThatCarryNumbersAreRead) {
  GnssReceiver receiver;
  const auto refused = [](const char* name) {
    return testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(name));
  };
  for (const char* name : {"bias 1 2", "bias 1 2 3 4", "bias 1 2 x", "bias ", "bias 1  2 3",
                           "bias 1 2 3 ", "sector 1 2 3"}) {
    EXPECT_THAT([&] { receiver.fault_set(name); }, refused(name));
  }
  EXPECT_THAT([&] { receiver.fault_set("bias 0 nan 0"); }, refused("not finite"));
  EXPECT_THAT([&] { GnssReceiver::bias_fault({0, std::nan(""), 0}); }, refused("not finite"));
  EXPECT_THAT([&] { receiver.fault_set("sector 90 90 0 90"); }, refused("sector of 0 deg"));
  EXPECT_EQ(GnssReceiver::sector_fault({.azimuth_from_deg = 0.1, .azimuth_to_deg = 270}),
            "sector 0.1 270 -90 90");
  EXPECT_NO_THROW(receiver.fault_set("slip G07"));
}

// c 50 us on every pseudorange at once; the phase follows, and steering takes it out again.
TEST(GnssReceiverFaultTest, ClockJumpMovesAllRangesAlike) {
  GnssReceiverOptions options = every_second({{novatel::kRangeId, LogTrigger::kOnTime, 1s}});
  options.tracking.noise = false;
  ReceiverScene scene(options), clean(options);
  scene.run_until(29s), clean.run_until(30s);
  scene.io().faults["clock_jump_s"] = 50e-6;
  scene.run_until(30s);
  const Frame a = scene.frames().back(), b = clean.frames().back();
  ASSERT_EQ(a.body<std::uint32_t>(0), b.body<std::uint32_t>(0));
  for (std::size_t i = 0; i < b.body<std::uint32_t>(0); ++i) {
    const double jump_m = a.body<double>(4 + 44 * i + 4) - b.body<double>(4 + 44 * i + 4);
    EXPECT_NEAR(jump_m, 299792458 * 50e-6, 0.5);  // 7.6 km/s x 50 us of motion
  }
  EXPECT_EQ(a.time_status, 100);  // COARSE
  scene.io().faults.clear();
  scene.run_until(200s);
  EXPECT_EQ(scene.frames().back().time_status, 180);
}

TEST(GnssReceiverFaultTest, WeekRollsOver) {
  ReceiverScene scene(every_second());
  scene.io().faults["week_offset"] = -1024;
  scene.run_until(0s);
  EXPECT_EQ(scene.frames()[0].week, 2358 - 1024);
  EXPECT_EQ(scene.frames()[0].ms, 345600000u);
  EXPECT_EQ(novatel::crc32(scene.frames()[0].bytes), 0u);
}

TEST(GnssReceiverFaultTest, BytesAreTurnedOverAndCutOnTheWire) {
  ReceiverScene scene(every_second()), clean(every_second());
  scene.io().faults["corrupt"] = 3;
  scene.run_until(0s), clean.run_until(0s);
  const ByteBuffer &a = scene.io().to_flight_log[0].bytes, &b = clean.io().to_flight_log[0].bytes;
  ASSERT_EQ(a.size(), b.size());
  int bits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    bits += std::popcount(std::to_integer<unsigned>(a[i] ^ b[i]));
  }
  EXPECT_EQ(bits, 3);
  scene.io().faults = {{"cut", 10}};
  scene.run_until(1s);
  EXPECT_EQ(scene.io().to_flight_log[1].bytes.size(), b.size() - 10);
}

TEST(GnssReceiverFaultTest, FewerThanFourSatellitesGiveNoSolution) {
  ReceiverScene scene(every_second());
  scene.run_until(10s);
  std::size_t left = scene.receiver().tracker()->channels().size();
  for (const GnssChannel& c : scene.receiver().tracker()->channels()) {
    if (left-- <= 3) break;
    scene.io().faults[std::string("outage ") + (c.prn < 10 ? "G0" : "G") + std::to_string(c.prn)] =
        1;
  }
  scene.run_until(11s);
  const Frame f = scene.frames().back();
  EXPECT_EQ(f.body<std::uint32_t>(0), 1u);  // INSUFFICIENT_OBS
  EXPECT_EQ(f.body<std::uint32_t>(4), 0u);  // NONE
  EXPECT_EQ(f.body<std::uint8_t>(104), 3);
}

// The issue's own words: no allocation per epoch. Risings, settings, new issues and all logs of
// measurements included; the first epochs may size their buffers.
TEST(GnssReceiverTest, EpochAllocatesNothing) {
  OrbitingDeviceContext io(1);
  GnssReceiver receiver(every_second({{novatel::kRangeId, LogTrigger::kOnTime, 1s},
                                      {novatel::kRangeCmpId, LogTrigger::kOnTime, 1s},
                                      {novatel::kBestXyzId, LogTrigger::kOnTime, 1s},
                                      {novatel::kTimeId, LogTrigger::kOnTime, 1s},
                                      {novatel::kRawEphemId, LogTrigger::kOnChanged}}));
  io.set(io.kEpoch);
  receiver.start(io);
  const auto run = [&](Duration from, Duration until) {
    for (Duration t = from; t < until; t += 1s) {
      io.set(io.kEpoch + t);
      io.epoch();
    }
  };
  run(0s, 10s);
  const std::uint64_t before = test::allocations();
  run(10s, 3h);
  EXPECT_EQ(test::allocations() - before, 0u);
  EXPECT_GT(io.bytes(), 10'000'000u);
}

}  // namespace
}  // namespace orrery
