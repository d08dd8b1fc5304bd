#include <orrery/harness/flight/elf_image.hpp>
#include <orrery/harness/flight/flight_library.hpp>
#include <orrery/harness/flight/flight_process.hpp>
#include <orrery/harness/flight/library_closure.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

#include "orders.hpp"

namespace orrery {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

FlightProcessOptions options(const std::string& library) {
  return {.spacecraft = "dsc", .library = library};
}

std::string message_of(const std::string& library) {
  try {
    FlightProcess process(options(library));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no exception";
}

// A folder that goes away, and a variable that is put back.
class Scratch {
 public:
  Scratch() {
    std::string name = (fs::temp_directory_path() / "orrery-test-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~Scratch() { fs::remove_all(folder_); }
  fs::path operator/(const std::string& name) const { return folder_ / name; }
  const fs::path& path() const { return folder_; }

 private:
  fs::path folder_;
};
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* old = std::getenv(name)) old_ = old;
    setenv(name, value.c_str(), 1);
  }
  ~Variable() { old_ ? setenv(name_, old_->c_str(), 1) : unsetenv(name_); }

 private:
  const char* name_;
  std::optional<std::string> old_;
};

ino_t inode(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0) << path;
  return status.st_ino;
}

TEST(FlightLibraryTest, MissingLibraryIsReportedWithWhereItWasSoughtAndWhatThereIs) {
  const Variable path("ORRERY_FLIGHT_PATH", "/nowhere/a:/nowhere/b");
  EXPECT_THAT(message_of("becon"), AllOf(HasSubstr("\"becon\""), HasSubstr("libbecon.so"),
                                         HasSubstr("/nowhere/a, /nowhere/b"), HasSubstr("beacon"),
                                         HasSubstr("flight_test_subject")));
}

TEST(FlightLibraryTest, PathsAndEmptyNamesAreNoNames) {
  EXPECT_THAT(message_of(""), HasSubstr("CMake target"));
  EXPECT_THAT(message_of("./libbeacon.so"), HasSubstr("CMake target"));
}

TEST(FlightLibraryTest, FlightPathComesFirst) {
  const Scratch folder;
  fs::copy_file(ORRERY_BEACON_FILE, folder / "libflight_test_subject.so");
  const Variable path("ORRERY_FLIGHT_PATH", "/nowhere:" + folder.path().string());
  FlightProcess process(options("flight_test_subject"));
  EXPECT_EQ(process.ports().at(0).name, "crosslink");  // the beacon's
  EXPECT_EQ(find_flight_library("vendor::flight_test_subject"),
            (folder / "libflight_test_subject.so").string());
}

TEST(FlightLibraryTest, FileThatIsNoLibraryIsRefused) {
  const Scratch folder;
  std::ofstream(folder / "libtext.so") << std::string(1000, '?');
  std::ofstream(folder / "libempty.so").flush();
  fs::copy_file(ORRERY_BEACON_FILE, folder / "libcut.so");
  fs::resize_file(folder / "libcut.so", 4096);
  const Variable path("ORRERY_FLIGHT_PATH", folder.path().string());
  EXPECT_THAT(message_of("text"), AllOf(HasSubstr("libtext.so"), HasSubstr("not an ELF file")));
  EXPECT_THAT(message_of("empty"), HasSubstr("not an ELF file"));
  EXPECT_THAT(message_of("cut"), HasSubstr("cut short"));
  // What the loader says of a file that is loaded as it is.
  FlightProcessOptions shared = options("text");
  shared.isolation = Isolation::kShared;
  try {
    FlightProcess process(shared);
    ADD_FAILURE() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("invalid ELF header"));
  }
}

