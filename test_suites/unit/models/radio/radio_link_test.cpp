#include <orrery/models/radio/radio_link.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

// Statistics are compared with theory. Each tolerance is kSigmas standard deviations of the
// estimate, derived beside it; 4.5 would be passed by chance once in 150 000 seeds. The seed is
// fixed, so a failure means a changed generator or a wrong model, never bad luck.

namespace orrery {
namespace {

constexpr double kSigmas = 4.5;
constexpr int kMessages = 200'000;
constexpr std::uint64_t kSeed = 20250320;

std::vector<LinkFate> send(RadioLink& link, int messages) {
  std::vector<LinkFate> fates;
  fates.reserve(messages);
  for (int i = 0; i < messages; ++i) fates.push_back(link.send(from_ns(0) + i * 10s, 256));
  return fates;
}

std::vector<LinkFate> send_over_new_link(const RadioLinkOptions& options, int messages) {
  RandomStreams streams(kSeed);
  RadioLink link(options, streams, "dsc", "osc");
  return send(link, messages);
}

bool lost(const LinkFate& fate) {
  return fate.kind == LinkFate::Kind::kBlackout;
}

// Lengths of the runs of messages with the given fate, the unfinished last run left out.
std::vector<int> run_lengths(const std::vector<LinkFate>& fates, bool of_lost) {
  std::vector<int> lengths;
  int length = 0;
  for (const LinkFate& fate : fates) {
    if (lost(fate) == of_lost) {
      ++length;
    } else if (length > 0) {
      lengths.push_back(length);
      length = 0;
    }
  }
  return lengths;
}

// Runs end with probability p at each message: P(k) = (1-p)^(k-1) p, mean 1/p, variance (1-p)/p^2.
void expect_geometric(const std::vector<int>& lengths, double p) {
  const double n = static_cast<double>(lengths.size());
  double sum = 0;
  for (const int length : lengths) sum += length;
  EXPECT_NEAR(sum / n, 1 / p, kSigmas * std::sqrt((1 - p) / (p * p) / n));
  double probability = p;
  for (int k = 1; k <= 8; ++k) {
    const auto count = std::count(lengths.begin(), lengths.end(), k);
    EXPECT_NEAR(static_cast<double>(count) / n, probability,
                kSigmas * std::sqrt(probability * (1 - probability) / n))
        << "runs of " << k;
    probability *= 1 - p;
  }
}

// Stationary probability pi = p_on/(p_on + p_off) = 1/6. Losses are correlated by
// r = 1 - p_on - p_off = 0.7 from message to message, so the loss over n messages has the variance
// pi (1 - pi)/n (1 + r)/(1 - r), of which independent losses would have 1/5.7. Over many links the
// deviations in units of its root have mean 0 and mean square 1, themselves known to
// 1/sqrt(links) and sqrt(2/links); observed: -0.04 and 1.04.
TEST(RadioLinkTest, LossHasTheMeanAndTheVarianceOfTheMarkovChain) {
  constexpr int kLinks = 400;
  constexpr int kMessagesEach = 2'500;
  const double pi = 0.05 / 0.30;
  const double variance = pi * (1 - pi) / kMessagesEach * (1 + 0.7) / (1 - 0.7);
  RandomStreams streams(kSeed);
  double sum = 0;
  double sum_of_squares = 0;
  for (int i = 0; i < kLinks; ++i) {
    RadioLink link({}, streams, "dsc", std::to_string(i));
    const std::vector<LinkFate> fates = send(link, kMessagesEach);
    const auto losses = std::count_if(fates.begin(), fates.end(), lost);
    const double z = (static_cast<double>(losses) / kMessagesEach - pi) / std::sqrt(variance);
    sum += z;
    sum_of_squares += z * z;
  }
  EXPECT_NEAR(sum / kLinks, 0, kSigmas / std::sqrt(double{kLinks}));
  EXPECT_NEAR(sum_of_squares / kLinks, 1, kSigmas * std::sqrt(2.0 / kLinks));
}

TEST(RadioLinkTest, BlackoutsAreGeometricWithAMeanOfFourMessages) {
  expect_geometric(run_lengths(send_over_new_link({}, kMessages), true), 0.25);
}

TEST(RadioLinkTest, GapsBetweenBlackoutsAreGeometricWithAMeanOfTwentyMessages) {
  expect_geometric(run_lengths(send_over_new_link({}, kMessages), false), 0.05);
}

// The chain steps first and the new state decides: with both probabilities 1 the first message is
// lost, the second is not. Test-then-step would deliver the first.
TEST(RadioLinkTest, ChainStepsBeforeTheMessageIsJudged) {
  const std::vector<LinkFate> fates = send_over_new_link({.p_on = 1, .p_off = 1}, 6);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(lost(fates[i]), i % 2 == 0) << i;
}

TEST(RadioLinkTest, WithoutBlackoutEveryMessageArrives) {
  for (const LinkFate& fate : send_over_new_link({.p_on = 0}, 10'000)) ASSERT_FALSE(lost(fate));
}

TEST(RadioLinkTest, BlackoutThatNeverEndsLosesEveryMessage) {
  for (const LinkFate& fate : send_over_new_link({.p_on = 1, .p_off = 0}, 10'000)) {
    ASSERT_TRUE(lost(fate));
  }
}

// The delay of every message, in seconds, in order of sending.
std::vector<double> delays_s(int messages) {
  std::vector<double> delays;
  for (const LinkFate& fate : send_over_new_link({.p_on = 0}, messages)) {
    delays.push_back(to_seconds(fate.delay));
  }
  return delays;
}

// Closed form for mu = 0, sigma = ln(10)/3: exp(z sigma) with z = 0, 1.2816, 2.3263 and -3, 3.
// A share p of n draws has deviation sqrt(p (1-p)/n).
TEST(RadioLinkTest, DelayHasTheQuantilesOfTheLogNormal) {
  const std::vector<double> delays = delays_s(kMessages);
  const auto expect_share_below = [&](double delay_s, double p) {
    const auto below =
        std::count_if(delays.begin(), delays.end(), [&](double delay) { return delay < delay_s; });
    EXPECT_NEAR(static_cast<double>(below) / kMessages, p,
                kSigmas * std::sqrt(p * (1 - p) / kMessages))
        << "below " << delay_s << " s";
  };
  expect_share_below(0.1, 0.001349898);  // -3 sigma
  expect_share_below(1.0, 0.5);
  expect_share_below(2.6741382, 0.9);
  expect_share_below(5.9627869, 0.99);
  expect_share_below(10.0, 0.998650102);  // +3 sigma
}

// Kolmogorov-Smirnov: sqrt(n) D exceeds x with probability 2 exp(-2 x^2); 2.2: 1.3e-4.
TEST(RadioLinkTest, DelayFollowsTheLogNormalEverywhere) {
  std::vector<double> delays = delays_s(kMessages);
  std::sort(delays.begin(), delays.end());
  const double sigma = std::log(10.0) / 3;
  double distance = 0;
  for (int i = 0; i < kMessages; ++i) {
    const double expected = 0.5 * std::erfc(-std::log(delays[i]) / sigma / std::sqrt(2.0));
    distance = std::max({distance, expected - static_cast<double>(i) / kMessages,
                         static_cast<double>(i + 1) / kMessages - expected});
  }
  EXPECT_LT(std::sqrt(static_cast<double>(kMessages)) * distance, 2.2);
}

// Mean exp(sigma^2/2) = 1.342522 s, deviation 1.202562 s.
TEST(RadioLinkTest, DelayHasTheMeanOfTheLogNormal) {
  double sum = 0;
  for (const double delay : delays_s(kMessages)) sum += delay;
  EXPECT_NEAR(sum / kMessages, 1.342522, kSigmas * 1.202562 / std::sqrt(double{kMessages}));
}

// Of two neighbours sent dt apart, the second arrives first with probability
// P(X1 > X2 + dt) = integral of phi(z) Phi(ln(exp(sigma z) - dt)/sigma) dz, evaluated by the
// midpoint rule outside this program. Pairs are disjoint, hence independent.
TEST(RadioLinkTest, NeighboursOvertakeAsOftenAsIndependentDelaysDo) {
  const std::vector<double> delays = delays_s(2 * kMessages);
  const auto expect_overtaken = [&](double dt_s, double p) {
    int overtaken = 0;
    for (std::size_t i = 0; i < delays.size(); i += 2) {
      if (delays[i] > dt_s + delays[i + 1]) ++overtaken;
    }
    EXPECT_NEAR(static_cast<double>(overtaken) / kMessages, p,
                kSigmas * std::sqrt(p * (1 - p) / kMessages))
        << "sent " << dt_s << " s apart";
  };
  expect_overtaken(1, 0.188598);
  expect_overtaken(2, 0.0763382);
  expect_overtaken(5, 0.00942583);
  expect_overtaken(10, 0.000847158);
}

TEST(RadioLinkTest, NoMessageArrivesBeforeTheMinimumDelay) {
  const std::vector<LinkFate> fates =
      send_over_new_link({.minimum_delay = 1s, .p_on = 0}, kMessages);
  int at_minimum = 0;
  for (const LinkFate& fate : fates) {
    ASSERT_GE(fate.delay, 1s);
    if (fate.delay == 1s) ++at_minimum;
  }
  // The median is 1 s: half of the messages are held back to it, deviation sqrt(1/4/n).
  EXPECT_NEAR(static_cast<double>(at_minimum) / kMessages, 0.5,
              kSigmas * std::sqrt(0.25 / kMessages));
}

TEST(RadioLinkTest, WithoutSpreadEveryDelayIsTheMedian) {
  const RadioLinkOptions options{.delay = {.mu = std::log(2.5), .sigma = 0}, .p_on = 0};
  for (const LinkFate& fate : send_over_new_link(options, 100)) {
    // exp(ln(2.5)) may be off by an ulp, 0.4 fs; rounded to nanoseconds it is exact.
    EXPECT_EQ(fate.delay, 2500ms);
  }
}

std::vector<Duration> all_delays(const std::vector<LinkFate>& fates) {
  std::vector<Duration> delays;
  for (const LinkFate& fate : fates) delays.push_back(fate.delay);
  return delays;
}

TEST(RadioLinkTest, TrafficOnOtherLinksChangesNothing) {
  const std::vector<LinkFate> alone = send_over_new_link({}, 1000);

  RandomStreams streams(kSeed);
  RadioLink reverse({}, streams, "osc", "dsc");
  RadioLink other({}, streams, "dsc", "third");
  RadioLink link({}, streams, "dsc", "osc");
  std::vector<LinkFate> among_others;
  for (int i = 0; i < 1000; ++i) {
    reverse.send(from_ns(0), 1);
    if (i % 3 == 0) other.send(from_ns(0), 1);
    among_others.push_back(link.send(from_ns(0), 1));
  }
  ASSERT_EQ(among_others.size(), alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(among_others[i].kind, alone[i].kind) << i;
    EXPECT_EQ(among_others[i].delay, alone[i].delay) << i;
  }
}

TEST(RadioLinkTest, DirectionsDrawDifferently) {
  RandomStreams streams(kSeed);
  RadioLink there({.p_on = 0}, streams, "dsc", "osc");
  RadioLink back({.p_on = 0}, streams, "osc", "dsc");
  EXPECT_NE(all_delays(send(there, 100)), all_delays(send(back, 100)));
}

TEST(RadioLinkTest, BlackoutOptionsLeaveTheDelaysOfArrivingMessagesAsTheyWere) {
  const std::vector<LinkFate> clear = send_over_new_link({.p_on = 0}, 1000);
  const std::vector<LinkFate> gappy = send_over_new_link({.p_on = 0.3}, 1000);
  int arrived = 0;
  for (std::size_t i = 0; i < clear.size(); ++i) {
    if (lost(gappy[i])) continue;
    ++arrived;
    EXPECT_EQ(gappy[i].delay, clear[i].delay) << i;
  }
  EXPECT_GT(arrived, 100);
  EXPECT_LT(arrived, 900);
}

TEST(RadioLinkOptionsTest, DefaultDelayIsTheOneFromATenthToTenSecondsAtThreeSigma) {
  const LogNormalDelay delay = log_normal_delay(0.1, 10.0);
  EXPECT_NEAR(delay.mu, 0.0, 1e-15);
  EXPECT_NEAR(delay.sigma, std::log(10.0) / 3, 1e-15);
  EXPECT_DOUBLE_EQ(RadioLinkOptions{}.delay.sigma, delay.sigma);
}

TEST(RadioLinkOptionsTest, DelayFromBoundsHasThemAtKSigma) {
  const LogNormalDelay delay = log_normal_delay(0.5, 3.0, 2);
  EXPECT_NEAR(std::exp(delay.mu - 2 * delay.sigma), 0.5, 1e-15);
  EXPECT_NEAR(std::exp(delay.mu + 2 * delay.sigma), 3.0, 1e-14);
}

TEST(RadioLinkOptionsTest, DelayBoundsOutOfRangeAreRefused) {
  EXPECT_THROW(log_normal_delay(0, 1), std::invalid_argument);
  EXPECT_THROW(log_normal_delay(2, 1), std::invalid_argument);
  EXPECT_THROW(log_normal_delay(1, 2, 0), std::invalid_argument);
  EXPECT_THROW(log_normal_delay(1, std::numeric_limits<double>::infinity()), std::invalid_argument);
}

TEST(RadioLinkOptionsTest, ValuesOutOfRangeAreNamedWithTheirRange) {
  const auto expect_refused = [](const RadioLinkOptions& options, const char* text) {
    RandomStreams streams(1);
    EXPECT_THAT([&] { RadioLink link(options, streams, "dsc", "osc"); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
  };
  expect_refused({.p_on = -0.1}, "p_on = -0.1; accepted: 0 to 1");
  expect_refused({.p_on = 1.5}, "p_on = 1.5");
  expect_refused({.p_on = std::numeric_limits<double>::quiet_NaN()}, "p_on = nan");
  expect_refused({.p_off = -1e-9}, "p_off = -1e-09");
  expect_refused({.delay = {.sigma = -1}}, "delay.sigma = -1");
  expect_refused({.delay = {.mu = 11}}, "delay.mu = 11; accepted: -20 to 10");
  expect_refused({.minimum_delay = -1ns}, "minimum_delay = -1 ns");
}

TEST(RadioLinkOptionsTest, FatesHaveTheWordsOfTheLinkRecords) {
  EXPECT_EQ(to_string(LinkFate::Kind::kDelivered), "delivered");
  EXPECT_EQ(to_string(LinkFate::Kind::kBlackout), "blackout");
}

}  // namespace
}  // namespace orrery
