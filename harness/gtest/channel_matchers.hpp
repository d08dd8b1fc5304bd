/// GMock matchers on what was recorded over simulated time.
///
///   EXPECT_THAT(relative_navigation_error("dsc"), AlwaysBelow(0.01, from(50min)));
///   EXPECT_THAT(channel("dsc/wheel/speed_radps"), AllOf(NeverAbove(600), NoGapLongerThan(2s)));
///
/// Windows  from, until, between, counted from the start of the channel's world. A channel without
///          samples in the window is a failure, under Not() too, and so is a value that is not a
///          number: neither says that all was well.
/// Messages say which sample, when, by how much, how many others; for what passes, the nearest
/// miss. Errors   std::invalid_argument when the matcher is made: a limit that is not finite, an
/// empty
///          interval, a percentage outside (0, 100], a span that is not positive, a window that is
///          an instant or counts packets.
#pragma once

#include <orrery/harness/kernel/when.hpp>
#include <orrery/harness/record/channel.hpp>

#include <gmock/gmock.h>

namespace orrery {

using ChannelMatcher = testing::Matcher<const Channel&>;

/// Every sample is below the limit, the limit itself excluded; not above, the limit included.
ChannelMatcher AlwaysBelow(double limit, const When& window = always());
ChannelMatcher NeverAbove(double limit, const When& window = always());
ChannelMatcher AlwaysAbove(double limit, const When& window = always());
ChannelMatcher NeverBelow(double limit, const When& window = always());

/// At least one sample lies in [lower, upper].
ChannelMatcher EventuallyWithin(double lower, double upper, const When& window = always());
/// Every sample later than `within` after the window's begin is below the limit, and there is one.
ChannelMatcher SettlesBelow(double limit, Duration within, const When& window = always());
/// Root mean square over the samples, each with the same weight.
ChannelMatcher RmsBelow(double limit, const When& window = always());
/// The smallest sample that at least `percent` % of the samples do not exceed (nearest rank).
ChannelMatcher PercentileBelow(double percent, double limit, const When& window = always());
/// No two successive samples are further apart in time; nor the first from the window's begin, nor
/// the last from its end, if it has one.
ChannelMatcher NoGapLongerThan(Duration gap, const When& window = always());
/// As many samples as that in the window: of a channel that records something that happens.
ChannelMatcher HappensExactly(int times, const When& window = always());
/// The first sample of the channel comes before the first of `other`, which has one.
ChannelMatcher HappensBefore(const Channel& other);

}  // namespace orrery