struct Breach {
  const char* library;
  const char* message;
};
class BreachOfTheAbiTest : public testing::TestWithParam<Breach> {};
TEST_P(BreachOfTheAbiTest, IsNamed) {
  const std::string message = message_of(GetParam().library);
  EXPECT_THAT(message, HasSubstr(GetParam().message));
  EXPECT_THAT(message, HasSubstr(GetParam().library));
}
INSTANTIATE_TEST_SUITE_P(
    All, BreachOfTheAbiTest,
    testing::Values(Breach{"flight_test_no_entry", "does not export orrery_flight_entry"},
                    Breach{"flight_test_other_version", "ABI version 999, this harness has 1"},
                    Breach{"flight_test_null_table", "orrery_flight_entry returned null"},
                    Breach{"flight_test_short_table", "16 bytes"},
                    Breach{"flight_test_null_create", "create is null"},
                    Breach{"flight_test_null_input", "input is null"},
                    Breach{"flight_test_null_destroy", "destroy is null"},
                    Breach{"flight_test_null_ports", "3 ports, and a null port table"},
                    Breach{"flight_test_null_port_name", "row 1 of its port table has no name"},
                    Breach{"flight_test_same_port_name", "two input ports are called \"one\""},
                    Breach{"flight_test_same_port_id",
                           "two input ports have id 1: \"one\" and \"two\""},
                    Breach{"flight_test_crashes_when_loaded", "crashes while it is loaded"}),
    [](const auto& breach) {
      std::string name = breach.param.library + std::string("flight_test_").size();
      name.erase(std::remove(name.begin(), name.end(), '_'), name.end());
      return name;
    });

std::string count(FlightProcess& process) {
  process.input(SimTime{}, 0, process.ports()[0], {});
  return text_of(process.output(0).data);
}

// Each count of the outer library adds one of the inner: "101", "202", "303" ... in every instance.
TEST(LibraryClosureTest, HiddenStateOfDependenciesIsPerInstance) {
  std::vector<std::unique_ptr<FlightProcess>> processes;
  for (int i = 0; i < 5; ++i) {
    FlightProcessOptions o = options("flight_test_linked");
    o.spacecraft = "sc" + std::to_string(i);
    processes.push_back(std::make_unique<FlightProcess>(o));
    processes.back()->create(SimTime{}, 0);
    EXPECT_THAT(processes.back()->shared_dependencies(), testing::IsEmpty());
  }
  for (int round = 1; round <= 3; ++round) {
    for (const auto& process : processes) EXPECT_EQ(count(*process), std::to_string(101 * round));
  }
  processes[2].reset();  // and the next of that name begins anew
  FlightProcessOptions o = options("flight_test_linked");
  o.spacecraft = "sc2";
  processes[2] = std::make_unique<FlightProcess>(o);
  processes[2]->create(SimTime{}, 0);
  EXPECT_EQ(count(*processes[2]), "101");
  EXPECT_EQ(count(*processes[3]), "404");
}

TEST(LibraryClosureTest, SharedLoadSharesThem) {
  FlightProcessOptions o = options("flight_test_linked");
  o.isolation = Isolation::kShared;
  FlightProcess a(o), b(o);
  a.create(SimTime{}, 0);
  b.create(SimTime{}, 0);
  const int first = std::stoi(count(a));
  EXPECT_EQ(std::stoi(count(b)), first + 101);
}

TEST(LibraryClosureTest, NamesChangeInPlaceAndInEveryPart) {
  internal::LibraryClosure closure =
      internal::read_closure(find_flight_library("flight_test_linked"));
  ASSERT_EQ(closure.parts.size(), 3u);
  EXPECT_EQ(closure.parts[0].name, "libflight_test_inner.so");  // what is needed comes first
  EXPECT_EQ(closure.parts[1].name, "libflight_test_outer.so");
  const std::size_t size = closure.parts[2].image.bytes().size();
  internal::rename_parts(closure, "i07");
  EXPECT_EQ(closure.parts[0].image.soname(), "i07flight_test_inner.so");
  EXPECT_THAT(closure.parts[1].image.needed(), testing::Contains("i07flight_test_inner.so"));
  EXPECT_THAT(closure.parts[2].image.needed(),
              testing::IsSupersetOf({"i07flight_test_inner.so", "i07flight_test_outer.so"}));
  EXPECT_THAT(closure.parts[2].image.needed(), testing::Contains("libc.so.6"));
  EXPECT_EQ(closure.parts[2].image.bytes().size(), size);
}

struct Host {
  std::int64_t cpu_us = 0, resident_bytes = 0;

  static Host now() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    std::int64_t total = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> total >> resident;
    return {std::int64_t{t.tv_sec} * 1'000'000 + t.tv_nsec / 1000,
            resident * sysconf(_SC_PAGESIZE)};
  }
};

