#include <orrery/harness/record/oem_writer.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "scratch_folder.hpp"

namespace orrery {
namespace {

using Components = OemWriter::Components;

// A small reader of OEM 2.0 key-value notation, written from the standard's tables 5-2 and 5-3.
struct Oem {
  struct State {
    std::string epoch;
    double values[6];
  };
  struct Segment {
    std::vector<std::pair<std::string, std::string>> metadata;
    std::vector<State> states;
  };
  std::vector<std::pair<std::string, std::string>> header;
  std::vector<Segment> segments;
};

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  return first == std::string::npos
             ? ""
             : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

Oem read_oem(const std::string& text) {
  Oem oem;
  bool in_metadata = false;
  bool in_covariance = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line = trimmed(line);
    const auto equals = line.find('=');
    if (line.empty() || line.rfind("COMMENT", 0) == 0) continue;
    if (line == "COVARIANCE_START" || line == "COVARIANCE_STOP") {
      in_covariance = line == "COVARIANCE_START";
    } else if (in_covariance) {
      continue;
    } else if (line == "META_START") {
      EXPECT_FALSE(in_metadata);
      in_metadata = true;
      oem.segments.emplace_back();
    } else if (line == "META_STOP") {
      EXPECT_TRUE(in_metadata);
      in_metadata = false;
    } else if (equals != std::string::npos) {
      auto& entries = in_metadata ? oem.segments.back().metadata : oem.header;
      entries.emplace_back(trimmed(line.substr(0, equals)), trimmed(line.substr(equals + 1)));
    } else {
      EXPECT_FALSE(oem.segments.empty() || in_metadata) << line;
      std::istringstream fields(line);
      Oem::State state;
      fields >> state.epoch;
      for (double& value : state.values) EXPECT_TRUE(fields >> value) << line;
      oem.segments.back().states.push_back(state);
    }
  }
  EXPECT_FALSE(in_metadata);
  return oem;
}

std::vector<std::string> keywords(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::vector<std::string> out;
  for (const auto& [keyword, value] : entries) out.push_back(keyword);
  return out;
}

std::set<std::string> as_set(const std::vector<std::pair<std::string, std::string>>& entries) {
  const std::vector<std::string> words = keywords(entries);
  return {words.begin(), words.end()};
}

std::set<std::string> intersection(const std::set<std::string>& a, const std::set<std::string>& b) {
  std::set<std::string> out;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::inserter(out, out.end()));
  return out;
}

struct OemWriterTest : testing::Test {
  ScratchFolder folder;
  std::filesystem::path path = folder / "dsc.oem";
  // 2025-03-20 00:00:00 GPS is day 16510 of GPS time.
  SimTime epoch = from_ns(16510LL * 86'400'000'000'000);
  OemObject object{.name = "dsc"};
  Components r{6928137.0, -1.25, 0.0};
  Components v{0.0, 7585.123456789, -1e-9};
};

TEST_F(OemWriterTest, FileIsThatOfTheStandardToTheByte) {
  OemWriter oem(path, {.name = "dsc", .id = "2025-001A"}, epoch);
  oem.state(epoch, r, v);
  oem.state(epoch + 10s + 1ns, {-r[0], r[1], r[2]}, v);
  oem.close();
  EXPECT_EQ(
      content_of(path),
      "CCSDS_OEM_VERS = 2.0\n"
      "COMMENT Simulated. CREATION_DATE is the start of the run, so that equal runs give equal\n"
      "COMMENT files.\n"
      "CREATION_DATE = 2025-03-20T00:00:00.000000000\n"
      "ORIGINATOR = ORRERY\n"
      "\n"
      "META_START\n"
      "OBJECT_NAME = dsc\n"
      "OBJECT_ID = 2025-001A\n"
      "CENTER_NAME = EARTH\n"
      "REF_FRAME = EME2000\n"
      "TIME_SYSTEM = GPS\n"
      "START_TIME = 2025-03-20T00:00:00.000000000\n"
      "STOP_TIME = 2025-03-20T00:00:10.000000001\n"
      "META_STOP\n"
      "2025-03-20T00:00:00.000000000 6928.1370000000 -0.0012500000 0.0000000000"
      " 0.0000000000000 7.5851234567890 -0.0000000000010\n"
      "2025-03-20T00:00:10.000000001 -6928.1370000000 -0.0012500000 0.0000000000"
      " 0.0000000000000 7.5851234567890 -0.0000000000010\n");
}

