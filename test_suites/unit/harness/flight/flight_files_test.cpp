// Property: flight code that opens files finds those of its spacecraft and no others, in each of
// the ways that C and C++ have, and finds them again after a reset.

#include <orrery/harness/flight/flight_computer.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/heap/interposition.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "orders.hpp"

namespace orrery {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Unix time 1483228800, when GPS - UTC became 18 s; see virtual_services_test.cpp.
constexpr SimTime kStart = from_ns(1'167'264'018 * std::int64_t{1'000'000'000});

FlightProcessOptions options(std::map<std::string, std::string> files) {
  return {.spacecraft = "dsc", .library = "flight_test_files", .files = std::move(files)};
}

std::unique_ptr<FlightProcess> booted(const FlightProcessOptions& o,
                                      std::shared_ptr<NonVolatileMemory> memory = nullptr) {
  auto process = std::make_unique<FlightProcess>(o, std::move(memory));
  process->create(kStart, to_ns(kStart));
  return process;
}

std::string ask(FlightProcess& process, const std::string& question) {
  if (process.input(kStart, to_ns(kStart), process.ports()[0], order(question)) ==
      CallOutcome::kCrashed) {
    return "crashed: " + process.crash().message;
  }
  return text_of(process.output(0).data);
}

std::string content(FlightProcess& process, const std::string& path) {
  const FlightFiles::NodePointer node = process.memory()->files.find(path);
  return node == nullptr ? "none" : text_of(node->content);
}

TEST(FlightFilesTest, DescriptorsStdioAndStreamsReadTheSameFile) {
  const auto process = booted(options({{"/etc/gnc.ini", "17 m\nq\n"}}));
  EXPECT_EQ(ask(*process, "read /etc/gnc.ini"), "\nq\nm 71");
  EXPECT_EQ(ask(*process, "fopen /etc/gnc.ini"), "17 m\nq\n|17|7|1");
  EXPECT_EQ(ask(*process, "ifstream /etc/gnc.ini"), "17 m;q; 7");
  EXPECT_EQ(ask(*process, "read etc/../etc/./gnc.ini"), "\nq\nm 71");
}

TEST(FlightFilesTest, WhatIsWrittenInOneWayIsReadInEach) {
  const auto process = booted(options({{"/data/", ""}}));
  EXPECT_EQ(ask(*process, "write /data/a abc"), "3");
  EXPECT_EQ(ask(*process, "append /data/a def"), "3");
  EXPECT_EQ(content(*process, "/data/a"), "abcdef");
  EXPECT_EQ(ask(*process, "fprintf /data/b 12 x"), "done");
  EXPECT_EQ(ask(*process, "ofstream /data/b y"), "done");
  EXPECT_EQ(content(*process, "/data/b"), "12 x\ny42\n");
  EXPECT_EQ(ask(*process, "fopen /data/b"), "12 x\ny42\n|12|9|1");
  EXPECT_EQ(ask(*process, "create /data/b z"), "errno EEXIST");
}

TEST(FlightFilesTest, FoldersAreMadeListedAndRemoved) {
  const auto process = booted(options({{"/data/log/1", "x"}, {"/data/", ""}}));
  EXPECT_EQ(ask(*process, "mkdir /data/new"), "done");
  EXPECT_EQ(ask(*process, "write /data/new/2 yy"), "2");
  EXPECT_EQ(ask(*process, "list /data"), "log/ new/ ");
  EXPECT_EQ(ask(*process, "walk /data"), "/data/log/ /data/new/ ");
  EXPECT_EQ(ask(*process, "list /"), "data/ ");
  EXPECT_EQ(ask(*process, "stat /data/new/2"), "file 2 1483228800");
  EXPECT_EQ(ask(*process, "stat /data/new"), "folder 0 1483228800");
  EXPECT_EQ(ask(*process, "rmdir /data/new"), "errno ENOTEMPTY");
  EXPECT_EQ(ask(*process, "rename /data/new /data/old"), "done");
  EXPECT_EQ(ask(*process, "exists /data/new/2"), "no");
  EXPECT_EQ(ask(*process, "read /data/old/2"), "yy");
  EXPECT_EQ(ask(*process, "unlink /data/old/2"), "done");
  EXPECT_EQ(ask(*process, "rmdir /data/old"), "done");
  EXPECT_EQ(ask(*process, "unlink /data/old/2"), "errno ENOENT");
  EXPECT_EQ(ask(*process, "unlink /data/log"), "errno EISDIR");
  EXPECT_EQ(ask(*process, "write /data/none/3 z"), "errno ENOENT");
  EXPECT_EQ(process->memory()->files.paths(), std::vector<std::string>{"/data/log/1"});
}