// Instances of 64 spacecraft at once, each with its own count. What one takes is said, and written
// into the XML report: CPU time and resident memory, for its
// library and two more that this one links.
TEST(FlightLibraryTest, SixtyFourInstancesHaveGlobalsOfTheirOwn) {
  std::vector<std::unique_ptr<FlightProcess>> processes;
  const Host before = Host::now();
  for (int i = 0; i < 64; ++i) {
    FlightProcessOptions o = options("flight_test_linked");
    o.spacecraft = "sc" + std::to_string(i);
    processes.push_back(std::make_unique<FlightProcess>(o));
    ASSERT_EQ(processes.back()->create(SimTime{}, 0), CallOutcome::kDone);
  }
  const Host after = Host::now();
  const auto us_each = static_cast<int>((after.cpu_us - before.cpu_us) / 64);
  const auto bytes_each = static_cast<int>((after.resident_bytes - before.resident_bytes) / 64);
  std::printf("  64 instances: %d us and %d bytes each\n", us_each, bytes_each);
  RecordProperty("load_us_per_instance", us_each);
  RecordProperty("bytes_per_instance", bytes_each);
  for (int i = 0; i < 64; ++i) {
    for (int n = 0; n < i % 3; ++n) count(*processes[static_cast<std::size_t>(i)]);
  }
  for (int i = 0; i < 64; ++i) {
    EXPECT_EQ(count(*processes[static_cast<std::size_t>(i)]), std::to_string(101 * (i % 3 + 1)));
  }
}

TEST(GlobalsWatchTest, SharedLibraryThatWritesItsGlobalsIsNamed) {
  FlightProcessOptions o = options("flight_test_subject");
  o.isolation = Isolation::kShared;
  FlightProcess process(o);
  process.create(SimTime{}, 0);  // it keeps its host table in a global
  EXPECT_EQ(process.written_global(), "subject");
  ASSERT_EQ(process.log_count(), 1u);
  EXPECT_THAT(std::string(process.log_line(0).text),
              AllOf(HasSubstr("\"flight_test_subject\" writes its own globals (subject)"),
                    HasSubstr("kCopy")));
  for (int i = 0; i < 10; ++i) {
    process.input(SimTime{}, 0, process.ports()[0], order("ea"));
    EXPECT_EQ(process.log_count(), 0u);  // once
  }
}

TEST(GlobalsWatchTest, LibraryWithoutGlobalsAndCopiesAreSilent) {
  FlightProcessOptions o = options("flight_test_services");
  o.isolation = Isolation::kShared;
  FlightProcess without(o), copy(options("flight_test_subject"));
  for (FlightProcess* process : {&without, &copy}) {
    process->create(SimTime{}, 0);
    for (int i = 0; i < 10; ++i) process->input(SimTime{}, 0, process->ports()[0], order("1"));
    EXPECT_EQ(process->written_global(), "");
  }
}

TEST(FlightLibraryTest, TwoInstancesAliveAtOnceShareNoFile) {
  const FlightLibrary a(options("beacon"));
  const FlightLibrary b(options("beacon"));  // same spacecraft and process: another World
  EXPECT_NE(a.loaded_path(), b.loaded_path());
  EXPECT_NE(inode(a.loaded_path()), inode(b.loaded_path()));
  EXPECT_NE(a.symbol("orrery_flight_entry"), b.symbol("orrery_flight_entry"));
}

TEST(FlightLibraryTest, CopyIsNamedAfterItsProcessAndUsedAgain) {
  const Scratch folder;
  const Variable cache("XDG_CACHE_HOME", folder.path().string());
  std::string path;
  ino_t first = 0;
  {
    const FlightLibrary library(options("beacon"));
    path = library.loaded_path();
    first = inode(path);
  }
  EXPECT_EQ(fs::path(path).filename(), "dsc.gnc.so");
  EXPECT_THAT(path, HasSubstr(folder.path().string()));
  const FlightLibrary again(options("beacon"));
  EXPECT_EQ(again.loaded_path(), path);
  EXPECT_EQ(inode(path), first);
}

