#include <orrery/harness/gtest/channel_matchers.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace orrery {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const SimTime kStart = gps_midnight(2025, 3, 20);

// One sample a second from the world's start on.
Channel channel(std::initializer_list<double> values) {
  Channel made("dsc/navigation/error_m", kStart);
  SimTime t = kStart;
  for (const double value : values) {
    made.add(t, value);
    t += 1s;
  }
  return made;
}

bool matches(const ChannelMatcher& matcher, const Channel& of) {
  return matcher.Matches(of);
}

std::string explanation(const ChannelMatcher& matcher, const Channel& of) {
  testing::StringMatchResultListener listener;
  matcher.MatchAndExplain(of, &listener);
  return listener.str();
}

std::string description(const ChannelMatcher& matcher) {
  return testing::DescribeMatcher<const Channel&>(matcher);
}

TEST(BoundedMatcherTest, TheLimitItselfIsNeitherBelowNorAbove) {
  const Channel samples = channel({1, 3, 2});
  EXPECT_TRUE(matches(AlwaysBelow(3.5), samples));
  EXPECT_FALSE(matches(AlwaysBelow(3), samples));
  EXPECT_TRUE(matches(NeverAbove(3), samples));
  EXPECT_FALSE(matches(NeverAbove(2.5), samples));
  EXPECT_TRUE(matches(AlwaysAbove(0.5), samples));
  EXPECT_FALSE(matches(AlwaysAbove(1), samples));
  EXPECT_TRUE(matches(NeverBelow(1), samples));
  EXPECT_FALSE(matches(NeverBelow(1.5), samples));
}

TEST(BoundedMatcherTest, WindowsIncludeTheirBeginAndNotTheirEnd) {
  const Channel samples = channel({9, 1, 2, 9});
  EXPECT_TRUE(matches(AlwaysBelow(5, between(1s, 3s)), samples));
  EXPECT_FALSE(matches(AlwaysBelow(5, from(2s)), samples));
  EXPECT_FALSE(matches(AlwaysBelow(5, until(3s)), samples));
  EXPECT_FALSE(matches(AlwaysBelow(5, between(1s, 3s + 1ns)), samples));
}

TEST(BoundedMatcherTest, ExplainsTheWorstAndTheFirstOffence) {
  EXPECT_EQ(explanation(AlwaysBelow(2), channel({1, 2.5, 4, 0})),
            "it is 4 m at 2 s on dsc, 2 m beyond the limit, the worst of 2 of 4 samples; the first "
            "is 2.5 m at 1 s");
  EXPECT_EQ(
      explanation(NeverBelow(0), channel({1, -0.25})),
      "it is -0.25 m at 1 s on dsc, 0.25 m beyond the limit, the worst of 1 of 2 samples; the "
      "first is -0.25 m at 1 s");
}

TEST(BoundedMatcherTest, ExplainsTheNearestMissOfAPass) {
  EXPECT_EQ(explanation(AlwaysBelow(2), channel({1, 1.75, 0})),
            "it is 1.75 m at 1 s on dsc, the nearest miss of 3 samples, by 0.25 m");
}

TEST(BoundedMatcherTest, DescribesItselfWithItsWindow) {
  EXPECT_EQ(description(AlwaysBelow(0.01, from(50min))), "is always below 0.01 from 3000 s");
  EXPECT_EQ(description(NeverAbove(7)), "is never above 7");
  EXPECT_EQ(testing::DescribeMatcher<const Channel&>(Not(NeverBelow(7))), "is not never below 7");
}

TEST(ChannelMatcherTest, NothingRecordedNeverPasses) {
  const Channel empty = channel({});
  const Channel early = channel({1, 1});
  const std::string why = "\"dsc/navigation/error_m\" has no sample from 10 s (2 in all)";
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(AlwaysBelow(5), empty)), "has no sample (0 in all)");
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(early, Not(AlwaysBelow(5, from(10s)))), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(RmsBelow(5, from(10s)), early)), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(NoGapLongerThan(5s, from(10s)), early)), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(PercentileBelow(50, 5, from(10s)), early)), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(EventuallyWithin(0, 5, from(10s)), early)), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(SettlesBelow(5, 1s, from(10s)), early)), why);
}