TEST(FlightFilesTest, DescriptorsEndAtFiveHundredAndTwelve) {
  const auto process = booted(options({{"/a", ""}}));
  EXPECT_EQ(ask(*process, "many /a"), "512 errno EMFILE");
}

TEST(FlightFilesTest, AFullMediumIsNoticedByEachWayOfWriting) {
  FlightProcessOptions o = options({{"/data/a", "12345"}});
  o.file_bytes = 8;
  const auto process = booted(o);
  EXPECT_EQ(ask(*process, "append /data/a 678"), "3");
  EXPECT_EQ(ask(*process, "append /data/a 9"), "errno ENOSPC");
  EXPECT_EQ(ask(*process, "fprintf /data/b x"), "errno ENOSPC");
  EXPECT_EQ(ask(*process, "ofstream /data/b x"), "errno ENOSPC");
  EXPECT_EQ(ask(*process, "truncate /data/a"), "done");
  EXPECT_EQ(ask(*process, "fprintf /data/b xyz"), "done");  // 3 + 4 of 8 bytes
  EXPECT_EQ(content(*process, "/data/a"), "123");
}

// The file beside the spacecraft's must be one of the host's, or kHost would show nothing.
TEST(FlightFilesTest, OtherPathsAreRefusedAbsentOrTheHosts) {
  const std::string path = testing::TempDir() + "orrery_flight_files_test";
  std::ofstream(path) << "host";
  FlightProcessOptions o = options({{"/etc/gnc.ini", ""}});
  if (heap_simulation_available()) {
    const auto process = booted(o);
    EXPECT_THAT(ask(*process, "ifstream " + path),
                testing::AllOf(HasSubstr("fopen(\"" + path + "\") called"),
                               HasSubstr("FlightOptions::files")));
    EXPECT_EQ(process->crash().kind, CrashKind::kForbiddenCall);
  }
  o.other_files = OtherFiles::kAbsent;
  const auto absent = booted(o);
  EXPECT_EQ(ask(*absent, "ifstream " + path), "errno ENOENT");
  EXPECT_EQ(ask(*absent, "write " + path + " x"), "errno ENOENT");
  o.other_files = OtherFiles::kHost;
  const auto host = booted(o);
  EXPECT_EQ(ask(*host, "read " + path), "tsoh");
  EXPECT_EQ(ask(*host, "read /etc/gnc.ini"), "");  // still its own
  std::remove(path.c_str());
}

TEST(FlightFilesTest, CopiesOfADescriptorShareTheirOffsetAndFlags) {
  const auto process = booted(options({{"/data/a", "abcdef"}, {"/data/b", "B"}}));
  EXPECT_EQ(ask(*process, "dup /data/a"), "ab|cd|b|c|1|errno EBADF");
  EXPECT_EQ(ask(*process, "dup2 /data/a /data/b"), "abcdef");
  EXPECT_EQ(ask(*process, "fcntl /data/a"), "700 10 append free -1");
  EXPECT_EQ(content(*process, "/data/a"), "abcdef!");
  EXPECT_EQ(ask(*process, "many /data/b"), "512 errno EMFILE");  // all of them were closed
}

TEST(FlightFilesTest, AFileDoesNotTakeTheNumberOfOneOfTheHosts) {
  if (!heap_simulation_available()) GTEST_SKIP() << "under a sanitizer it fails with EPERM";
  const auto process = booted(options({{"/data/a", ""}}));
  EXPECT_THAT(ask(*process, "dup2_to_host /data/a"),
              HasSubstr("dup2(512, 1) called: between a file of this spacecraft (descriptors 512 "
                        "to 1023) and one of the host"));
}

TEST(FlightFilesTest, ListsOfPartsAreReadAndWrittenAsOne) {
  const auto process = booted(options({{"/data/", ""}}));
  EXPECT_EQ(ask(*process, "parts /data/a"), "5|4bc,de|22da5|errno EINVAL|errno EINVAL|errno EBADF");
  EXPECT_EQ(content(*process, "/data/a"), "abcdab");
}

