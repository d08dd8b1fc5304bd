// Bytes to and from a target: waits end, whoever it is, and a command shares its caller's core.

#include <orrery/harness/remote/target_link.hpp>

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <orrery_crc32_sliced.h>
#include <orrery_messages.h>
#include <random>
#include <sched.h>
#include <sys/socket.h>
#include <sys/wait.h>
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

// ---- memory beside the pipes (mailbox_target.c)

// Says to links of this thread that they have their core to themselves, or have not.
struct TargetLinkMailboxTest : testing::Test {
  void TearDown() override { SharedCore::of_this_thread()->assume_to_itself({}); }
  static void to_themselves(bool is) { SharedCore::of_this_thread()->assume_to_itself(is); }

  /// Sends that many bytes, hears them again. How many requests came through memory so far.
  static std::uint32_t echo(TargetLink& link, std::uint32_t bytes) {
    ByteBuffer sent(4 + bytes), heard(4 + bytes);
    orrery_put_u32(reinterpret_cast<unsigned char*>(sent.data()), bytes);
    for (std::size_t i = 4; i < sent.size(); ++i) sent[i] = static_cast<std::byte>(i * 7 + i / 251);
    link.begin_exchange();
    link.write(sent);
    link.read(heard.data(), heard.size());
    EXPECT_TRUE(std::equal(sent.begin() + 4, sent.end(), heard.begin() + 4)) << bytes;
    return orrery_get_u32(reinterpret_cast<const unsigned char*>(heard.data()));
  }
  static char greeting(TargetLink& link) {
    std::byte heard{};
    link.read(&heard, 1);
    return static_cast<char>(heard);
  }
};

TEST_F(TargetLinkMailboxTest, WhatFitsGoesThroughMemoryAndTheRestThroughThePipes) {
  to_themselves(true);
  TargetLink link(command(MAILBOX_TARGET), 20s);
  ASSERT_EQ(greeting(link), 'm');
  std::uint32_t boxed = 0;
  for (const std::uint32_t bytes : {1, 2, 1000, 16380, 16381, 300'000, 300'001, 5}) {
    const std::uint32_t now = echo(link, bytes);
    EXPECT_LE(now, boxed + (bytes <= 16380 ? 1 : 0)) << bytes;
    boxed = now;
  }
  // Where others take the core for long, a side may have gone to sleep before it hears.
  for (std::uint32_t i = 0; i < 200; ++i) boxed = echo(link, i % 50);
  EXPECT_GT(boxed, 20u);
}

// Each side finds the other awake, asleep, or just between.
TEST_F(TargetLinkMailboxTest, WhoYieldsMayChangeWithEachExchange) {
  TargetLink link(command(MAILBOX_TARGET), 20s);
  ASSERT_EQ(greeting(link), 'm');
  std::mt19937 random(1);
  for (int i = 0; i < 400; ++i) {
    to_themselves(random() % 2 == 0);
    if (random() % 8 == 0) sched_yield();
    if (random() % 64 == 0) usleep(50);
    const auto any = static_cast<std::uint32_t>(random());
    echo(link, any % 16 == 0 ? any % 40'000 : any % 100);
  }
}

TEST_F(TargetLinkMailboxTest, OnCoresOfTheirOwnTheySeeTheSameBytes) {
  to_themselves(true);
  TargetLink link(command("taskset 0xffff " MAILBOX_TARGET), 20s);
  ASSERT_EQ(greeting(link), 'm');
  for (std::uint32_t i = 0; i < 300; ++i) echo(link, i % 300);
}

TEST_F(TargetLinkMailboxTest, WithPipesOfItsOwnATargetTakesThem) {
  to_themselves(true);
  TargetLink link(command("sh -c 'cat | " MAILBOX_TARGET " | cat'"), 20s);
  EXPECT_EQ(greeting(link), 'p');
  EXPECT_EQ(echo(link, 100), 0u);
}

TEST_F(TargetLinkMailboxTest, WhoeverBreaksIsNamed) {
  for (const bool is : {true, false}) {
    to_themselves(is);
    for (const auto& [way, told] :
         {std::pair("killed", "ended by signal 9"), std::pair("exits", "ended with exit status 3"),
          std::pair("stopped", "did not answer within 200"),
          std::pair("silent", "did not answer within 200"),
          std::pair("lies", "says it holds 16385 bytes"),
          std::pair("scribbles", "ended with exit status 8")}) {
      const bool waits = std::string(told).starts_with("did not answer");
      TargetLink link(command(std::string(MAILBOX_TARGET " ") + way), waits ? 200ms : 20s);
      ASSERT_EQ(greeting(link), 'm');
      echo(link, 1);
      echo(link, 2);
      EXPECT_THAT(why_lost([&] { echo(link, 3), echo(link, 4); }), HasSubstr(told)) << way << is;
    }
  }
}

// A state that only the reader may set, and memory that is to be cut short.
TEST_F(TargetLinkMailboxTest, WhatATargetMayNotDoToItsMemoryHarmsNobody) {
  to_themselves(true);
  for (const char* way : {"forgets", "cuts"}) {
    TargetLink link(command(std::string(MAILBOX_TARGET " ") + way), 20s);
    ASSERT_EQ(greeting(link), 'm');
    for (std::uint32_t i = 0; i < 20; ++i) echo(link, i);
  }
}

// A third one on the same core takes half of it.
TEST_F(TargetLinkMailboxTest, AThirdOnTheirCoreIsSeen) {
  cpu_set_t before, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t third = fork();
  if (third == 0) {
    if (::write(ready[1], "", 1) != 1) _exit(1);
    for (;;) getppid();
  }
  char byte = 0;
  EXPECT_EQ(::read(ready[0], &byte, 1), 1);
  SharedCore core;
  int alone = 0;
  const auto now_ns = [] {
    return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  for (int i = 0; i < 12; ++i) {
    alone += core.has_to_itself(now_ns()) ? 1 : 0;
    for (const std::int64_t end_ns = now_ns() + 11'000'000; now_ns() < end_ns;) continue;
  }
  kill(third, SIGKILL);
  waitpid(third, nullptr, 0);
  close(ready[0]);
  close(ready[1]);
  sched_setaffinity(0, sizeof before, &before);
  EXPECT_LT(alone, 4) << "of 12";
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