TEST(ChannelMatcherTest, ANumberThatIsNoneFailsAndIsPlaced) {
  const Channel samples = channel({1, std::numeric_limits<double>::quiet_NaN(), 1});
  for (const ChannelMatcher& matcher :
       {AlwaysBelow(5), NeverAbove(5), AlwaysAbove(0), NeverBelow(0), RmsBelow(5),
        ChannelMatcher(PercentileBelow(50, 5)), EventuallyWithin(0, 5), SettlesBelow(5, 1s),
        NoGapLongerThan(5s)}) {
    EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(matcher, samples)),
                            "\"dsc/navigation/error_m\" is not a number at 1 s");
    EXPECT_EQ(explanation(matcher, samples), "\"dsc/navigation/error_m\" is not a number at 1 s");
    EXPECT_NONFATAL_FAILURE(EXPECT_THAT(samples, Not(matcher)), "is not a number at 1 s");
  }
}

TEST(ChannelMatcherTest, ComposesWithGMock) {
  EXPECT_THAT(channel({1, 2, 3}), AllOf(NeverAbove(3), NoGapLongerThan(1s), Not(AlwaysBelow(3))));
}

TEST(ChannelMatcherTest, GoogleTestPrintsWhatTheChannelIs) {
  EXPECT_EQ(testing::PrintToString(channel({1, 2.5})),
            "\"dsc/navigation/error_m\" (2 samples, 1 to 2.5 m)");
}

TEST(EventuallyWithinTest, OneSampleInTheClosedIntervalIsEnough) {
  EXPECT_TRUE(matches(EventuallyWithin(2, 3), channel({9, 3, 9})));
  EXPECT_FALSE(matches(EventuallyWithin(2, 3), channel({9, 3.5, 1})));
  EXPECT_EQ(explanation(EventuallyWithin(2, 3), channel({9, 3.5, 1})),
            "it is 3.5 m at 1 s on dsc, the nearest of 3 samples, off by 0.5 m");
}

TEST(SettlesBelowTest, LaterSamplesAreAllBelowAndThereIsOne) {
  const Channel samples = channel({9, 6, 5, 4, 3});  // at 2 s for the last time not below 5
  EXPECT_TRUE(matches(SettlesBelow(5, 2s), samples));
  EXPECT_FALSE(matches(SettlesBelow(5, 1s), samples));
  EXPECT_TRUE(matches(SettlesBelow(5, 1s, from(1s)), samples));
  EXPECT_EQ(
      explanation(SettlesBelow(5, 1s), samples),
      "it is 5 m at 2 s on dsc for the last time, 2 s after the window's begin, 1 s late; from "
      "1 s on it is at most 5 m, at 2 s, at the limit");
  EXPECT_EQ(
      explanation(SettlesBelow(5, 2s), samples),
      "it is 5 m at 2 s on dsc for the last time, 2 s after the window's begin; from 2 s on it "
      "is at most 4 m, at 3 s, 1 m inside the limit");
  EXPECT_EQ(explanation(SettlesBelow(10, 1s, from(3s)), channel({1, 1, 1, 1, 2, 3})),
            "it is below throughout; from 4 s on it is at most 3 m, at 5 s, 7 m inside the limit");
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(samples, Not(SettlesBelow(10, 4s))),
                          "has no sample after 4 s, so nothing says that it settled");
}

// 3, 4 and 0: sqrt((9 + 16 + 0) / 3) = 2.8867...
TEST(RmsBelowTest, WeighsEverySampleAlike) {
  const Channel samples = channel({3, -4, 0});
  EXPECT_TRUE(matches(RmsBelow(2.8868), samples));
  EXPECT_FALSE(matches(RmsBelow(2.8867), samples));
  EXPECT_EQ(
      explanation(RmsBelow(1), samples),
      "the RMS of 3 samples is 2.88675 m, 1.88675 m beyond the limit; at the largest it is -4 "
      "m at 1 s on dsc");
  EXPECT_EQ(
      explanation(RmsBelow(3), samples),
      "the RMS of 3 samples is 2.88675 m, 0.113249 m inside the limit; at the largest it is -4 "
      "m at 1 s on dsc");
}

