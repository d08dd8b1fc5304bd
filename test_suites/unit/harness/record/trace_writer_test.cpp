#include <orrery/harness/record/trace_writer.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <limits>
#include <random>

#include "scratch_folder.hpp"
#include "trace_rules.hpp"

namespace orrery {
namespace {

using nlohmann::json;

struct TraceWriterTest : testing::Test {
  ScratchFolder scratch;
  const SimTime start = gps_midnight(2025, 3, 20);
  TraceWriter trace{scratch.path() / "trace.json", start};
  TraceWriter::Track gnc = trace.track("chief", "gnc"), radio = trace.track("chief", "crosslink"),
                     other = trace.track("deputy", "crosslink"),
                     burns = trace.track("deputy", "burns");

  std::vector<json> events(SimTime end) {
    trace.close(end);
    std::ifstream file(scratch.path() / "trace.json");
    const json all = json::parse(file);
    expect_trace_rules(all);
    return all["traceEvents"];
  }
};

TEST_F(TraceWriterTest, NamesProcessesAndThreadsOnce) {
  EXPECT_EQ(trace.track("chief", "gnc"), gnc);
  EXPECT_EQ(gnc.process, radio.process);
  EXPECT_NE(gnc.thread, radio.thread);
  const auto all = events(start);
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[0], json::parse(R"({"ph":"M","pid":1,"tid":0,"name":"process_name",
                                    "args":{"name":"chief"}})"));
  EXPECT_EQ(all[2]["args"]["name"], "crosslink");
  EXPECT_EQ(all[4]["pid"], 2);
}

// GPS time in ns exceeds 2^53; microseconds since the start are exact as a double for 285 years.
TEST_F(TraceWriterTest, TimesCountFromTheStartAndKeepEveryNanosecond) {
  trace.instant(gnc, start + 1ns, "a");
  trace.instant(gnc, start + days(182) + 1'234'567ns, "b");
  const auto all = events(start + days(182) + 1s);
  EXPECT_EQ(all[6]["ts"], 0.001);
  EXPECT_EQ(all[7]["ts"], 182 * 86400e6 + 1234.567);
}

TEST_F(TraceWriterTest, ASliceEndsByItselfInItsTurn) {
  trace.slice(gnc, start + 1s, 2s, "call");
  trace.slice(radio, start + 2s, 500ms, "short");
  trace.instant(radio, start + 5s, "later");
  const auto all = events(start + 6s);
  std::vector<std::string> phases;
  for (std::size_t i = 6; i < all.size(); ++i) phases.push_back(all[i]["ph"]);
  EXPECT_EQ(phases, (std::vector<std::string>{"B", "B", "E", "E", "i"}));
  EXPECT_EQ(all[8]["ts"], 2.5e6);
  EXPECT_EQ(all[9]["ts"], 3e6);
}

// A reset in the middle of a call, and the next life's first call at that instant.
TEST_F(TraceWriterTest, AnotherSliceOrAnEndCutsTheOpenOne) {
  trace.slice(gnc, start + 1s, 10s, "call");
  trace.end(gnc, start + 3s);
  trace.slice(gnc, start + 4s, 10s, "create");
  trace.begin(gnc, start + 5s, "burn");
  trace.end(gnc, start + 6s);
  trace.end(gnc, start + 7s);  // nothing is open
  const auto all = events(start + 20s);
  std::vector<double> ends;
  for (const auto& event : all) {
    if (event["ph"] == "E") ends.push_back(event["ts"]);
  }
  EXPECT_EQ(ends, (std::vector<double>{3e6, 5e6, 6e6}));
}

// A call at the very end, a burn that is over at once, and a call that a reset ends where it began.
TEST_F(TraceWriterTest, WhatEndsWhereItBeganIsOneEvent) {
  trace.begin(burns, start + 1s, "burn", JsonObject().add("nozzle", "+X"));
  trace.end(burns, start + 1s);
  trace.slice(gnc, start + 2s, 1s, "call");
  trace.begin(gnc, start + 2s, "off");
  trace.slice(gnc, start + 3s, 1s, "last");
  const auto all = events(start + 3s);
  std::vector<std::string> shown;
  for (std::size_t i = 6; i < all.size(); ++i) {
    shown.push_back(all[i]["ph"].get<std::string>() + " " + all[i]["name"].get<std::string>());
  }
  EXPECT_EQ(shown, (std::vector<std::string>{"X burn", "X call", "B off", "E off", "X last"}));
  EXPECT_EQ(all[6]["args"]["nozzle"], "+X");
  EXPECT_EQ(all[6]["dur"], 0);
}

TEST_F(TraceWriterTest, CloseEndsWhatIsOpen) {
  trace.slice(gnc, start, 1h, "long");
  trace.begin(radio, start + 1s, "for ever");
  EXPECT_EQ(events(start + 2s).size(), 10u);
  EXPECT_THROW(trace.instant(gnc, start + 3s, "late"), std::logic_error);
}

TEST_F(TraceWriterTest, RefusesToGoBackInTime) {
  trace.instant(gnc, start + 2s, "a");
  EXPECT_THROW(trace.instant(radio, start + 1s, "b"), std::logic_error);
}

// A slice that takes time could overlap the nanosecond that a flow binds to.
TEST_F(TraceWriterTest, ATrackHasMomentsOrSlices) {
  trace.moment(radio, start, "send");
  EXPECT_THROW(trace.begin(radio, start, "burn"), std::logic_error);
  trace.slice(gnc, start, 0s, "call");
  EXPECT_THROW(trace.moment(gnc, start, "send"), std::logic_error);
}

TEST_F(TraceWriterTest, TextsOfAnyBytesAreValid) {
  trace.instant(gnc, start, "quote \" \\ line\n \x80\xff end \xc3\xa9 \xed\xa0\x80",
                JsonObject().add("nan", std::numeric_limits<double>::quiet_NaN()));
  const auto all = events(start);
  EXPECT_EQ(all[6]["name"],
            "quote \" \\ line\n \xef\xbf\xbd\xef\xbf\xbd end \xc3\xa9 "
            "\xef\xbf\xbd\xef\xbf\xbd\xef\xbf\xbd");
  EXPECT_TRUE(all[6]["args"]["nan"].is_null());
}

// Property: whatever order of calls, with times that do not go back, keeps the rules.
TEST_F(TraceWriterTest, AnyOrderOfCallsKeepsTheRules) {
  std::mt19937 random(1);
  SimTime t = start;
  std::uint64_t sent = 0, received = 0;
  const TraceWriter::Track tracks[] = {gnc, burns, burns};
  for (int i = 0; i < 3000; ++i) {
    t += Duration(random() % 4);
    const auto track = tracks[random() % 3];
    switch (random() % 7) {
      case 0:
        trace.slice(track, t, Duration(random() % 20), "slice");
        break;
      case 1:
        trace.begin(track, t, "open");
        break;
      case 2:
        trace.end(track, t);
        break;
      case 3:
        trace.moment(random() % 2 == 0 ? radio : other, t, "moment");
        break;
      case 4:
        trace.counter(track, t, "heap", JsonObject().add("size", std::uint64_t{1}));
        break;
      case 5:
        trace.moment(radio, t, "send");
        trace.flow_start(radio, t, "message", ++sent);
        break;
      default:
        if (received == sent) break;
        trace.moment(other, t, "receive");
        trace.flow_end(other, t, "message", ++received);
    }
  }
  while (received < sent) {
    trace.moment(other, t, "receive");
    trace.flow_end(other, t, "message", ++received);
  }
  EXPECT_GT(events(t).size(), 2000u);
}

// The rules themselves must be able to fail.
TEST(TraceRulesTest, FindWhatIsWrong) {
  const auto problems = [](const char* events) {
    return trace_problems(json::parse(std::string("{\"traceEvents\":[") + events + "]}")).size();
  };
  const std::string name = R"({"ph":"M","pid":1,"tid":0,"name":"process_name","args":{"name":"c"}},
                              {"ph":"M","pid":1,"tid":1,"name":"thread_name","args":{"name":"g"}})";
  const auto with_names = [&](const char* events) { return problems((name + events).c_str()); };
  EXPECT_EQ(with_names(R"(,{"ph":"i","s":"t","pid":1,"tid":1,"ts":1,"name":"a"})"), 0u);
  EXPECT_EQ(problems(R"({"ph":"i","s":"t","pid":1,"tid":1,"ts":1,"name":"a"})"), 1u);  // no names
  EXPECT_EQ(with_names(R"(,{"ph":"i","s":"t","pid":1,"tid":1,"ts":2,"name":"a"},
                           {"ph":"i","s":"t","pid":1,"tid":1,"ts":1,"name":"a"})"),
            1u);
  EXPECT_EQ(with_names(R"(,{"ph":"B","pid":1,"tid":1,"ts":2,"name":"a"})"), 1u);
  EXPECT_EQ(with_names(R"(,{"ph":"E","pid":1,"tid":1,"ts":2,"name":"a"})"), 1u);
  // An end that Perfetto would read before its begin.
  EXPECT_EQ(with_names(R"(,{"ph":"B","pid":1,"tid":1,"ts":2,"name":"a"},
                           {"ph":"E","pid":1,"tid":1,"ts":2,"name":"a"})"),
            1u);
  // An X across the end of the slice that it began in.
  EXPECT_EQ(with_names(R"(,{"ph":"B","pid":1,"tid":1,"ts":2,"name":"a"},
                           {"ph":"X","pid":1,"tid":1,"ts":3,"dur":2,"name":"b"},
                           {"ph":"E","pid":1,"tid":1,"ts":4,"name":"a"})"),
            1u);
  // A flow without slice, and without end.
  EXPECT_EQ(with_names(R"(,{"ph":"s","cat":"m","id":1,"pid":1,"tid":1,"ts":3,"name":"b"})"), 2u);
  // One whose slice has no category.
  EXPECT_EQ(with_names(R"(,{"ph":"X","pid":1,"tid":1,"ts":3,"dur":1,"name":"a"},
                           {"ph":"s","cat":"m","id":1,"pid":1,"tid":1,"ts":3,"name":"b"},
                           {"ph":"f","cat":"m","bp":"e","id":1,"pid":1,"tid":1,"ts":3,"name":"b"})"),
            2u);
}

}  // namespace
}  // namespace orrery
