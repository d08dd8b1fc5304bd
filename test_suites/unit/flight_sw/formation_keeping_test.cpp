// The package at its C ABI, linked in: what a host sees of it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "flight_test_support.hpp"
#include "formation_keeping_messages.h"
#include "orrery_flight.h"

// As the package's static library calls its entry.
extern "C" const orrery_flight* formation_keeping_entry(void);

namespace formation_keeping {

using namespace flight_support;

namespace {

using flight_test::kEpoch_ns;
using Bytes = std::vector<unsigned char>;

// A spacecraft's computer: collects what the package says.
class Computer {
 public:
  Computer() {
    host_ = {sizeof(orrery_host),
             ORRERY_ABI_VERSION,
             this,
             &output,
             &request_tick,
             &log,
             &nv_load,
             &nv_store};
  }
  Computer(const Computer&) = delete;
  Computer& operator=(const Computer&) = delete;
  ~Computer() { end(); }

  std::int32_t boot(const std::string& config, std::int64_t now_ns = kEpoch_ns,
                    std::uint32_t boot_count = 0) {
    end();
    const orrery_boot record{now_ns,
                             "any",
                             "gnc",
                             boot_count,
                             ORRERY_POWER_ON,
                             config.data(),
                             static_cast<std::uint32_t>(config.size())};
    const std::int32_t status = flight()->create(&self_, &host_, &record);
    if (status != ORRERY_OK) self_ = nullptr;
    return status;
  }
  std::int32_t input(const std::string& port, std::int64_t now_ns, const Bytes& data) {
    return flight()->input(self_, now_ns, id(port, ORRERY_IN), data.data(),
                           static_cast<std::uint32_t>(data.size()));
  }
  std::int32_t tick(std::int64_t now_ns) {
    tick_ns = ORRERY_NO_TICK;
    return flight()->tick(self_, now_ns);
  }
  static const orrery_flight* flight() { return formation_keeping_entry(); }
  static std::uint32_t id(const std::string& name, unsigned direction) {
    for (std::uint32_t k = 0; k < flight()->port_count; ++k) {
      const orrery_port& port = flight()->ports[k];
      if (name == port.name && port.direction == direction) return port.id;
    }
    ADD_FAILURE() << "no port " << name;
    return 0;
  }

  std::map<std::string, std::vector<Bytes>> said;  // by port
  std::string logged;
  std::int64_t tick_ns = ORRERY_NO_TICK;
  Bytes stored;

 private:
  void end() {
    if (self_ != nullptr) flight()->destroy(self_);
    self_ = nullptr;
  }
  static Computer* of(void* context) { return static_cast<Computer*>(context); }
  static std::int32_t output(void* context, std::uint32_t port, const void* data,
                             std::uint32_t bytes) {
    for (std::uint32_t k = 0; k < flight()->port_count; ++k) {
      const orrery_port& p = flight()->ports[k];
      if (p.id != port || p.direction != ORRERY_OUT) continue;
      EXPECT_LE(bytes, p.max_bytes) << p.name;
      const unsigned char* begin = static_cast<const unsigned char*>(data);
      of(context)->said[p.name].emplace_back(begin, begin + bytes);
      return ORRERY_OK;
    }
    ADD_FAILURE() << "output on port " << port;
    return ORRERY_NOT_FOUND;
  }
  static void request_tick(void* context, std::int64_t at_ns) { of(context)->tick_ns = at_ns; }
  static void log(void* context, std::int32_t, const char* line) {
    of(context)->logged += std::string(line) + "\n";
  }
  static std::int32_t nv_load(void* context, std::uint32_t, void* buffer, std::uint32_t capacity) {
    const Bytes& stored = of(context)->stored;
    if (stored.empty()) return ORRERY_NOT_FOUND;
    if (stored.size() > capacity) return ORRERY_TOO_SMALL;
    std::copy(stored.begin(), stored.end(), static_cast<unsigned char*>(buffer));
    return static_cast<std::int32_t>(stored.size());
  }
  static std::int32_t nv_store(void* context, std::uint32_t, const void* data,
                               std::uint32_t bytes) {
    const unsigned char* begin = static_cast<const unsigned char*>(data);
    of(context)->stored.assign(begin, begin + bytes);
    return ORRERY_OK;
  }

