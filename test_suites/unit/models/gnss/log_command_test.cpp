#include <orrery/models/gnss/log_command.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace orrery::novatel {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr SimTime kStart = from_ns(2358 * 604'800'000'000'000LL);
constexpr Header kHeader{.t = kStart};

ByteBuffer bytes_of(std::string_view text) {
  const Bytes bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::string text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

struct Receiver {
  LogSchedule schedule;
  LogCommandReader reader{schedule, 1s};

  ByteBuffer answer(const ByteBuffer& command, std::size_t chunk = 4096) {
    ByteBuffer out;
    for (std::size_t at = 0; at < command.size(); at += chunk) {
      const std::size_t n = std::min(chunk, command.size() - at);
      reader.take(Bytes(command).subspan(at, n), kHeader, out);
    }
    return out;
  }
  std::string say(std::string_view text) { return text_of(answer(bytes_of(text))); }
  // Messages due at second `s` of the week.
  std::vector<int> due(int s) {
    std::vector<int> ids;
    for (const DueLog& log : schedule.due(kStart + std::chrono::seconds(s))) {
      ids.push_back(log.message_id);
    }
    return ids;
  }
};

// As the receivers of the reference logs answer: novatel/OneEach.GPS holds these bytes between
// logs.
constexpr const char* kOk = "\r\n<OK\r\n[COM1]";

TEST(LogCommandTest, LogOnTimeIsAnsweredAndScheduled) {
  Receiver receiver;
  EXPECT_EQ(receiver.say("LOG COM1 RANGEB ONTIME 10\r\n"), kOk);
  EXPECT_THAT(receiver.due(0), ElementsAre(43));
  EXPECT_THAT(receiver.due(5), IsEmpty());
  EXPECT_THAT(receiver.due(10), ElementsAre(43));
  EXPECT_EQ(receiver.reader.accepted(), 1u);
  EXPECT_EQ(receiver.reader.refused(), 0u);
}

TEST(LogCommandTest, PortTriggerAndCaseAreOptional) {
  for (const char* command : {"log rangeb\r", "LOG RANGEB ONCE\n", "Log ThisPort RangeB Once 0 0\n",
                              "  LOG\tCOM1  RANGEB  \r\n"}) {
    Receiver receiver;
    EXPECT_EQ(receiver.say(command), kOk) << command;
    EXPECT_THAT(receiver.due(0), ElementsAre(43)) << command;
    EXPECT_THAT(receiver.due(1), IsEmpty()) << command;
  }
}

TEST(LogCommandTest, OffsetAndHoldAreTaken) {
  Receiver receiver;
  receiver.say("LOG BESTPOSB ONTIME 60 1 HOLD\nLOG TIMEB ONTIME 1\nUNLOGALL\n");
  EXPECT_THAT(receiver.due(60), IsEmpty());
  EXPECT_THAT(receiver.due(61), ElementsAre(42));
  EXPECT_EQ(receiver.say("UNLOGALL ALL_PORTS TRUE\n"), kOk);
  EXPECT_THAT(receiver.due(121), IsEmpty());
}

TEST(LogCommandTest, UnlogRemovesWhatIsActiveOnly) {
  Receiver receiver;
  receiver.say("LOG RANGEB ONTIME 1\nLOG RAWEPHEMB ONCHANGED\n");
  EXPECT_EQ(receiver.say("UNLOG COM1 RANGEB\n"), kOk);
  EXPECT_THAT(receiver.due(0), ElementsAre(41));
  EXPECT_EQ(receiver.say("UNLOG RANGEB\n"), "\r\n<ERROR:Requested log does not exist\r\n[COM1]");
}

TEST(LogCommandTest, EveryLogOfTheEncoderCanBeAskedFor) {
  Receiver receiver;
  receiver.say(
      "LOG RANGEB\nLOG RANGECMPB\nLOG BESTXYZB\nLOG BESTPOSB\nLOG TIMEB\nLOG RAWEPHEMB\n"
      "LOG GPSEPHEMB\nLOG IONUTCB\nLOG ALMANACB\nLOG VERSIONB\n");
  EXPECT_THAT(receiver.due(0), ElementsAre(43, 140, 241, 42, 101, 41, 7, 8, 73, 37));
}

// Body of binary LOG, field by field as the manual's table has it; `format` is bits 5-6.
ByteBuffer binary_log(std::uint32_t port, std::uint16_t id, std::uint32_t trigger, double period_s,
                      double offset_s = 0, std::uint32_t hold = 0, int format = 0) {
  ByteBuffer body(32);
  const auto type = static_cast<std::int8_t>(format << 5);
  std::memcpy(&body[0], &port, 4);
  std::memcpy(&body[4], &id, 2);
  std::memcpy(&body[6], &type, 1);
  std::memcpy(&body[8], &trigger, 4);
  std::memcpy(&body[12], &period_s, 8);
  std::memcpy(&body[20], &offset_s, 8);
  std::memcpy(&body[28], &hold, 4);
  return body;
}

ByteBuffer framed(std::uint16_t id, const ByteBuffer& body) {
  ByteBuffer out;
  append_frame({.message_id = id, .t = kStart}, body, out);
  return out;
}

// Response: the command's id, bit 7 of the message type, then the number and the text.
void expect_response(const ByteBuffer& frame, std::uint16_t id, std::uint32_t number,
                     std::string_view text) {
  ASSERT_EQ(frame.size(), 28 + 4 + text.size() + 4);
  EXPECT_EQ(crc32(frame), 0u);
  EXPECT_EQ(std::to_integer<int>(frame[4]), id);
  EXPECT_EQ(frame[6], std::byte{0x80});
  EXPECT_EQ(std::to_integer<std::uint32_t>(frame[28]), number);
  EXPECT_EQ(text_of(Bytes(frame).subspan(32, text.size())), text);
}

TEST(LogCommandTest, BinaryLogIsAnsweredInBinary) {
  Receiver receiver;
  expect_response(receiver.answer(framed(1, binary_log(192, 43, 2, 2.0, 1.0))), 1, 1, "OK");
  EXPECT_THAT(receiver.due(0), IsEmpty());
  EXPECT_THAT(receiver.due(1), ElementsAre(43));
}

TEST(LogCommandTest, BinaryUnlogAndUnlogAll) {
  Receiver receiver;
  receiver.say("LOG RANGEB ONTIME 1\nLOG TIMEB ONTIME 1\nLOG BESTXYZB ONTIME 1 0 HOLD\n");
  const ByteBuffer unlog = bytes_of(std::string_view("\x20\0\0\0\x2b\0\0\0", 8));
  expect_response(receiver.answer(framed(36, unlog)), 36, 1, "OK");
  EXPECT_THAT(receiver.due(0), ElementsAre(101, 241));
  const ByteBuffer all_ports = bytes_of(std::string_view("\x08\0\0\0", 4));
  expect_response(receiver.answer(framed(38, all_ports)), 38, 1, "OK");
  EXPECT_THAT(receiver.due(1), ElementsAre(241));
  const ByteBuffer held = bytes_of(std::string_view("\x08\0\0\0\1\0\0\0", 8));
  expect_response(receiver.answer(framed(38, held)), 38, 1, "OK");
  EXPECT_THAT(receiver.due(2), IsEmpty());
}

TEST(LogCommandTest, CutsOfTheStreamMeanNothing) {
  const ByteBuffer binary = framed(1, binary_log(32, 41, 1, 0));
  ByteBuffer stream = bytes_of("LOG RANGEB ONTIME 1\r\n");
  stream.insert(stream.end(), binary.begin(), binary.end());
  for (const char c : std::string("UNLOG TIMEB\r\n")) stream.push_back(static_cast<std::byte>(c));
  Receiver whole;
  const ByteBuffer expected = whole.answer(stream);
  for (std::size_t chunk = 1; chunk < stream.size(); ++chunk) {
    Receiver receiver;
    ASSERT_EQ(receiver.answer(stream, chunk), expected) << chunk;
    ASSERT_EQ(receiver.reader.accepted(), 2u);
    ASSERT_EQ(receiver.reader.refused(), 1u);
  }
}

TEST(LogCommandTest, ADamagedFrameIsCountedAndDoesNotHideTheNext) {
  ByteBuffer damaged = framed(1, binary_log(32, 43, 2, 1));
  damaged[35] ^= std::byte{1};
  Receiver receiver;
  for (const char c : std::string("\xAA\x44\nLOG TIMEB\n")) {
    damaged.push_back(static_cast<std::byte>(c));
  }
  receiver.answer(damaged);
  EXPECT_THAT(receiver.due(0), ElementsAre(101));
  EXPECT_GE(receiver.reader.refused(), 1u);
}

struct Refusal {
  const char* command;
  const char* response;
  const char* why;
};

class LogCommandRefusalTest : public testing::TestWithParam<Refusal> {};

TEST_P(LogCommandRefusalTest, IsAnsweredAndNamesValueAndRange) {
  Receiver receiver;
  EXPECT_EQ(receiver.say(std::string(GetParam().command) + "\r\n"),
            "\r\n<ERROR:" + std::string(GetParam().response) + "\r\n[COM1]");
  EXPECT_THAT(receiver.reader.last_refusal(), HasSubstr(GetParam().why));
  EXPECT_THAT(receiver.reader.last_refusal(), HasSubstr(GetParam().command));
  EXPECT_EQ(receiver.reader.refused(), 1u);
  EXPECT_EQ(receiver.schedule.size(), 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Commands, LogCommandRefusalTest,
    testing::Values(
        Refusal{"FRESET", "Invalid Message ID", "accepted: LOG, UNLOG, UNLOGALL"},
        Refusal{"#LOGA,COM1", "Invalid Message ID", "accepted: LOG"},
        Refusal{"LOG", "Message missing field", "no log is named"},
        Refusal{"UNLOG", "Message missing field", "no log is named"},
        Refusal{"LOG BESTGPSB", "Invalid Message. Field = BESTGPSB", "accepted: RANGEB RANGECMPB"},
        Refusal{"LOG RANGE ONTIME 1", "Invalid Message. Field = RANGE", "accepted: RANGEB"},
        Refusal{"LOG RANGEA ONTIME 1", "Invalid Message. Field = RANGEA", "log RANGEA"},
        Refusal{"LOG COM2 RANGEB ONTIME 1", "Invalid Message. Field = COM2", "accepted: COM1"},
        Refusal{"LOG ALL_PORTS RANGEB", "Invalid Message. Field = ALL_PORTS", "port ALL_PORTS"},
        Refusal{"LOG RANGEB ONCHANGED", "Trigger ONCHANGED not valid for this log",
                "accepted: ONTIME, ONCE"},
        Refusal{"LOG RAWEPHEMB ONNEW", "Trigger ONNEW not valid for this log",
                "accepted: ONTIME, ONCE, ONCHANGED"},
        Refusal{"LOG RANGEB EVERY 1", "Invalid Message. Field = EVERY", "trigger EVERY"},
        Refusal{"LOG RANGEB ONTIME", "parameter 4 is out of range", "period 0 s"},
        Refusal{"LOG RANGEB ONTIME 0.5", "parameter 4 is out of range",
                "period 0.5 s; accepted: multiples of 1 s up to 86400 s"},
        Refusal{"LOG RANGEB ONTIME -1", "parameter 4 is out of range", "period -1 s"},
        Refusal{"LOG RANGEB ONTIME NAN", "parameter 4 is out of range", "period nan s"},
        Refusal{"LOG RANGEB ONTIME 1E99", "parameter 4 is out of range", "1e+99"},
        Refusal{"LOG RANGEB ONTIME 1S", "Invalid Message. Field = 1S", "period 1S"},
        Refusal{"LOG RANGEB ONTIME 2 2", "parameter 5 is out of range",
                "offset 2 s; accepted: multiples of 1 s below the period"},
        Refusal{"LOG RANGEB ONTIME 2 0.5", "parameter 5 is out of range", "offset 0.5 s"},
        Refusal{"LOG RANGEB ONTIME 2 1 KEEP", "Invalid Message. Field = KEEP", "HOLD, NOHOLD"},
        Refusal{"LOG RANGEB ONTIME 2 1 HOLD X", "Invalid Message. Field = X", "too many"},
        Refusal{"UNLOG COM9 RANGEB", "Invalid Message. Field = COM9", "accepted: COM1"},
        Refusal{"UNLOGALL COM1 MAYBE", "Invalid Message. Field = MAYBE", "FALSE, TRUE"}));

TEST(LogCommandTest, BinaryRefusalsCarryTheManualsNumbers) {
  Receiver receiver;
  const auto refused = [&](std::uint16_t id, const ByteBuffer& body, std::uint32_t number,
                           std::string_view text) {
    expect_response(receiver.answer(framed(id, body)), id, number, text);
  };
  refused(1, binary_log(64, 43, 2, 1), 7, "Invalid Message. Field = 1");           // COM2
  refused(1, binary_log(32, 43, 2, 1, 0, 0, 1), 7, "Invalid Message. Field = 3");  // ASCII
  refused(1, binary_log(32, 99, 2, 1), 2, "Requested log does not exist");         // BESTVEL
  refused(1, binary_log(32, 43, 0, 1), 14, "Trigger ONNEW not valid for this log");
  refused(1, binary_log(32, 43, 77, 1), 14, "Trigger 77 not valid for this log");
  refused(1, binary_log(32, 43, 2, std::nan("")), 11, "parameter 4 is out of range");
  refused(1, ByteBuffer(31), 9, "Message missing field");
  refused(36, ByteBuffer(7), 9, "Message missing field");
  refused(20, {}, 6, "Invalid Message ID");
  EXPECT_EQ(receiver.reader.accepted(), 0u);
  EXPECT_EQ(receiver.reader.refused(), 9u);
  EXPECT_EQ(receiver.schedule.size(), 0u);
}

TEST(LogCommandTest, EndlessLinesAreRefusedAndNotHeld) {
  Receiver receiver;
  const std::string answers = receiver.say(std::string(1000, 'A'));
  EXPECT_EQ(answers, "\r\n<ERROR:Invalid Message ID\r\n[COM1]");
  EXPECT_THAT(receiver.reader.last_refusal(), HasSubstr("more than 255 characters"));
  EXPECT_EQ(receiver.say("\r\nLOG TIMEB\r\n"), kOk);
}

TEST(LogCommandTest, EpochsMustBePositive) {
  LogSchedule schedule;
  EXPECT_THAT([&] { LogCommandReader reader(schedule, 0ns); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("epochs = 0 s")));
}

}  // namespace
}  // namespace orrery::novatel