TEST(FlightFilesTest, FilesAreCopiedWithinTheSpacecraftOnly) {
  const auto process = booted(options({{"/data/a", "abcdef"}}));
  EXPECT_EQ(ask(*process, "send /data/a /data/b"), "3 5|6|0|errno EBADF");
  EXPECT_EQ(content(*process, "/data/b"), "cdeabcdef");
  EXPECT_EQ(ask(*process, "copy_file /data/a /data/c"), "done");
  EXPECT_EQ(content(*process, "/data/c"), "abcdef");
  if (!heap_simulation_available()) return;  // under a sanitizer it fails with EPERM
  EXPECT_THAT(ask(*process, "send_to_host /data/a"),
              HasSubstr("sendfile(512, 1) called: between a file of this spacecraft"));
}

TEST(FlightFilesTest, LocksAreGrantedAndRoomIsTheMediums) {
  FlightProcessOptions o = options({{"/data/a", "ab"}});
  o.file_bytes = 100;
  const auto process = booted(o);
  EXPECT_EQ(ask(*process, "lock /data/a"), "done done errno EBADF");
  EXPECT_EQ(ask(*process, "allocate /data/a"), "0 0 ENOSPC errno EOPNOTSUPP 0 100 94");
  EXPECT_EQ(content(*process, "/data/a"), std::string("ab\0\0\0\0", 6));
}

// There are neither modes nor links: the first are taken and forgotten, the others refused.
TEST(FlightFilesTest, AttributesMeanNothingAndLinksCannotBeMade) {
  const auto process = booted(options({{"/data/a", "abc"}}));
  EXPECT_EQ(ask(*process, "attributes /data/a /data/b"),
            "done done errno EPERM errno EPERM errno EEXIST errno EINVAL done3 errno ENOTTY done "
            "done");
  EXPECT_EQ(content(*process, "/data/b"), "abc");
  EXPECT_EQ(ask(*process, "attributes /data/a /data/b"),
            "errno ENOENT errno ENOENT errno EEXIST errno EEXIST errno EPERM errno ENOENT errno "
            "ENOENT0 errno EBADF errno EBADF errno ENOENT");
}

TEST(FlightFilesTest, AMappingIsAPrivateCopy) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns mmap";
  const auto process = booted(options({{"/data/a", "abcde"}}));
  EXPECT_EQ(ask(*process, "map /data/a"), "Xbcde|0|errno EINVAL|done");
  EXPECT_EQ(content(*process, "/data/a"), "abcde");
  for (const char* how : {"map_shared", "map_fixed"}) {
    EXPECT_THAT(ask(*booted(options({{"/data/a", "abcde"}})), how + std::string(" /data/a")),
                HasSubstr("mmap of \"/data/a\" called: a file of this spacecraft can be mapped "
                          "MAP_PRIVATE and where there is room, not MAP_SHARED or MAP_FIXED"));
  }
}

TEST(FlightFilesTest, TemporaryNamesAreTheSameInEveryRun) {
  const auto process = booted(options({{"/data/", ""}}));
  EXPECT_EQ(ask(*process, "mkstemp /data/aXXXXXX one"), "/data/a000001");
  EXPECT_EQ(ask(*process, "mkstemp /data/aXXXXXX two"), "/data/a000002");
  EXPECT_EQ(ask(*process, "mkdtemp /data/aXXXXXX"), "/data/a000003");
  EXPECT_EQ(ask(*process, "mkstemp /data/a000003/XXXXXX x"), "/data/a000003/000001");
  EXPECT_EQ(ask(*process, "mkstemp /data/XXXXX five"), "errno EINVAL");
  EXPECT_EQ(ask(*process, "mkstemp /data/none/XXXXXX x"), "errno ENOENT");
  EXPECT_EQ(content(*process, "/data/a000002"), "two");
}

TEST(FlightFilesTest, TheWorkingFolderIsTheProcesss) {
  const auto process = booted(options({{"/data/log/a", "A"}}));
  EXPECT_EQ(ask(*process, "getcwd /"), "/ fits");
  EXPECT_EQ(ask(*process, "chdir /data"), "done");
  EXPECT_EQ(ask(*process, "getcwd /"), "/data errno ERANGE");
  EXPECT_EQ(ask(*process, "read log/a"), "A");
  EXPECT_EQ(ask(*process, "chdir log"), "done");
  EXPECT_EQ(ask(*process, "read ../log/./a"), "A");
  EXPECT_EQ(ask(*process, "realpath ../log/a"), "/data/log/a");
  EXPECT_EQ(ask(*process, "realpath b"), "errno ENOENT");
  EXPECT_EQ(ask(*process, "chdir a"), "errno ENOTDIR");
  EXPECT_EQ(ask(*process, "chdir b"), "errno ENOENT");
  const auto again = booted(options({{"/data/log/a", "A"}}), process->memory());
  EXPECT_EQ(ask(*again, "getcwd /"), "/ fits");
}