TEST(FlightLibraryTest, DamagedCopyIsWrittenAnew) {
  const Scratch folder;
  const Variable cache("XDG_CACHE_HOME", folder.path().string());
  std::string path;
  { path = FlightLibrary(options("beacon")).loaded_path(); }
  std::ofstream(path) << "disk full";
  const FlightLibrary again(options("beacon"));
  EXPECT_EQ(again.loaded_path(), path);
  EXPECT_NE(again.symbol("orrery_flight_entry"), nullptr);
}

TEST(FlightLibraryTest, CacheThatCannotBeWrittenIsReported) {
  const Scratch folder;
  std::ofstream(folder / "orrery") << "a file where the folder should be";
  const Variable cache("XDG_CACHE_HOME", folder.path().string());
  EXPECT_THAT(message_of("beacon"), HasSubstr((folder / "orrery").string()));
}

TEST(FlightLibraryTest, SharedLibraryIsTheFileItself) {
  FlightProcessOptions shared = options("beacon");
  shared.isolation = Isolation::kShared;
  const FlightLibrary a(shared), b(shared);
  EXPECT_EQ(a.loaded_path(), find_flight_library("beacon"));
  EXPECT_EQ(a.symbol("orrery_flight_entry"), b.symbol("orrery_flight_entry"));
}

TEST(FlightLibraryTest, NamesOfFilesAreCheckedFirst) {
  for (const char* name : {"", "a/b", "../x"}) {
    FlightProcessOptions o = options("beacon");
    o.spacecraft = name;
    EXPECT_THROW(FlightProcess{o}, std::invalid_argument) << name;
  }
}

TEST(ElfImageTest, FunctionsAreFoundByAddress) {
  const std::string path = find_flight_library("flight_test_subject");
  std::ifstream file(path, std::ios::binary);
  const std::string content{std::istreambuf_iterator<char>(file), {}};
  ByteBuffer bytes(content.size());
  std::transform(content.begin(), content.end(), bytes.begin(),
                 [](char c) { return static_cast<std::byte>(c); });
  const internal::ElfImage image(bytes);
  EXPECT_THAT(image.needed(), testing::Contains(HasSubstr("libc.so")));
  EXPECT_EQ(image.function_at(0), "");

  const FlightLibrary library(options("flight_test_subject"));
  // Offset of the entry, which is exported, from where the loader put the file's first page.
  std::ifstream maps("/proc/self/maps");
  std::string line;
  while (std::getline(maps, line) && line.find(library.loaded_path()) == std::string::npos) {
  }
  const std::uintptr_t base = std::stoull(line, nullptr, 16);
  const std::uintptr_t entry =
      reinterpret_cast<std::uintptr_t>(library.symbol("orrery_flight_entry"));
  EXPECT_EQ(image.function_at(entry - base), "orrery_flight_entry");
}

// Without a word about it the second process would wait for ever on the static's guard.
TEST(HalfInitialisedStaticTest, IsNamedToWhoeverWantsItNext) {
  if (!heap_simulation_available()) GTEST_SKIP() << "a sanitizer owns the program's hooks";
  for (const Isolation isolation : {Isolation::kCopy, Isolation::kShared}) {
    FlightProcessOptions o{
        .spacecraft = "dsc", .library = "flight_test_half_run", .isolation = isolation};
    FlightProcess first(o);
    o.spacecraft = "osc";
    FlightProcess second(o);
    first.create(SimTime{}, 0);
    second.create(SimTime{}, 0);
    EXPECT_EQ(first.input(SimTime{}, 0, first.ports()[0], order("c")), CallOutcome::kCrashed);
    EXPECT_EQ(second.input(SimTime{}, 0, second.ports()[0], order("n")), CallOutcome::kDone);
    const CallOutcome outcome = second.input(SimTime{}, 0, second.ports()[0], order("u"));
    if (isolation == Isolation::kCopy) {
      EXPECT_EQ(outcome, CallOutcome::kDone);
      continue;
    }
    ASSERT_EQ(outcome, CallOutcome::kCrashed);
    EXPECT_EQ(second.crash().kind, CrashKind::kForbiddenCall);
    EXPECT_THAT(
        second.crash().message,
        testing::AllOf(testing::HasSubstr("\"flight_test_half_run\" cannot be used"),
                       testing::HasSubstr("dsc/gnc crashed"), testing::HasSubstr("the_table")));
  }
}

}  // namespace
}  // namespace orrery