// Nearest rank: of 1 ... 10 the 90th percentile is 9, the 91st 10, the 10th 1.
TEST(PercentileBelowTest, IsTheNearestRank) {
  const Channel samples = channel({10, 9, 8, 7, 6, 5, 4, 3, 2, 1});
  EXPECT_EQ(explanation(PercentileBelow(90, 9.5), samples),
            "at that percentile of 10 samples it is 9 m at 1 s on dsc, 0.5 m inside the limit");
  EXPECT_EQ(explanation(PercentileBelow(91, 9), samples),
            "at that percentile of 10 samples it is 10 m at 0 s on dsc, 1 m beyond the limit");
  EXPECT_THAT(explanation(PercentileBelow(10, 9), samples), HasSubstr("samples it is 1 m at 9 s"));
  EXPECT_THAT(explanation(PercentileBelow(0.1, 9), samples), HasSubstr("samples it is 1 m at 9 s"));
  EXPECT_TRUE(matches(PercentileBelow(90, 9.5), samples));
  EXPECT_FALSE(matches(PercentileBelow(90, 9), samples));
}

TEST(NoGapLongerThanTest, CountsTheEdgesOfTheWindow) {
  Channel samples("dsc/gnss/epochs", kStart);
  for (const Duration t : {2s, 5s, 3s}) samples.add(kStart + t, 1);  // the order does not matter
  EXPECT_TRUE(matches(NoGapLongerThan(2s), samples));
  EXPECT_FALSE(matches(NoGapLongerThan(2s - 1ns), samples));
  EXPECT_EQ(explanation(NoGapLongerThan(1s, until(10s)), samples),
            "the longest on dsc is 5 s, from 5 s to 10 s, 4 s too long");
  EXPECT_EQ(explanation(NoGapLongerThan(3s, from(3s)), samples),
            "the longest on dsc is 2 s, from 3 s to 5 s, 1 s to spare");
}

// What stops in the middle of a run has a gap until its end.
TEST(NoGapLongerThanTest, CountsTheEndOfTheRun) {
  Channel samples = channel({1, 1, 1});
  EXPECT_TRUE(matches(NoGapLongerThan(1s), samples));
  samples.extend_to(kStart + 10s);
  EXPECT_FALSE(matches(NoGapLongerThan(1s), samples));
  EXPECT_EQ(explanation(NoGapLongerThan(1s), samples),
            "the longest on dsc is 8 s, from 2 s to 10 s, 7 s too long");
}

// Events at 1 s, 4 s and 7 s of a run of 10 s.
Channel burns() {
  Channel made("dsc/thruster/burn", ChannelKind::kEvent, kStart);
  for (const Duration t : {1s, 4s, 7s}) made.add(kStart + t, t == 4s ? "lost" : "done");
  made.extend_to(kStart + 10s);
  return made;
}

TEST(HappensTest, CountsWhatWasRecorded) {
  EXPECT_TRUE(matches(HappensExactly(3), burns()));
  EXPECT_TRUE(matches(HappensExactly(1, from(5s)), burns()));
  EXPECT_TRUE(matches(HappensExactly(1), burns().only("lost")));
  EXPECT_TRUE(matches(HappensExactly(0, from(8s)), burns())) << "none is a count as well";
  EXPECT_EQ(explanation(HappensExactly(2), burns()),
            "it happened 3 times on dsc, at 1 s, 4 s, 7 s");
  EXPECT_EQ(explanation(HappensExactly(2, from(5s)), burns()), "it happened 1 time on dsc, at 7 s");
  EXPECT_EQ(description(HappensExactly(1, from(5s))), "happens exactly 1 time from 5 s");
  EXPECT_EQ(explanation(HappensExactly(1), channel({1, 1, 1, 1, 1, 1, 1})),
            "it happened 7 times on dsc, at 0 s, 1 s, 2 s, 3 s, 4 s ... 6 s");
}