TEST(FlightFilesTest, WhatWouldBeTheHostsIsRefusedByName) {
  if (!heap_simulation_available()) GTEST_SKIP() << "under a sanitizer it fails with EPERM";
  const auto refused = [](const char* question, OtherFiles others) {
    FlightProcessOptions o = options({{"/data/a", ""}});
    o.other_files = others;
    return ask(*booted(o), question);
  };
  EXPECT_THAT(refused("tmpfile /", OtherFiles::kRefuse),
              HasSubstr("tmpfile() called: it works with a file of the host"));
  EXPECT_THAT(refused("freopen /data/a", OtherFiles::kRefuse), HasSubstr("freopen() called"));
  EXPECT_EQ(refused("tmpfile /", OtherFiles::kAbsent), "errno EACCES");
  EXPECT_THAT(refused("chdir /usr", OtherFiles::kRefuse),
              HasSubstr("chdir(\"/usr\") called: no file of this spacecraft"));
  EXPECT_EQ(refused("chdir /usr", OtherFiles::kAbsent), "errno ENOENT");
  EXPECT_THAT(
      refused("chdir /usr", OtherFiles::kHost),
      HasSubstr("chdir(\"/usr\") called: it would change the folder of the whole test program"));
}

TEST(FlightFilesTest, ABadPointerIsACrashOfFlightCode) {
  const auto process = booted(options({{"/a", ""}}));
  EXPECT_THAT(ask(*process, "null /a"), HasSubstr("Segmentation fault"));
}

// Two copies of one library, two trees.
TEST(FlightFilesTest, SpacecraftDoNotSeeEachOthersFiles) {
  const auto a = booted(options({{"/data/a", "of a"}}));
  FlightProcessOptions other = options({{"/data/", ""}});
  other.spacecraft = "osc";
  const auto b = booted(other);
  EXPECT_EQ(ask(*b, "read /data/a"), "errno ENOENT");
  EXPECT_EQ(ask(*b, "write /data/a b"), "1");
  EXPECT_EQ(content(*a, "/data/a"), "of a");
}

// 21 bytes stay in the stream's buffer; a crash takes them, an orderly end writes them as exit()
// does, and a stream whose descriptor was closed under it has nowhere to write to.
TEST(FlightFilesTest, WhatAStreamHoldsIsWrittenAtAnOrderlyEndOnly) {
  for (const bool crashes : {true, false}) {
    const auto process = booted(options({{"/data/log", "first;"}}));
    EXPECT_EQ(ask(*process, "leave /data/log second"), "done");
    EXPECT_EQ(content(*process, "/data/log"), "first;");
    if (crashes) {
      EXPECT_THAT(ask(*process, "null /a"), HasSubstr("crashed"));
    } else {
      process->shut_down(kStart, to_ns(kStart));
    }
    EXPECT_EQ(content(*process, "/data/log"), crashes ? "first;" : "first;second");
  }
  const auto process = booted(options({{"/data/log", ""}}));
  EXPECT_EQ(ask(*process, "close_under /data/log x"), "errno EBADF");
  EXPECT_EQ(std::fflush(nullptr), 0);  // walks through all streams that the C library knows
}

TEST(FlightFilesTest, ATornWriteIsReportedAsDone) {
  const auto process = booted(options({{"/data/a", "old content"}}));
  std::uint64_t asked = 0;
  process->memory()->set_faults([&](std::uint64_t number, std::uint64_t bytes) {
    asked += bytes;
    WriteFault fault;
    if (number == 1) fault.kept_bytes = 2;
    if (number == 2) fault.flipped_bits = {0, 9};  // 'a' -> '`', 'b' -> '`'
    if (number == 3) fault.full = true;
    return fault;
  });
  EXPECT_EQ(ask(*process, "append /data/a abc"), "3");
  EXPECT_EQ(content(*process, "/data/a"), "old contentab");
  EXPECT_EQ(ask(*process, "write /data/a abc"), "3");
  EXPECT_EQ(content(*process, "/data/a"), "``c");
  EXPECT_EQ(ask(*process, "append /data/a abc"), "errno ENOSPC");
  EXPECT_EQ(asked, 9u);
  EXPECT_EQ(process->memory()->writes(), 3u);
  EXPECT_EQ(process->memory()->faulty_writes(), 3u);
}

