// Bytes to and from a target: waits end, whoever it is, and a command shares its caller's core.

#include <orrery/harness/remote/target_link.hpp>

#include <gmock/gmock.h>

#include <fstream>
#include <orrery_crc32_sliced.h>
#include <random>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

namespace orrery {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

TargetAddress command(const std::string& text) {
  return parse_target_address("exec:" + text);
}

template <class Act>
std::string why_lost(const Act& act) {
  try {
    act();
  } catch (const TargetLost& lost) {
    return lost.what();
  }
  return "nothing was lost";
}

TEST(TargetLink, ACommandEchoesMoreThanAPipeHolds) {
  TargetLink link(command("cat"), 20s);
  ByteBuffer sent(40'000), heard(sent.size());
  for (int round = 0; round < 5; ++round) {
    for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::byte>(i * 7 + i / 251);
    link.begin_exchange();
    link.write(sent);
    link.read(heard.data(), heard.size());
    EXPECT_EQ(heard, sent);
  }
}

TEST(TargetLink, ACommandThatReadsNothingIsGivenUp) {
  TargetLink link(command("sleep 1000"), 200ms);
  EXPECT_THAT(why_lost([&] { link.write(ByteBuffer(1'000'000)); }),
              HasSubstr("did not answer within 200"));
}

TEST(TargetLink, ACommandThatEndsWhileItIsWrittenToIsNamed) {
  TargetLink link(command("sh -c 'sleep 0.1; exit 7'"), 20s);
  EXPECT_THAT(why_lost([&] { link.write(ByteBuffer(1'000'000)); }),
              HasSubstr("ended with exit status 7"));
}

TEST(TargetLink, ACommandThatSaysNothingIsGivenUpAgainAndAgain) {
  TargetLink link(command("sleep 1000"), 100ms);
  for (int i = 0; i < 2; ++i) {
    std::byte heard{};
    link.begin_exchange();
    EXPECT_THAT(why_lost([&] { link.read(&heard, 1); }), HasSubstr("did not answer within 100"));
  }
}

TEST(TargetLink, WhatAnEarlierExchangeTookIsNotMissingInTheNext) {
  // Two exchanges of two thirds of the patience each.
  TargetLink link(command("sh -c 'sleep 0.4; echo a; sleep 0.4; echo b; sleep 1000'"), 600ms);
  std::byte heard[2];
  for (int i = 0; i < 2; ++i) {
    link.begin_exchange();
    link.read(heard, 2);
    EXPECT_EQ(static_cast<char>(heard[0]), "ab"[i]);
  }
}

// First nothing at all, then a byte where two are wanted.
TEST(TargetLink, ASocketThatSaysTooLittleIsGivenUp) {
  for (const int said : {0, 1}) {
    int ends[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    TargetLink link(ends[0], 100ms);
    ASSERT_EQ(::write(ends[1], "x", static_cast<std::size_t>(said)), said);
    std::byte heard[2];
    EXPECT_THAT(why_lost([&] { link.read(heard, 2); }), HasSubstr("did not answer within 100"));
    close(ends[1]);
  }
}

TEST(TargetLink, ASocketThatReadsNothingOrIsClosedIsNamed) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
  TargetLink link(ends[0], 100ms);
  EXPECT_THAT(why_lost([&] { link.write(ByteBuffer(4'000'000)); }),
              HasSubstr("did not answer within 100"));
  close(ends[1]);
  EXPECT_THAT(why_lost([&] { link.write(ByteBuffer(10)); }), HasSubstr("closed the link"));
}

// ---- one core

cpu_set_t cores_of(pid_t process) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  EXPECT_EQ(sched_getaffinity(process, sizeof cores, &cores), 0);
  return cores;
}

std::vector<pid_t> children() {
  std::ifstream list("/proc/self/task/" + std::to_string(getpid()) + "/children");
  std::vector<pid_t> found;
  for (pid_t child = 0; list >> child;) found.push_back(child);
  return found;
}

void exchange(TargetLink& link) {
  std::byte byte{};
  link.begin_exchange();
  link.write(Bytes(&byte, 1));
  link.read(&byte, 1);
}

struct TargetLinkCoreTest : testing::Test {
  const cpu_set_t before = cores_of(0);
  void SetUp() override {
    if (CPU_COUNT(&before) < 2) GTEST_SKIP() << "there is one core only";
  }
  void expect_free() {
    const cpu_set_t now = cores_of(0);
    EXPECT_TRUE(CPU_EQUAL(&now, &before));
  }
};

TEST_F(TargetLinkCoreTest, CommandsRunOnTheCoreOfTheirCaller) {
  {
    TargetLink one(command("cat"), 20s), other(command("cat"), 20s);
    for (int i = 0; i < 3; ++i) {
      exchange(one);
      exchange(other);
    }
    const cpu_set_t here = cores_of(0);
    EXPECT_EQ(CPU_COUNT(&here), 1);
    ASSERT_EQ(children().size(), 2u);
    for (const pid_t child : children()) {
      const cpu_set_t there = cores_of(child);
      EXPECT_TRUE(CPU_EQUAL(&here, &there));
    }
  }
  expect_free();
}

TEST_F(TargetLinkCoreTest, ACommandThatChoosesItsCoresKeepsThem) {
  std::string all;
  for (int core = 0; core < CPU_SETSIZE; ++core) {
    if (CPU_ISSET(core, &before)) all += (all.empty() ? "" : ",") + std::to_string(core);
  }
  TargetLink link(command("taskset -c " + all + " cat"), 20s);
  ASSERT_EQ(children().size(), 1u);
  const auto chosen = [&, child = children().front()] {
    const cpu_set_t there = cores_of(child);
    return CPU_EQUAL(&there, &before) != 0;
  };
  for (int i = 0; i < 5000 && !chosen(); ++i) usleep(1000);
  exchange(link);
  exchange(link);
  expect_free();
  EXPECT_TRUE(chosen());
}

TEST_F(TargetLinkCoreTest, AnotherThreadMayEndALink) {
  auto link = std::make_unique<TargetLink>(command("cat"), 20s);
  std::thread([&] {
    exchange(*link);
    link.reset();
  }).join();
  expect_free();
}

// ---- against the CRC that takes a nibble at a time

TEST(Crc32Sliced, IsTheCrc32OfEveryLength) {
  orrery_crc32_tables tables;
  orrery_crc32_fill(&tables);
  const auto* digits = reinterpret_cast<const unsigned char*>("123456789");
  EXPECT_EQ(orrery_crc32_sliced(&tables, digits, 9), 0xCBF43926u);
  std::mt19937 random(1);
  unsigned char data[70];
  for (unsigned char& byte : data) byte = static_cast<unsigned char>(random());
  for (std::size_t from = 0; from < 4; ++from) {
    for (std::size_t bytes = 0; bytes <= 64; ++bytes) {
      EXPECT_EQ(orrery_crc32_sliced(&tables, data + from, bytes), orrery_crc32(data + from, bytes));
    }
  }
}

}  // namespace
}  // namespace orrery