// The last decimals are 0.1 um and 0.1 nm/s: half of them is lost at most.
TEST_F(OemWriterTest, StatesReadBackInKilometresAtTheStatedResolution) {
  OemWriter oem(path, object, epoch);
  std::vector<std::pair<Components, Components>> written;
  for (int i = 0; i < 1000; ++i) {
    const double angle = 0.01 * i;
    written.push_back({{6928137.0 * std::cos(angle), 6928137.0 * std::sin(angle), 1e3 * i},
                       {-7585.1 * std::sin(angle), 7585.1 * std::cos(angle), 1e-3 * i}});
    oem.state(epoch + i * 10s, written.back().first, written.back().second);
  }
  oem.close();

  const Oem read = read_oem(content_of(path));
  ASSERT_EQ(read.segments.size(), 1u);
  ASSERT_EQ(read.segments[0].states.size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Beside the rounding, an ulp of 7000 km.
      EXPECT_NEAR(1e3 * read.segments[0].states[i].values[axis], written[i].first[axis], 0.52e-7);
      EXPECT_NEAR(1e3 * read.segments[0].states[i].values[3 + axis], written[i].second[axis],
                  0.52e-10);
    }
  }
}

TEST_F(OemWriterTest, NumbersHaveNoMoreDigitsThanTheStandardAllows) {
  OemWriter oem(path, object, epoch);
  oem.state(epoch, {-99999e3, 42164e3, 1.0 / 3}, {-99e3, 11e3 + 1.0 / 3, 0});
  oem.close();
  const std::string text = content_of(path);
  std::istringstream fields(text.substr(text.find("META_STOP\n") + 10));
  std::string field;
  fields >> field;
  while (fields >> field) {
    EXPECT_LE(std::count_if(field.begin(), field.end(), [](char c) { return std::isdigit(c); }), 16)
        << field;
  }
}

// CCSDS 502.0-B-2, tables 5-2 and 5-3: the obligatory keywords in their order.
TEST_F(OemWriterTest, ObligatoryKeywordsAreThereInOrder) {
  OemWriter oem(path, object, epoch);
  oem.state(epoch, r, v);
  oem.close();
  const Oem read = read_oem(content_of(path));
  EXPECT_THAT(keywords(read.header),
              testing::ElementsAre("CCSDS_OEM_VERS", "CREATION_DATE", "ORIGINATOR"));
  ASSERT_EQ(read.segments.size(), 1u);
  EXPECT_THAT(keywords(read.segments[0].metadata),
              testing::ElementsAre("OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "REF_FRAME",
                                   "TIME_SYSTEM", "START_TIME", "STOP_TIME"));
  EXPECT_EQ(read.segments[0].metadata[1].second, "dsc");  // no id given: the name
}

// Conformant messages of others, many from the standard itself: ours has the keywords that all of
// them have, no more and no fewer.
TEST_F(OemWriterTest, KeywordsAreThoseOfConformantSamples) {
  const std::filesystem::path samples =
      std::filesystem::path(ORRERY_REFERENCE_DATA) / "ccsds" / "oem";
  if (!std::filesystem::exists(samples)) {
    GTEST_SKIP() << "no OEM samples in " << samples << " (ORRERY_REFERENCE_DATA)";
  }
  OemWriter oem(path, object, epoch);
  oem.state(epoch, r, v);
  oem.close();
  const Oem ours = read_oem(content_of(path));

  std::set<std::string> in_all_headers;
  std::set<std::string> in_all_segments;
  bool first = true;
  for (const char* name : {"OEMExample2", "OEMExample4", "OEMExample5", "OEMExample5ITRF",
                           "OEMExample6", "OEMExample8", "OEMExample9"}) {
    const Oem sample = read_oem(content_of(samples / (std::string(name) + ".txt")));
    ASSERT_FALSE(sample.segments.empty()) << name;
    EXPECT_EQ(sample.header.front(), ours.header.front()) << name;  // the version
    if (first) in_all_headers = as_set(sample.header);
    if (first) in_all_segments = as_set(sample.segments[0].metadata);
    first = false;
    in_all_headers = intersection(in_all_headers, as_set(sample.header));
    for (const Oem::Segment& segment : sample.segments) {
      in_all_segments = intersection(in_all_segments, as_set(segment.metadata));
      EXPECT_FALSE(segment.states.empty()) << name;
    }
  }
  EXPECT_EQ(as_set(ours.header), in_all_headers);
  EXPECT_EQ(as_set(ours.segments[0].metadata), in_all_segments);
}