TEST(HappensTest, NoneIsNoCountWhereNothingWasRecordedOrTheRunDidNotReach) {
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(HappensExactly(0), channel({}))), "has no sample");
  const std::string why =
      "\"dsc/thruster/burn\" is known until 10 s only, so nothing can be said of it from 11 s";
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(HappensExactly(0, from(11s)), burns())), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(burns(), Not(HappensExactly(1, from(11s)))), why);
}

TEST(HappensTest, BeforeComparesTheFirstOfEach) {
  Channel early("dsc/mode SAFE", ChannelKind::kEvent, kStart);
  Channel late("osc/mode SAFE", ChannelKind::kEvent, kStart);
  early.add(kStart + 5s, "SAFE");
  late.add(kStart + 6s, "SAFE");
  EXPECT_TRUE(matches(HappensBefore(late), early));
  EXPECT_FALSE(matches(HappensBefore(early), late));
  EXPECT_FALSE(matches(HappensBefore(early), early)) << "at the same instant is not before";
  EXPECT_EQ(explanation(HappensBefore(late), early),
            "it first happened at 5 s on dsc, 1 s before \"osc/mode SAFE\"");
  EXPECT_EQ(explanation(HappensBefore(early), late),
            "it first happened at 6 s on osc, 1 s after \"dsc/mode SAFE\"");
}

TEST(HappensTest, BeforeWhatNeverHappenedIsAFailure) {
  Channel happened("dsc/mode SAFE", ChannelKind::kEvent, kStart);
  happened.add(kStart + 5s, "SAFE");
  const Channel never("osc/mode SAFE", ChannelKind::kEvent, kStart);
  const std::string why = "\"osc/mode SAFE\" never happened";
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(HappensBefore(never), happened)), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(happened, Not(HappensBefore(never))), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(never, Not(HappensBefore(happened))), why);
}

TEST(TimeWindowTest, MayBeginWithAnEvent) {
  const Channel lost = burns().only("lost");  // at 4 s
  const Channel samples = channel({9, 9, 9, 9, 1, 1, 7});
  EXPECT_TRUE(matches(AlwaysBelow(5, after(lost) && until(6s)), samples));
  EXPECT_FALSE(matches(AlwaysBelow(5, after(lost)), samples));
  EXPECT_TRUE(matches(AlwaysAbove(5, from(1s) && after(lost, 2s)), samples));
  EXPECT_EQ(description(AlwaysBelow(5, after(lost) && until(6s))),
            "is always below 5 after \"dsc/thruster/burn lost\" at 4 s and until 6 s");
  EXPECT_EQ(description(AlwaysBelow(5, after(lost, 2s))),
            "is always below 5 from 2 s after \"dsc/thruster/burn lost\" at 4 s");
  EXPECT_THROW(after(lost, -1s), std::invalid_argument);
}

TEST(TimeWindowTest, AfterWhatNeverHappenedNothingPasses) {
  const Channel never = burns().only("aborted");
  const std::string why = "after \"dsc/thruster/burn aborted\", which never happened";
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(AlwaysBelow(5, after(never)), channel({1}))), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(channel({9}), Not(AlwaysBelow(5, after(never)))), why);
  EXPECT_NONFATAL_FAILURE(EXPECT_FALSE(matches(HappensExactly(0, after(never)), burns())), why);
}

// (3, 4, 0), then (0, -1, 0): norms 5 and 1.
Channel error() {
  Channel made("dsc/navigation/error_RTN_m", ChannelKind::kVector, kStart);
  made.add(kStart + 1s, Channel::Components{3, 4, 0});
  made.add(kStart + 2s, Channel::Components{0, -1, 0});
  return made;
}