  orrery_host host_;
  void* self_ = nullptr;
};

Bytes command(unsigned opcode, double size_m, std::int64_t end_ns) {
  const double a_roe_m[6] = {0, 0, 0, size_m, 0, size_m};
  Bytes message(FORMATION_COMMAND_BYTES);
  formation_put_command(message.data(), opcode, a_roe_m, end_ns);
  return message;
}

struct FormationKeepingTest : testing::Test {
  // One fix of a spacecraft above an oblate Earth, after `t_s`; with no relative elements, of the
  // chief.
  StateEci state_at(double t_s, const RelativeElements& a_roe) {
    const OrbitElements mean = propagate_mean(flight_test::reference_chief(), t_s);
    return flight_test::state_of_mean(apply_relative_elements(
        mean, state_transition(flight_test::reference_chief(), t_s) * a_roe));
  }
  Bytes frame_at(double t_s, const RelativeElements& a_roe) {
    return flight_test::bestxyz_frame(
        flight_test::noisy_fix(kEpoch_ns + nanoseconds(t_s), state_at(t_s, a_roe), &noise));
  }
  flight_test::Noise noise{11};
  RelativeElements at_chief;
  RelativeElements at_deputy = flight_test::roe(0, 0, 0, 300, 0, 300);
  Computer chief, deputy;
  std::int64_t end_ns = kEpoch_ns + 57400 * kSecond_ns;
};

TEST_F(FormationKeepingTest, ThePortTableIsSound) {
  const orrery_flight* flight = Computer::flight();
  EXPECT_EQ(flight->size, sizeof(orrery_flight));
  EXPECT_EQ(flight->abi_version, ORRERY_ABI_VERSION);
  std::set<std::pair<unsigned, std::uint32_t>> ids;
  std::set<std::pair<unsigned, std::string>> names;
  for (std::uint32_t k = 0; k < flight->port_count; ++k) {
    ids.insert({flight->ports[k].direction, flight->ports[k].id});
    names.insert({flight->ports[k].direction, flight->ports[k].name});
  }
  EXPECT_EQ(ids.size(), flight->port_count);
  EXPECT_EQ(names.size(), flight->port_count);
}

TEST_F(FormationKeepingTest, AWrongConfigurationIsABootFailureWithAReason) {
  EXPECT_NE(deputy.boot("role=deputy\nleap_secnds=18\n"), ORRERY_OK);
  EXPECT_THAT(deputy.logged, testing::HasSubstr("line 2: 'leap_secnds' is no key"));
  EXPECT_EQ(deputy.boot(""), ORRERY_OK);
}

TEST_F(FormationKeepingTest, BootReportsTheModeOfTheRole) {
  ASSERT_EQ(chief.boot("role=chief"), ORRERY_OK);
  ASSERT_EQ(deputy.boot("role=deputy"), ORRERY_OK);
  std::int64_t t_ns = 0;
  std::uint32_t mode = 99;
  orrery_get_mode(chief.said["mode"].at(0).data(), &t_ns, &mode);
  EXPECT_EQ(mode, static_cast<std::uint32_t>(FORMATION_MODE_PASSIVE));
  orrery_get_mode(deputy.said["mode"].at(0).data(), &t_ns, &mode);
  EXPECT_EQ(mode, static_cast<std::uint32_t>(FORMATION_MODE_ACQUIRING));
  EXPECT_EQ(t_ns, kEpoch_ns);
  EXPECT_EQ(chief.tick_ns, ORRERY_NO_TICK);
}

// A receiver at 1 Hz, its stream cut into pieces of 7 bytes: one state every 10 s, at whole tens.
TEST_F(FormationKeepingTest, SendsAStatePerPeriodWhateverTheStreamsCuts) {
  ASSERT_EQ(chief.boot("role=chief"), ORRERY_OK);
  for (int s = 0; s <= 60; ++s) {
    const Bytes frame = frame_at(s, at_chief);
    for (std::size_t at = 0; at < frame.size(); at += 7) {
      const std::size_t to = std::min(frame.size(), at + 7);
      const Bytes piece(frame.begin() + static_cast<std::ptrdiff_t>(at),
                        frame.begin() + static_cast<std::ptrdiff_t>(to));
      EXPECT_EQ(chief.input("gnss", kEpoch_ns + s * kSecond_ns, piece), ORRERY_OK);
    }
  }
  ASSERT_EQ(chief.said["crosslink"].size(), 7u);
  for (std::size_t k = 0; k < 7; ++k) {
    EXPECT_EQ(orrery_get_i64(chief.said["crosslink"][k].data() + 12),
              kEpoch_ns + static_cast<std::int64_t>(k) * 10 * kSecond_ns);
  }
}

TEST_F(FormationKeepingTest, CorruptedInputIsRejected) {
  ASSERT_EQ(chief.boot("role=chief"), ORRERY_OK);
  Bytes frame = frame_at(0, at_chief);
  frame[60] ^= 1;
  EXPECT_EQ(chief.input("gnss", kEpoch_ns, frame), ORRERY_REJECTED);
  EXPECT_EQ(chief.input("crosslink", kEpoch_ns, Bytes(88, 0)), ORRERY_REJECTED);
  EXPECT_EQ(chief.input("crosslink", kEpoch_ns, Bytes()), ORRERY_REJECTED);
  EXPECT_EQ(Computer::flight()->port_count, 8u);
}

TEST_F(FormationKeepingTest, TheChiefTakesNoCommandsAndTheDeputyNoBadOnes) {
  ASSERT_EQ(chief.boot("role=chief"), ORRERY_OK);
  ASSERT_EQ(deputy.boot("role=deputy"), ORRERY_OK);
  const Bytes good = command(FORMATION_RECONFIGURE, 100, end_ns);
  EXPECT_EQ(chief.input("command", kEpoch_ns, good), ORRERY_REJECTED);
  Bytes corrupted = good;
  corrupted[20] ^= 4;
  EXPECT_EQ(deputy.input("command", kEpoch_ns, corrupted), ORRERY_REJECTED);
  EXPECT_EQ(deputy.input("command", kEpoch_ns, Bytes(good.begin(), good.end() - 1)),
            ORRERY_REJECTED);
  EXPECT_EQ(deputy.input("command", kEpoch_ns, command(77, 100, end_ns)), ORRERY_REJECTED);
  EXPECT_EQ(deputy.input("command", kEpoch_ns, command(FORMATION_RECONFIGURE, 40, end_ns)),
            ORRERY_REJECTED);
  EXPECT_TRUE(deputy.stored.empty());
  EXPECT_EQ(deputy.input("command", kEpoch_ns, good), ORRERY_OK);
  EXPECT_EQ(deputy.stored, good);
}

// An hour and a half of both packages with a perfect crosslink: the deputy's estimate, at its own
// epoch, is within 5 of its own sigmas, below 1 m, and it goes to standby; then it obeys.
TEST_F(FormationKeepingTest, TwoPackagesNavigateAndTheDeputyBurnsOnCommand) {
  ASSERT_EQ(chief.boot("role=chief"), ORRERY_OK);
  ASSERT_EQ(deputy.boot("role=deputy"), ORRERY_OK);
  std::uint32_t standby = 0;
  for (int k = 0; k <= 540; ++k) {
    const std::int64_t now_ns = kEpoch_ns + k * 10 * kSecond_ns;
    while (deputy.tick_ns != ORRERY_NO_TICK && deputy.tick_ns <= now_ns) {
      deputy.tick(deputy.tick_ns);
    }
    ASSERT_EQ(chief.input("gnss", now_ns, frame_at(10.0 * k, at_chief)), ORRERY_OK);
    ASSERT_EQ(deputy.input("gnss", now_ns, frame_at(10.0 * k, at_deputy)), ORRERY_OK);
    ASSERT_EQ(deputy.input("crosslink", now_ns, chief.said["crosslink"].back()), ORRERY_OK);
    ASSERT_EQ(chief.input("crosslink", now_ns, deputy.said["crosslink"].back()), ORRERY_OK);
  }
  std::int64_t t_ns = 0;
  double r[3], v[3], sigma_r[3], sigma_v[3];
  orrery_get_estimate(deputy.said["estimate"].back().data(), &t_ns, r, v, sigma_r, sigma_v);
  EXPECT_EQ(t_ns, kEpoch_ns + 5400 * kSecond_ns);
  const RelativeStateRtn truth =
      relative_state_rtn(state_at(5400, at_chief), state_at(5400, at_deputy));
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(r[k], truth.r_DC_RTN[k], std::fmin(5 * sigma_r[k], 1.0)) << k;
    EXPECT_NEAR(v[k], truth.v_DC_RTN[k], std::fmin(5 * sigma_v[k], 2e-3)) << k;
  }
  orrery_get_mode(deputy.said["mode"].back().data(), &t_ns, &standby);
  EXPECT_EQ(standby, static_cast<std::uint32_t>(FORMATION_MODE_STANDBY));
  formation_telemetry telemetry;
  formation_get_telemetry(deputy.said["telemetry"].back().data(), &telemetry);
  EXPECT_EQ(telemetry.outliers, 0u);
  EXPECT_GT(telemetry.updates, 500u);
  EXPECT_NEAR(telemetry.a_roe_m[3], 300.0, 1.0);

