// The wire against a real library in a process of its own, and against targets that break its
// rules.

#include <orrery/harness/remote/remote_flight.hpp>

#include <gmock/gmock.h>

#include <orrery_flight.h>
#include <orrery_messages.h>
#include <orrery_wire.h>
#include <string>

namespace orrery {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint32_t kDo = 1, kSay = 7;

ByteBuffer bytes_of(std::string_view text) {
  const Bytes bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}
std::string text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
ByteBuffer order(char what, std::int64_t argument) {
  ByteBuffer order(9);
  order[0] = static_cast<std::byte>(what);
  orrery_put_i64(reinterpret_cast<unsigned char*>(order.data() + 1), argument);
  return order;
}

TargetAddress served(const std::string& how = "") {
  return parse_target_address("exec:" TARGET_PROGRAM " " SUBJECT_LIBRARY + how);
}

std::vector<std::string> said(const TargetAnswer& answer) {
  std::vector<std::string> texts;
  for (const TargetAnswer::Message& message : answer.outputs) {
    if (message.number == kSay) texts.push_back(text_of(answer.of(message)));
  }
  return texts;
}

struct RemoteFlightTest : testing::Test {
  RemoteFlight target{served(), 20s};
  const TargetAnswer& create(const RemoteFlight::Boot& boot = {
                                 .spacecraft = "dsc", .process = "gnc", .storage_bytes = 1000}) {
    return target.create(5, boot);
  }
  const TargetAnswer& tell(std::string_view text, std::int64_t now_ns = 10) {
    return target.input(now_ns, kDo, bytes_of(text));
  }
};

TEST_F(RemoteFlightTest, HelloTellsTheLibraryAndItsPorts) {
  const TargetHello& hello = target.hello();
  EXPECT_EQ(hello.name, "subject");
  EXPECT_GT(hello.largest_payload_bytes, 1'000'000u);
  ASSERT_EQ(hello.ports.size(), 4u);
  EXPECT_EQ(hello.ports[0].name, "do");
  EXPECT_EQ(hello.ports[1].kind, ORRERY_STREAM);
  EXPECT_EQ(hello.ports[2].direction, ORRERY_OUT);
  EXPECT_EQ(hello.ports[3].id, 8u);
  EXPECT_EQ(hello.ports[3].max_bytes, 64u);
}

TEST_F(RemoteFlightTest, CreateBringsTheBootRecord) {
  const TargetAnswer& answer = create({.spacecraft = "dsc",
                                       .process = "gnc",
                                       .boot_count = 3,
                                       .reset_cause = ORRERY_WATCHDOG,
                                       .config = "say it"});
  EXPECT_EQ(answer.status, ORRERY_OK);
  const std::string record("\3\0\0\0\2\0\0\0", 8);
  EXPECT_THAT(said(answer), ElementsAre(record, "dsc", "gnc", "say it"));
  ASSERT_EQ(answer.outputs.size(), 5u);
  EXPECT_EQ(orrery_get_i64(
                reinterpret_cast<const unsigned char*>(answer.of(answer.outputs[4]).data() + 1)),
            5);
}

TEST_F(RemoteFlightTest, OutputsStatusAndLogsComeBack) {
  create();
  EXPECT_THAT(said(tell("ehello")), ElementsAre("hello"));
  EXPECT_THAT(said(tell("e")), ElementsAre(""));
  const TargetAnswer& logged = tell(std::string_view("lcareful\0", 9));
  ASSERT_EQ(logged.logs.size(), 1u);
  EXPECT_EQ(logged.logs[0].number, std::uint32_t{ORRERY_WARNING});
  EXPECT_EQ(text_of(logged.of(logged.logs[0])), "careful");
  EXPECT_EQ(tell("no such order").status, ORRERY_OK);
  EXPECT_EQ(target.input(10, kDo, order('?', -100)).status, ORRERY_FATAL);
  EXPECT_EQ(target.input(10, kDo, {}).status, ORRERY_REJECTED);
  // What its own host refuses, the target refuses without asking.
  EXPECT_THAT(said(tell("u")), ElementsAre("\xFF\xFE"));
}

TEST_F(RemoteFlightTest, ATickIsPendingUntilItIsDeliveredOrReplaced) {
  EXPECT_EQ(create().pending_tick_ns, -1);
  EXPECT_EQ(target.input(10, kDo, order('q', 700)).pending_tick_ns, 700);
  EXPECT_TRUE(target.input(10, kDo, order('q', 700)).asked_for_tick);
  EXPECT_EQ(tell("e").pending_tick_ns, 700);
  EXPECT_FALSE(tell("e").asked_for_tick);
  EXPECT_EQ(target.input(20, kDo, order('Q', 900)).pending_tick_ns, 900);
  EXPECT_EQ(target.tick(900).pending_tick_ns, -1);
  EXPECT_EQ(target.input(20, kDo, order('q', -5)).pending_tick_ns, -1);
}

TEST_F(RemoteFlightTest, SlotsTravelWithCreateAndStoresComeBack) {
  const std::vector<std::pair<std::uint32_t, ByteBuffer>> slots = {{4, bytes_of("four")},
                                                                   {9, bytes_of("")}};
  create({.spacecraft = "dsc", .process = "gnc", .storage_bytes = 20, .slots = &slots});
  EXPECT_THAT(said(tell("y\4")), ElementsAre("four"));
  EXPECT_THAT(said(tell("y\x9")), ElementsAre(""));
  EXPECT_EQ(tell("y\5").status, ORRERY_NOT_FOUND);

  const TargetAnswer& stored = tell("w\4other");
  ASSERT_EQ(stored.stores.size(), 1u);
  EXPECT_EQ(stored.stores[0].number, 4u);
  EXPECT_EQ(text_of(stored.of(stored.stores[0])), "other");
  EXPECT_THAT(said(tell("y\4")), ElementsAre("other"));

  // 5 bytes are in slot 4, so 15 are left, and 20 if that slot is the one.
  EXPECT_EQ(tell("w\6sixteen bytes...").status, ORRERY_TOO_SMALL);
  EXPECT_EQ(tell("y\6").status, ORRERY_NOT_FOUND);
  EXPECT_EQ(tell("w\6fifteen bytes..").status, ORRERY_OK);
  EXPECT_EQ(tell("w\4other").status, ORRERY_OK);
  EXPECT_EQ(tell("w\4others").status, ORRERY_TOO_SMALL);
  EXPECT_THAT(said(tell("y\6")), ElementsAre("fifteen bytes.."));
}

TEST_F(RemoteFlightTest, ItsClockSaysWhatACallCost) {
  create();
  const TargetAnswer& answer = tell("e");
  EXPECT_EQ(answer.cost_unit, std::uint32_t{ORRERY_WU_NS});
  EXPECT_GT(answer.cost, 0u);
}

TEST_F(RemoteFlightTest, DestroyEndsItInOrder) {
  create();
  EXPECT_EQ(target.destroy(99).status, ORRERY_OK);
  try {
    tell("e");
    FAIL() << "a call after destroy";
  } catch (const TargetLost& lost) {
    EXPECT_THAT(lost.what(), HasSubstr("ended with exit status 0"));
  }
}

TEST_F(RemoteFlightTest, ACrashOfFlightCodeIsNamed) {
  create();
  try {
    tell("!a");
    FAIL() << "an abort was survived";
  } catch (const TargetLost& lost) {
    EXPECT_THAT(lost.what(), AllOf(HasSubstr(SUBJECT_LIBRARY), HasSubstr("ended by signal 6")));
  }
}

TEST_F(RemoteFlightTest, ARequestThatTheTargetCannotHoldIsNotSent) {
  const std::string config(target.hello().largest_payload_bytes, 'x');
  EXPECT_THROW(create({.spacecraft = "dsc", .process = "gnc", .config = config}), TargetLost);
}

TEST(RemoteFlight, UnixAndTcpServeOneClientAfterAnother) {
  const std::string path = testing::TempDir() + "orrery_target.socket";
  // The listener lives as long as this link to its standard output does.
  const std::string command = TARGET_PROGRAM " " SUBJECT_LIBRARY " --unix " + path;
  TargetLink listener(parse_target_address("exec:" + command), 20s);
  for (int client = 0; client < 3; ++client) {
    RemoteFlight target(parse_target_address("unix:" + path), 20s);
    target.create(0, {.spacecraft = "dsc", .process = "gnc", .storage_bytes = 100});
    EXPECT_THAT(said(target.input(1, kDo, bytes_of("ehello"))), ElementsAre("hello"));
    // Each finds the library as it was linked: nothing is kept of the client before.
    EXPECT_EQ(target.input(2, kDo, order('P', 1000)).pending_tick_ns, 1002);
  }
}

// What each of them does is in bad_target.c.
struct BadTarget {
  const char* way;
  const char* told;
};
void PrintTo(const BadTarget& bad, std::ostream* out) {
  *out << bad.way;
}
struct BadTargetTest : testing::TestWithParam<BadTarget> {};

TEST_P(BadTargetTest, IsNamedAndHarmsNothing) {
  const std::string way = GetParam().way;
  const auto fly = [&] {
    RemoteFlight target(parse_target_address("exec:" BAD_TARGET " '" + way + "'"),
                        way == "endless" ? 60s : 1s);
    target.create(0, {.spacecraft = "dsc", .process = "gnc", .storage_bytes = 100});
    target.tick(1);
  };
  try {
    fly();
    FAIL() << "nothing was noticed";
  } catch (const TargetLost& lost) {
    EXPECT_THAT(lost.what(), AllOf(HasSubstr(BAD_TARGET), HasSubstr(GetParam().told)));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Ways, BadTargetTest,
    testing::Values(BadTarget{"killed", "ended by signal 9"},
                    BadTarget{"exits", "ended with exit status 3"},
                    BadTarget{"stopped", "did not answer within 1"},
                    BadTarget{"silent", "did not answer within 1"},
                    BadTarget{"late", "did not answer within 1"},
                    BadTarget{"half a frame", "did not answer within 1"},
                    BadTarget{"garbage", "sent bytes that begin no frame"},
                    BadTarget{"version", "sent frames of ABI version 2; this program speaks 1"},
                    BadTarget{"short hello", "sent a HELLO that ends too early"},
                    BadTarget{"endless hello", "sent a HELLO of 4294967280 bytes"},
                    BadTarget{"no hello", "sent frame 20 for HELLO"},
                    BadTarget{"header crc", "sent a header whose CRC is wrong"},
                    BadTarget{"payload crc", "sent a payload whose CRC is wrong"},
                    BadTarget{"wrong sequence", "sent an answer to request 2 where 1 is open"},
                    BadTarget{"unknown type", "sent frame 99 before DONE"},
                    BadTarget{"unknown port", "sent a message on output port 8"},
                    BadTarget{"too large", "sent 17 bytes where 16 are allowed"},
                    BadTarget{"huge", "sent 2147483647 bytes where 16 are allowed"},
                    BadTarget{"twice", "sent an answer to request 1 where 2 is open"},
                    BadTarget{"endless", "1000000 messages in one call"}),
    [](const auto& test) {
      std::string name = test.param.way;
      std::erase(name, ' ');
      return name;
    });

TEST(TargetAddress, IsReadAsItIsWritten) {
  for (const char* text : {"exec:./host lib.so --x", "unix:/tmp/a:b", "tcp:10.0.0.5:5000",
                           "serial:/dev/ttyUSB0:115200"}) {
    EXPECT_EQ(to_string(parse_target_address(text)), text);
  }
  EXPECT_EQ(parse_target_address("tcp:board.local:5000").port, 5000u);
}

TEST(TargetAddress, AnotherTextIsRefusedWithWhatIsAllowed) {
  for (const char* text :
       {"", "exec:", "tcp:host", "tcp:host:", "tcp::5", "tcp:host:0", "tcp:host:65536",
        "tcp:host:5x", "serial:/dev/x:fast", "udp:host:5", "exec"}) {
    try {
      parse_target_address(text);
      FAIL() << text;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("target \"" + std::string(text) + "\""),
                                      HasSubstr("serial:DEVICE:BAUD")));
    }
  }
}

TEST(RemoteFlight, WhatIsNotThereIsNamed) {
  const auto message = [](const char* where) -> std::string {
    try {
      RemoteFlight(parse_target_address(where), 100ms);
    } catch (const TargetLost& lost) {
      return lost.what();
    }
    return "";
  };
  EXPECT_THAT(message("exec:/nowhere/at/all"), HasSubstr("ended with exit status 127"));
  EXPECT_THAT(message("unix:/nowhere/at/all"),
              HasSubstr("cannot reach unix:/nowhere/at/all: No such file"));
  EXPECT_THAT(message("tcp:127.0.0.1:1"), HasSubstr("Connection refused"));
  EXPECT_THAT(message("serial:/nowhere:9600"), HasSubstr("No such file"));
}

}  // namespace
}  // namespace orrery