// A thruster of 20 ms at 7 s and an impulse at 15 s, sampled every 5 s: each instant from the first
// state to the last lies in a segment, and segments meet where the velocity may jump.
TEST_F(OemWriterTest, BreaksLeaveNoInstantWithoutASegment) {
  const OemWriter::Components after{0, 7586, 0};
  OemWriter oem(path, object, epoch);
  oem.break_segment(epoch, r, v, v);  // where it begins
  oem.state(epoch, r, v);
  oem.state(epoch + 5s, r, v);
  oem.break_segment(epoch + 7s, r, v, v);
  oem.break_segment(epoch + 7s, r, v, v);  // a second nozzle
  oem.break_segment(epoch + 7s + 20ms, r, v, v);
  oem.state(epoch + 10s, r, v);
  oem.break_segment(epoch + 15s, r, v, after);
  oem.state(epoch + 15s, r, after);
  oem.state(epoch + 20s, r, v);
  oem.break_segment(epoch + 20s, r, v, after);  // where it ends
  oem.close();
  const Oem read = read_oem(content_of(path));
  using Span = std::vector<std::string>;
  std::vector<Span> spans, states;
  for (const Oem::Segment& segment : read.segments) {
    const auto seconds = [](const std::string& calendar) { return calendar.substr(17, 5); };
    spans.push_back({seconds(segment.metadata[5].second), seconds(segment.metadata[6].second)});
    states.emplace_back();
    for (const Oem::State& state : segment.states) states.back().push_back(seconds(state.epoch));
  }
  EXPECT_THAT(spans, testing::ElementsAre(Span{"00.00", "07.00"}, Span{"07.00", "07.02"},
                                          Span{"07.02", "15.00"}, Span{"15.00", "20.00"}));
  EXPECT_THAT(states,
              testing::ElementsAre(Span{"00.00", "05.00", "07.00"}, Span{"07.00", "07.02"},
                                   Span{"07.02", "10.00", "15.00"}, Span{"15.00", "20.00"}));
  EXPECT_NEAR(1e3 * read.segments[2].states[2].values[4], v[1], 1e-9);
  EXPECT_NEAR(1e3 * read.segments[3].states[0].values[4], after[1], 1e-9);
}

TEST_F(OemWriterTest, StatesOutOfOrderAreRefused) {
  OemWriter oem(path, object, epoch);
  oem.state(epoch + 5s, r, v);
  EXPECT_THROW(oem.state(epoch + 5s, r, v), std::invalid_argument);
  EXPECT_THROW(oem.break_segment(epoch + 4s, r, v, v), std::invalid_argument);
  oem.break_segment(epoch + 6s, r, v, v);
  EXPECT_THROW(oem.state(epoch + 5s, r, v), std::invalid_argument);
  EXPECT_THROW(oem.break_segment(epoch + 5s, r, v, v), std::invalid_argument);
}

TEST_F(OemWriterTest, StatesThatNoOrbitHasAreRefusedWithTimeAndRange) {
  OemWriter oem(path, object, epoch);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(
      [&] {
        oem.state(epoch, {nan, 0, 0}, v);
      },
      testing::ThrowsMessage<std::invalid_argument>(testing::AllOf(
          testing::HasSubstr("r_ECI = nan"), testing::HasSubstr("2025-03-20T00:00:00"),
          testing::HasSubstr("99999 km"))));
  EXPECT_THROW(oem.state(epoch, {0, 0, 1.1e8}, v), std::invalid_argument);
  EXPECT_THROW(oem.state(epoch, r, {0, 1e5, 0}), std::invalid_argument);
}

TEST_F(OemWriterTest, MessageWithoutAStateIsNotClosed) {
  OemWriter oem(path, object, epoch);
  EXPECT_THROW(oem.close(), std::logic_error);
}

TEST_F(OemWriterTest, NamesMustFitOnALine) {
  EXPECT_THROW(OemWriter(path, {.name = ""}, epoch), std::invalid_argument);
  EXPECT_THROW(OemWriter(path, {.name = "a\nb"}, epoch), std::invalid_argument);
  EXPECT_THROW(OemWriter(path, {.name = "a", .id = "\xC3\xA4"}, epoch), std::invalid_argument);
}

}  // namespace
}  // namespace orrery