  EXPECT_TRUE(deputy.said["thruster"].empty());
  std::int64_t now_ns = kEpoch_ns + 5400 * kSecond_ns;
  ASSERT_EQ(deputy.input("command", now_ns, command(FORMATION_RECONFIGURE, 100, end_ns)),
            ORRERY_OK);
  for (int k = 0; k < 100 && deputy.said["thruster"].empty(); ++k) {
    ASSERT_GT(deputy.tick_ns, now_ns);
    now_ns = deputy.tick_ns;
    deputy.tick(now_ns);
  }
  ASSERT_FALSE(deputy.said["thruster"].empty());
  double dv_ECI[3];
  orrery_get_thruster(deputy.said["thruster"][0].data(), &t_ns, dv_ECI);
  EXPECT_GE(t_ns - now_ns, 20 * kSecond_ns);
}

TEST_F(FormationKeepingTest, ARebootResumesTheLastCommand) {
  ASSERT_EQ(deputy.boot("role=deputy"), ORRERY_OK);
  ASSERT_EQ(deputy.input("command", kEpoch_ns, command(FORMATION_RECONFIGURE, 100, end_ns)),
            ORRERY_OK);
  ASSERT_EQ(deputy.boot("role=deputy", kEpoch_ns + kSecond_ns, 1), ORRERY_OK);
  EXPECT_THAT(deputy.logged, testing::HasSubstr("resumed the last command"));
  // A torn store is no command.
  deputy.stored.resize(30);
  deputy.logged.clear();
  ASSERT_EQ(deputy.boot("role=deputy", kEpoch_ns + 2 * kSecond_ns, 2), ORRERY_OK);
  EXPECT_THAT(deputy.logged, testing::Not(testing::HasSubstr("resumed")));
}

}  // namespace
}  // namespace formation_keeping
