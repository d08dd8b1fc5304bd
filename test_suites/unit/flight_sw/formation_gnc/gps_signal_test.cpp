// From the receiver's bytes to predicted ranges: flight code against the simulator, which is an
// implementation of its own.
#include <orrery/models/gnss/broadcast_orbit.hpp>
#include <orrery/models/gnss/lnav.hpp>
#include <orrery/models/gnss/novatel_messages.hpp>

#include <gtest/gtest.h>

#include <cmath>

#include "formation_gnc/navigation/signal_geometry.hpp"
#include "navigation_scene.hpp"

namespace orrery {
namespace {

using formation_gnc::GnssDecoder;
using formation_gnc::GnssEpoch;
namespace fg = formation_gnc;

BroadcastEphemeris an_ephemeris(int prn) {
  RandomStreams streams(1);
  GpsConstellation gps({}, NavigationScene::start(), streams);
  return *gps.broadcast(prn, NavigationScene::start() + 1h);
}

novatel_frame frame_of(const ByteBuffer& bytes, std::vector<unsigned char>* room,
                       novatel_framer* framer) {
  novatel_framer_init(framer, room->data(), room->size());
  novatel_framer_write(framer, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  novatel_frame frame{};
  EXPECT_EQ(novatel_framer_next(framer, &frame), 1);
  return frame;
}

struct Read {
  bool good = false;
  fg::BroadcastEphemeris ephemeris;
};

Read read(const ByteBuffer& bytes) {
  std::vector<unsigned char> room(4096);
  novatel_framer framer;
  const novatel_frame frame = frame_of(bytes, &room, &framer);
  Read out;
  out.good = fg::read_ephemeris(frame, &out.ephemeris);
  return out;
}

ByteBuffer raw_message(const BroadcastEphemeris& e, SimTime t) {
  ByteBuffer bytes;
  novatel::append(novatel::Header{.t = t},
                  novatel::RawEphem{.prn = static_cast<std::uint32_t>(e.prn),
                                    .reference_week = static_cast<std::uint32_t>(e.week),
                                    .reference_s = static_cast<std::uint32_t>(e.toe_s),
                                    .subframes = lnav::pack(e, 0)},
                  bytes);
  return bytes;
}

// All satellites over two hours, from both logs. Rounding alone: 1e-7 m at 2.6e7 m; velocity 1e-6
// m/s; clock 1e-7 m. GPSEPHEM carries unrounded numbers, and they are rounded in the ephemeris
// already.
TEST(GpsSignalTest, SatellitesAreWhereTheSimulatorPutsThem) {
  const SimTime start = NavigationScene::start();
  for (int prn : {1, 7, 13, 22, 30}) {
    const BroadcastEphemeris sent = an_ephemeris(prn);
    ByteBuffer decoded;
    novatel::append(novatel::Header{.t = start}, novatel::to_gpsephem(sent, 0, sent.week), decoded);
    for (const Read& r : {read(raw_message(sent, start)), read(decoded)}) {
      ASSERT_TRUE(r.good) << prn;
      EXPECT_EQ(r.ephemeris.iodc, sent.iodc);
      for (Duration after : {0s, 1234s, 7200s}) {
        const SatelliteState truth = broadcast_state(sent, start + after);
        const fg::SatelliteState s = fg::satellite_ECEF(r.ephemeris, to_ns(start + after));
        EXPECT_LT(norm(Vec3{s.r[0], s.r[1], s.r[2]} - truth.r_ECEF), 1e-6) << prn;
        EXPECT_LT(norm(Vec3{s.v[0], s.v[1], s.v[2]} - truth.v_ECEF), 1e-6) << prn;
        EXPECT_NEAR(s.clock_m, 299792458.0 * (truth.clock_s - sent.tgd_s), 1e-6) << prn;
      }
    }
  }
}

TEST(GpsSignalTest, EphemeridesThatContradictThemselvesAreRefused) {
  const BroadcastEphemeris good = an_ephemeris(7);
  const auto spoilt = [&](auto change) {
    novatel::RawEphem message{.prn = 7, .subframes = lnav::pack(good, 0)};
    change(&message);
    ByteBuffer bytes;
    novatel::append(novatel::Header{.t = NavigationScene::start()}, message, bytes);
    return read(bytes).good;
  };
  EXPECT_TRUE(spoilt([](auto*) {}));
  EXPECT_FALSE(spoilt([](auto* m) { std::swap(m->subframes[0], m->subframes[1]); }));
  EXPECT_FALSE(spoilt([](auto* m) { m->subframes[1][6] ^= std::byte{1}; }));  // IODE
  EXPECT_FALSE(spoilt([](auto* m) { m->prn = 40; }));
}

// The issue nearest in time serves, whenever it came.
TEST(GpsSignalTest, EphemerisOfAnEpochDoesNotDependOnTheOrderOfArrival) {
  fg::EphemerisStore forward, backward;
  fg::BroadcastEphemeris issue[3];
  for (int k = 0; k < 3; ++k) {
    issue[k].prn = 5;
    issue[k].toe_ns = (1 + k) * 7'200'000'000'000;
  }
  for (int k = 0; k < 2; ++k) forward.add(issue[k]), backward.add(issue[1 - k]);
  for (std::int64_t t_s : {6000, 10000, 11000, 15000}) {
    EXPECT_EQ(forward.find(5, t_s * 1'000'000'000)->toe_ns,
              backward.find(5, t_s * 1'000'000'000)->toe_ns);
  }
  forward.add(issue[2]);
  EXPECT_EQ(forward.find(5, 22'000'000'000'000)->toe_ns, issue[2].toe_ns);
  EXPECT_EQ(forward.find(5, 40'000'000'000'000), nullptr);
  EXPECT_EQ(forward.find(6, 7'200'000'000'000), nullptr);
}

// Codes without noise, ionosphere and orbit errors are the predicted ranges; clocks run free, 0.1
// to 0.5 ms off, so that the tag is wrong by 4 m of flight. The truth goes from ECI to ECEF by the
// simulator's Earth and back by the flight's, which differ by 3 mas. 1 mm is the rounding of the
// broadcast M0, 0.1 mm in the first hours, with room. Seen: 0.03 mm; between the spacecraft 40 m
// apart, where that is common, 2e-8 m.
TEST(GpsSignalTest, PredictedRangesAreTheMeasuredOnes) {
  SceneOptions options{.gps_orbit_m = 0, .knowledge_deg = 0};
  options.tracking.noise = false;
  options.tracking.vertical_tecu = 0;
  options.clock = {.steered = false, .initial_bias_s = 1e-4, .initial_drift_sps = 1e-7};
  NavigationScene scene(options);
  const EarthEnvironment space;
  fg::EphemerisStore ephemerides;
  fg::EarthAttitude earth;
  const flight_support::Vec3 lever_arm_B = flight_support::vec3(0.05, 0, 0.10);
  int compared = 0;
  for (int k = 0; k < 60; ++k) {
    const NavigationScene::Epoch e = scene.next();
    for (const auto& ephemeris : e.ephemerides[0]) ephemerides.add(ephemeris);
    double error_m[2][33] = {};
    for (int craft = 0; craft < 2; ++craft) {
      fg::SatelliteTable table;
      table.prepare(*e.measured[craft], ephemerides, {}, &earth);
      const Vec3 r = space.surroundings(scene.now()).R_EI * e.truth[craft].r_ECI;
      const Vec3 v = space.surroundings(scene.now()).R_EI * e.truth[craft].v_ECI;
      const flight_support::Mat3 R_IE = earth.ecef_to_eci(e.t_ns, {});
      fg::AntennaState antenna;
      antenna.r_ECI = R_IE * flight_support::vec3(r.x, r.y, r.z) +
                      transpose(fg::rotation_of(e.q_BI[craft])) * lever_arm_B;
      antenna.v_ECI = R_IE * flight_support::vec3(v.x, v.y, v.z);
      antenna.clock_m = e.clock_m[craft];
      for (int o = 0; o < e.measured[craft]->count; ++o) {
        const fg::Observation& observed = e.measured[craft]->observation[o];
        const fg::SatelliteState* satellite = table.find(observed.prn);
        ASSERT_NE(satellite, nullptr);
        const double error = observed.code_m - fg::predict(antenna, *satellite).range_m;
        EXPECT_NEAR(error, 0, 1e-3) << "G" << int{observed.prn} << " epoch " << k;
        error_m[craft][observed.prn] = error;
      }
    }
    for (int prn = 1; prn <= 32; ++prn) {
      if (error_m[0][prn] == 0 || error_m[1][prn] == 0) continue;
      EXPECT_NEAR(error_m[1][prn], error_m[0][prn], 1e-6) << prn;
      ++compared;
    }
  }
  EXPECT_GT(compared, 500);
  EXPECT_GT(std::abs(scene.next().clock_m[0]), 3e4);
}

// The partials against differences of predict() itself.
TEST(GpsSignalTest, PartialsAreThoseOfThePrediction) {
  fg::SatelliteState satellite;
  satellite.r = flight_support::vec3(1.5e7, 1.2e7, 1.8e7);
  satellite.v = flight_support::vec3(-2.5e3, 2.8e3, 0.3e3);
  fg::AntennaState antenna;
  antenna.r_ECI = flight_support::vec3(4.9e6, -2.0e6, 4.45e6);
  antenna.v_ECI = flight_support::vec3(3.3e3, 6.7e3, -0.6e3);
  antenna.clock_m = 3000;
  const fg::Predicted p = fg::predict(antenna, satellite);
  fg::AntennaState moved = antenna;
  moved.clock_m += 100;
  // d(range)/d(clock) is known to the satellite's own v/c, 1e-5 of the part beyond 1 (2e-5).
  EXPECT_NEAR(fg::predict(moved, satellite).range_m - p.range_m, 100 * p.clock_factor, 1e-6);
  for (int axis = 0; axis < 3; ++axis) {
    moved = antenna;
    moved.r_ECI[axis] += 10;
    // Curvature: 10^2 / (2 * 2e7) m. The light time adds v/c.
    EXPECT_NEAR(fg::predict(moved, satellite).range_m - p.range_m, -10 * p.line_of_sight[axis],
                3e-4);
  }
}

TEST(GpsSignalTest, ThermalNoiseIsTable2s) {
  EXPECT_NEAR(fg::code_sigma_m(45), 0.1437, 1e-4);
  EXPECT_NEAR(fg::code_sigma_m(21), 2.2769, 1e-3);
  EXPECT_NEAR(fg::phase_sigma_m(45), 0.659e-3, 2e-6);
  EXPECT_NEAR(fg::phase_sigma_m(21), 10.45e-3, 2e-5);
}

// ---- GnssDecoder

GnssReceiverOptions logging(std::vector<novatel::LogRequest> logs) {
  GnssReceiverOptions options;
  options.logs = std::move(logs);
  return options;
}

ByteBuffer bytes_of(const FakeDeviceContext& io) {
  ByteBuffer all;
  for (const auto& sent : io.to_flight_log)
    all.insert(all.end(), sent.bytes.begin(), sent.bytes.end());
  return all;
}

std::vector<GnssEpoch> decode(const ByteBuffer& bytes, std::size_t piece) {
  GnssDecoder decoder;
  std::vector<GnssEpoch> epochs;
  const auto* at = reinterpret_cast<const unsigned char*>(bytes.data());
  for (std::size_t k = 0; k < bytes.size(); k += piece) {
    decoder.write(at + k, std::min(piece, bytes.size() - k));
    for (auto what = decoder.next(); what != GnssDecoder::kNothing; what = decoder.next()) {
      if (what == GnssDecoder::kEpoch) epochs.push_back(decoder.epoch());
    }
  }
  if (decoder.flush()) epochs.push_back(decoder.epoch());
  EXPECT_EQ(decoder.bytes_dropped(), 0u);
  return epochs;
}

/// A receiver that stands still above the Earth for five epochs.
ByteBuffer five_epochs(std::vector<novatel::LogRequest> logs) {
  FakeDeviceContext io(NavigationScene::start());
  const auto space = std::make_shared<const EarthEnvironment>();
  io.truth_at = [](SimTime t) {
    return OrbitState{t, {4.9e6, -2.0e6, 4.45e6}, {3300, 6700, -600}, 11};
  };
  io.surroundings_at = [space](SimTime t) { return space->surroundings(t); };
  GnssReceiver receiver(logging(std::move(logs)));
  receiver.start(io);
  io.run_for(40s);
  return bytes_of(io);
}

constexpr auto kOnTime = novatel::LogTrigger::kOnTime;

TEST(GnssDecoderTest, PutsLogsOfOneTimeTogether) {
  for (std::size_t piece : {1, 100, 4096}) {
    const auto epochs = decode(
        five_epochs({{novatel::kRangeId, kOnTime, 10s}, {novatel::kBestXyzId, kOnTime, 10s}}),
        piece);
    ASSERT_EQ(epochs.size(), 5u) << piece;
    for (int k = 0; k < 5; ++k) {
      EXPECT_EQ(epochs[k].t_ns, to_ns(NavigationScene::start() + k * 10s));
      EXPECT_TRUE(epochs[k].has_fix);
      EXPECT_GE(epochs[k].count, 4);
    }
  }
}

TEST(GnssDecoderTest, GivesAnEpochWhenTheNextOneBegins) {
  for (std::uint16_t only : {novatel::kRangeId, novatel::kBestXyzId}) {
    const auto epochs = decode(five_epochs({{only, kOnTime, 10s}}), 4096);
    ASSERT_EQ(epochs.size(), 5u);
    for (int k = 0; k < 5; ++k) {
      EXPECT_EQ(epochs[k].t_ns, to_ns(NavigationScene::start() + k * 10s));
      EXPECT_EQ(epochs[k].has_fix, only == novatel::kBestXyzId);
      EXPECT_EQ(epochs[k].count > 0, only == novatel::kRangeId);
    }
  }
}

// RANGECMP is RANGE in steps of 1/128 m and 1/256 cycle.
TEST(GnssDecoderTest, CompressedRangesAreTheSame) {
  const auto full = decode(five_epochs({{novatel::kRangeId, kOnTime, 10s}}), 4096);
  const auto compressed = decode(five_epochs({{novatel::kRangeCmpId, kOnTime, 10s}}), 4096);
  ASSERT_EQ(full.size(), compressed.size());
  for (std::size_t k = 0; k < full.size(); ++k) {
    ASSERT_EQ(full[k].count, compressed[k].count);
    for (int o = 0; o < full[k].count; ++o) {
      EXPECT_NEAR(full[k].observation[o].code_m, compressed[k].observation[o].code_m, 0.5 / 128);
      EXPECT_NEAR(full[k].observation[o].phase_cycles, compressed[k].observation[o].phase_cycles,
                  0.5 / 256 + 1e-9);
    }
  }
}

TEST(GnssDecoderTest, SurvivesAnyBytes) {
  ByteBuffer bytes =
      five_epochs({{novatel::kRangeId, kOnTime, 10s}, {novatel::kBestXyzId, kOnTime, 10s}});
  RandomStream random(3);
  for (std::byte& b : bytes) {
    if (random.bernoulli(0.002)) b = static_cast<std::byte>(random.integer(0, 255));
  }
  for (const GnssEpoch& epoch : decode(bytes, 777)) EXPECT_TRUE(fg::is_plausible(epoch));
}

}  // namespace
}  // namespace orrery