TEST(VectorMatcherTest, TheNormIsJudgedAndTheAxesAreNamed) {
  EXPECT_TRUE(matches(NeverAbove(5), error()));
  EXPECT_EQ(
      explanation(AlwaysBelow(4.5), error()),
      "its norm is 5 m at 1 s on dsc (R 3, T 4, N 0; most along T), 0.5 m beyond the limit, the "
      "worst of 1 of 2 samples; the first is 5 m at 1 s");
  EXPECT_EQ(explanation(AlwaysBelow(6), error()),
            "its norm is 5 m at 1 s on dsc (R 3, T 4, N 0; most along T), the nearest miss of 2 "
            "samples, by 1 m");
}

TEST(VectorMatcherTest, AxesAreJudgedAlone) {
  EXPECT_TRUE(matches(Along("T", AlwaysWithin(-1, 4)), error()));
  EXPECT_TRUE(matches(AlongEachAxis(AlwaysWithin(-1, 4)), error()));
  EXPECT_FALSE(matches(AlongEachAxis(AlwaysWithin(-1, 3.5)), error()));
  EXPECT_EQ(explanation(AlongEachAxis(AlwaysWithin(-1, 3.5)), error()),
            "along T it is 4 m at 1 s on dsc, 0.5 m beyond the limit, the worst of 1 of 2 samples; "
            "the first is 4 m at 1 s");
  EXPECT_EQ(explanation(Along("R", AlwaysBelow(4)), error()),
            "along R it is 3 m at 1 s on dsc, the nearest miss of 2 samples, by 1 m");
  EXPECT_EQ(description(AlongEachAxis(RmsBelow(2, from(1s)))),
            "is below 2 in RMS from 1 s along each axis");
}

TEST(VectorMatcherTest, WhatHasNoSuchAxisFails) {
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(channel({1}), Not(Along("T", AlwaysBelow(1)))),
                          "\"dsc/navigation/error_m\" records numbers, which have no axes");
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(error(), Not(Along("x", AlwaysBelow(1)))),
                          "\"dsc/navigation/error_RTN_m\" has no axis x; it has R, T, N");
  EXPECT_NONFATAL_FAILURE(
      EXPECT_THAT(error(), Not(AlongEachAxis(AlwaysBelow(1, from(9s))))),
      "\"dsc/navigation/error_RTN_m along R\" has no sample from 9 s (2 in all)");
}

TEST(ChannelMatcherTest, EventsAreNoNumbers) {
  EXPECT_NONFATAL_FAILURE(EXPECT_THAT(burns(), Not(AlwaysBelow(1))),
                          "\"dsc/thruster/burn\" records events, not numbers");
}

TEST(ChannelMatcherTest, EachOfSeveralChannelsIsNamed) {
  const std::vector<Channel> both = {channel({1, 1}), error()};
  EXPECT_THAT(both, testing::Each(NeverAbove(5)));
  testing::StringMatchResultListener listener;
  const testing::Matcher<const std::vector<Channel>&> each = testing::Each(AlwaysBelow(5));
  EXPECT_FALSE(each.MatchAndExplain(both, &listener));
  EXPECT_THAT(listener.str(), HasSubstr("element #1 doesn't match, its norm is 5 m at 1 s on dsc"));
}

template <class Make>
std::string refusal(Make make) {
  try {
    make();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ChannelMatcherTest, RefusesWhatCannotBeMeant) {
  const double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal([&] { AlwaysBelow(kNan); }), HasSubstr("AlwaysBelow: limit nan"));
  EXPECT_THAT(refusal([] { EventuallyWithin(3, 2); }), HasSubstr("[3, 2] is empty"));
  EXPECT_THAT(refusal([] { PercentileBelow(0, 1); }), HasSubstr("above 0, at most 100"));
  EXPECT_THAT(refusal([] { NoGapLongerThan(0s); }), HasSubstr("a span of 0 s"));
  EXPECT_THAT(refusal([] { HappensExactly(-1); }), HasSubstr("0 or more"));
  EXPECT_THAT(refusal([] { AlwaysBelow(1, at(3s)); }), HasSubstr("'at 3 s' is no window of time"));
  EXPECT_THAT(refusal([] { AlwaysBelow(1, nth(3)); }), HasSubstr("use from, until, between"));
}

}  // namespace
}  // namespace orrery
