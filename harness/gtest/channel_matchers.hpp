/// GMock matchers on what was recorded over simulated time.
///
///   EXPECT_THAT(relative_navigation_error("dsc"), AlwaysBelow(0.01, from(50min)));
///   EXPECT_THAT(channel("dsc/wheel/speed_radps"), AllOf(NeverAbove(600), NoGapLongerThan(2s)));
///   EXPECT_THAT(channel("dsc/mode").only("SAFE"),
///   HappensBefore(channel("osc/mode").only("SAFE")));
///
/// Windows   time_window.hpp. A channel without samples in the window is a failure of the test,
///           under Not() too, and so are a value that is not a number, and events or states where
///           numbers are asked for: none of them says that all was well.
/// Vectors   are judged by their norm; Along() and AlongEachAxis() judge their components.
/// Messages  say which sample, when, of which spacecraft, along which axis, by how much, how many
///           others; for what passes, the nearest miss.
/// Errors    std::invalid_argument when the matcher is made: a limit that is not finite, an empty
///           interval, a percentage outside (0, 100], a span that is not positive, a window that is
///           an instant or counts packets.
#pragma once

#include <orrery/harness/gtest/time_window.hpp>
#include <orrery/harness/kernel/when.hpp>
#include <orrery/harness/record/channel.hpp>

#include <gmock/gmock.h>

#include <string>

namespace orrery {

class CampaignMetric;
using ChannelMatcher = testing::Matcher<const Channel&>;

/// Every sample is below the limit, the limit itself excluded; not above, the limit included.
ChannelMatcher AlwaysBelow(double limit, const TimeWindow& window = always());
ChannelMatcher NeverAbove(double limit, const TimeWindow& window = always());
ChannelMatcher AlwaysAbove(double limit, const TimeWindow& window = always());
ChannelMatcher NeverBelow(double limit, const TimeWindow& window = always());

/// Every sample, at least one sample, lies in [lower, upper].
ChannelMatcher AlwaysWithin(double lower, double upper, const TimeWindow& window = always());
ChannelMatcher EventuallyWithin(double lower, double upper, const TimeWindow& window = always());
/// Every sample later than `within` after the window's begin is below the limit, and there is one.
ChannelMatcher SettlesBelow(double limit, Duration within, const TimeWindow& window = always());
/// Root mean square over the samples, each with the same weight.
ChannelMatcher RmsBelow(double limit, const TimeWindow& window = always());
/// The smallest sample that at least `percent` % of the samples do not exceed (nearest rank).
/// Of a metric of a campaign (harness/campaign) likewise, over its runs; a run that did not record
/// it is worse than any limit. There a window throws std::invalid_argument.
class PercentileBelow {
 public:
  PercentileBelow(double percent, double limit, const TimeWindow& window = always());
  operator ChannelMatcher() const;
  operator testing::Matcher<const CampaignMetric&>() const;

 private:
  double percent_, limit_;
  TimeWindow window_;
};

/// No two successive samples are further apart in time; nor the first from the window's begin, nor
/// the last from its end, or from that of the run where the window has none.
ChannelMatcher NoGapLongerThan(Duration gap, const TimeWindow& window = always());
/// As many samples as that in the window: of events, of changes of a state. None at all is a count
/// of events and states alone, and of a window alone that the run has reached.
ChannelMatcher HappensExactly(int times, const TimeWindow& window = always());
/// The first sample of the channel comes before the first that `other` has now. Both have one.
ChannelMatcher HappensBefore(const Channel& other);

/// A matcher on the components of a vector along one axis ("R", "T", "N" in RTN, else "x", "y",
/// "z"), or along each: AlongEachAxis(AlwaysWithin(-0.1, 0.1)).
ChannelMatcher Along(std::string axis, ChannelMatcher matcher);
ChannelMatcher AlongEachAxis(ChannelMatcher matcher);

}  // namespace orrery
