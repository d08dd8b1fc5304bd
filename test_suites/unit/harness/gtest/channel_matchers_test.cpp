#include <orrery/harness/gtest/channel_matchers.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>

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
            "it is 4 m at 2 s, 2 m beyond the limit, the worst of 2 of 4 samples; the first is 2.5 "
            "m at 1 s");
  EXPECT_EQ(explanation(NeverBelow(0), channel({1, -0.25})),
            "it is -0.25 m at 1 s, 0.25 m beyond the limit, the worst of 1 of 2 samples; the first "
            "is -0.25 m at 1 s");
}

TEST(BoundedMatcherTest, ExplainsTheNearestMissOfAPass) {
  EXPECT_EQ(explanation(AlwaysBelow(2), channel({1, 1.75, 0})),
            "it is 1.75 m at 1 s, the nearest miss of 3 samples, by 0.25 m");
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
        PercentileBelow(50, 5), EventuallyWithin(0, 5), SettlesBelow(5, 1s), NoGapLongerThan(5s)}) {
    EXPECT_FALSE(matches(matcher, samples)) << description(matcher);
    EXPECT_EQ(explanation(matcher, samples), "it is not a number at 1 s");
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
            "it is 3.5 m at 1 s, the nearest of 3 samples, off by 0.5 m");
}

TEST(SettlesBelowTest, LaterSamplesAreAllBelowAndThereIsOne) {
  const Channel samples = channel({9, 6, 5, 4, 3});  // at 2 s for the last time not below 5
  EXPECT_TRUE(matches(SettlesBelow(5, 2s), samples));
  EXPECT_FALSE(matches(SettlesBelow(5, 1s), samples));
  EXPECT_TRUE(matches(SettlesBelow(5, 1s, from(1s)), samples));
  EXPECT_FALSE(matches(SettlesBelow(10, 4s), samples)) << "nothing was recorded after 4 s";
  EXPECT_EQ(explanation(SettlesBelow(5, 1s), samples),
            "it is 5 m at 2 s for the last time, 2 s after the window's begin");
}

// 3, 4 and 0: sqrt((9 + 16 + 0) / 3) = 2.8867...
TEST(RmsBelowTest, WeighsEverySampleAlike) {
  const Channel samples = channel({3, -4, 0});
  EXPECT_TRUE(matches(RmsBelow(2.8868), samples));
  EXPECT_FALSE(matches(RmsBelow(2.8867), samples));
  EXPECT_EQ(explanation(RmsBelow(1), samples),
            "the RMS of 3 samples is 2.88675 m, the largest -4 m at 1 s");
}

// Nearest rank: of 1 ... 10 the 90th percentile is 9, the 91st 10, the 10th 1.
TEST(PercentileBelowTest, IsTheNearestRank) {
  const Channel samples = channel({10, 9, 8, 7, 6, 5, 4, 3, 2, 1});
  EXPECT_EQ(explanation(PercentileBelow(90, 9), samples), "that percentile of 10 samples is 9 m");
  EXPECT_EQ(explanation(PercentileBelow(91, 9), samples), "that percentile of 10 samples is 10 m");
  EXPECT_EQ(explanation(PercentileBelow(10, 9), samples), "that percentile of 10 samples is 1 m");
  EXPECT_EQ(explanation(PercentileBelow(0.1, 9), samples), "that percentile of 10 samples is 1 m");
  EXPECT_TRUE(matches(PercentileBelow(90, 9.5), samples));
  EXPECT_FALSE(matches(PercentileBelow(90, 9), samples));
}

TEST(NoGapLongerThanTest, CountsTheEdgesOfTheWindow) {
  Channel samples("dsc/gnss/epochs", kStart);
  for (const Duration t : {2s, 5s, 3s}) samples.add(kStart + t, 1);  // the order does not matter
  EXPECT_TRUE(matches(NoGapLongerThan(2s), samples));
  EXPECT_FALSE(matches(NoGapLongerThan(2s - 1ns), samples));
  EXPECT_EQ(explanation(NoGapLongerThan(1s, until(10s)), samples),
            "the longest is 5 s, from 5 s to 10 s");
  EXPECT_EQ(explanation(NoGapLongerThan(1s, from(3s)), samples),
            "the longest is 2 s, from 3 s to 5 s");
}

TEST(HappensTest, CountsWhatWasRecorded) {
  const Channel samples = channel({1, 1, 1});
  EXPECT_TRUE(matches(HappensExactly(3), samples));
  EXPECT_TRUE(matches(HappensExactly(1, from(2s)), samples));
  EXPECT_TRUE(matches(HappensExactly(0), channel({}))) << "none is a count as well";
  EXPECT_EQ(explanation(HappensExactly(2), samples), "it happened 3 times, the last at 2 s");
}

TEST(HappensTest, BeforeComparesTheFirstOfEach) {
  Channel early("dsc/modes/safe", kStart), late("osc/modes/safe", kStart);
  early.add(kStart + 5s, 1);
  late.add(kStart + 6s, 1);
  EXPECT_TRUE(matches(HappensBefore(late), early));
  EXPECT_FALSE(matches(HappensBefore(early), late));
  EXPECT_FALSE(matches(HappensBefore(early), early)) << "at the same instant is not before";
  const Channel never("osc/modes/escape", kStart);
  EXPECT_FALSE(matches(HappensBefore(never), early));
  EXPECT_EQ(explanation(HappensBefore(never), early), "\"osc/modes/escape\" never happened");
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