TEST(NonVolatileMemoryTest, ATornStoreKeepsWhatWasBehind) {
  NonVolatileMemory memory(16, FlightFiles({}, 0, false));
  memory.set_faults([](std::uint64_t, std::uint64_t) {
    WriteFault torn;
    torn.kept_bytes = 2;
    return torn;
  });
  EXPECT_TRUE(memory.store(7, order("abcd")));
  EXPECT_EQ(text_of(*memory.slot(7)), "ab\xff\xff");
  EXPECT_TRUE(memory.store(7, order("123456")));
  EXPECT_EQ(text_of(*memory.slot(7)), "12\xff\xff\xff\xff");
  EXPECT_FALSE(memory.store(8, order("12345678901")));  // 6 + 11 of 16 bytes
  EXPECT_EQ(memory.slot(8), nullptr);
}

enum class ResetKind { kReboot, kPowerCycle, kKill };

struct Reset {
  const char* name;
  bool loses_unsynced;
  ResetKind kind;
  const char* left;  // of "synced " and, after it, "not"
};
void PrintTo(const Reset& reset, std::ostream* out) {
  *out << reset.name;
}

class FileLifeTest : public testing::TestWithParam<Reset> {};

// The table of contracts.md: a write reaches storage at the call, what a stream still holds does
// not, and what no fsync has followed is lost on a power cycle where the option says so.
TEST_P(FileLifeTest, FilesAreKeptAsTheTableSays) {
  FlightProcessOptions o = options({{"/data/log", ""}});
  o.power_loss_takes_unsynced = GetParam().loses_unsynced;
  EventLoop loop(kStart);
  std::vector<std::string> answers;
  FlightComputer computer(
      loop, loop.add_owner("dsc"), o,
      {.on_output = [&](std::string_view, Bytes bytes) { answers.push_back(text_of(bytes)); }});
  computer.boot();
  for (const char* what : {"leave /data/log synced ", "flush /", "sync /", "append /data/log not",
                           "leave /data/log held by a stream"}) {
    computer.deliver("do", order(what), 0);
    loop.run_until(loop.now() + 1s);
  }
  const SimTime t = loop.now() + 1s;
  if (GetParam().kind == ResetKind::kPowerCycle) computer.power_cycle(t, 1s);
  if (GetParam().kind == ResetKind::kReboot) computer.reboot(t, 1s);
  if (GetParam().kind == ResetKind::kKill) computer.kill(t);
  loop.run_until(t + 2s);
  if (GetParam().kind == ResetKind::kKill) {
    EXPECT_FALSE(computer.alive());
    EXPECT_EQ(text_of(computer.memory().files.find("/data/log")->content), GetParam().left);
    computer.reboot(loop.now(), 1s);  // what is to read it
    loop.run_until(loop.now() + 2s);
  }
  answers.clear();
  computer.deliver("do", order("fopen /data/log"), 0);
  loop.run_until(loop.now() + 1s);
  const std::string left = GetParam().left;
  EXPECT_THAT(answers, ElementsAre(left + "|" + std::to_string(left.size()) + "|1"));
}

INSTANTIATE_TEST_SUITE_P(
    Resets, FileLifeTest,
    testing::Values(Reset{"Reboot", true, ResetKind::kReboot, "synced not"},
                    Reset{"Kill", true, ResetKind::kKill, "synced not"},
                    Reset{"PowerCycle", false, ResetKind::kPowerCycle, "synced not"},
                    Reset{"PowerCycleThatLoses", true, ResetKind::kPowerCycle, "synced "}),
    [](const auto& test) { return test.param.name; });

TEST(FlightFilesTest, BadOptionsSayWhatIsWrong) {
  const auto message = [](std::map<std::string, std::string> files, std::uint64_t capacity) {
    try {
      FlightFiles(files, capacity, false);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message({{"a/b", "x"}, {"/a/c", "y"}}, 2), "accepted");
  EXPECT_THAT(message({{"", "x"}}, 9), HasSubstr("names no file"));
  EXPECT_THAT(message({{"/a/", "x"}}, 9), HasSubstr("is a folder, so it has no content"));
  EXPECT_THAT(message({{"/a", "x"}, {"/a/b", "y"}}, 9), HasSubstr("lies in a file, /a"));
  EXPECT_THAT(message({{"/a", "x"}, {"a", "y"}}, 9), HasSubstr("is given twice"));
  EXPECT_THAT(message({{"/a", "xyz"}}, 2), HasSubstr("3 bytes; file_bytes allows 2"));
}

}  // namespace
}  // namespace orrery
