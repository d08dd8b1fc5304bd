#include <orrery/models/radio/radio_link.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

// As in radio_link_test.cpp: tolerances are kSigmas standard deviations of the estimate.

namespace orrery {
namespace {

using Kind = LinkFate::Kind;

constexpr double kSigmas = 4.5;
constexpr int kMessages = 100'000;

struct TestLink {
  explicit TestLink(const RadioLinkOptions& options)
      : streams(20250320), link(options, streams, "dsc", "osc", std::make_shared<RadioMedium>()) {}
  LinkFate send(Duration t, std::size_t bytes = 256) { return link.send(from_ns(0) + t, bytes); }
  RandomStreams streams;
  RadioLink link;
};

// No blackout and 100 ms for every message.
RadioLinkOptions plain() {
  return {.delay = {.mu = std::log(0.1), .sigma = 0}, .p_on = 0};
}

TEST(LinkImpairmentsTest, DuplicatesComeWithTheirProbabilityAndADelayOfTheirOwn) {
  TestLink test({.p_on = 0, .p_duplicate = 0.01});
  int duplicates = 0;
  double sum_of_logs = 0;
  for (int i = 0; i < kMessages; ++i) {
    const LinkFate fate = test.send(i * 10s);
    if (!fate.duplicate_delay) continue;
    ++duplicates;
    EXPECT_NE(*fate.duplicate_delay, fate.delay);
    sum_of_logs += std::log(to_seconds(*fate.duplicate_delay));
  }
  EXPECT_NEAR(duplicates, 0.01 * kMessages, kSigmas * std::sqrt(0.01 * 0.99 * kMessages));
  // ln(delay) is normal with mean 0 and deviation ln(10)/3.
  EXPECT_NEAR(sum_of_logs / duplicates, 0, kSigmas * 0.7675 / std::sqrt(duplicates));
}

// 1 - (1 - b)^n with b = 1e-4 and n = 2048 bits: 0.18518.
TEST(LinkImpairmentsTest, MessagesAreHitAsOftenAsIndependentBitsAre) {
  TestLink test({.p_on = 0, .bit_error_rate = 1e-4});
  int hit = 0;
  for (int i = 0; i < kMessages; ++i) hit += test.send(i * 10s).kind == Kind::kCorrupted ? 1 : 0;
  const double p = -std::expm1(2048 * std::log1p(-1e-4));
  EXPECT_NEAR(hit, p * kMessages, kSigmas * std::sqrt(p * (1 - p) * kMessages));
}

// The number of inverted bits is binomial (n, b), zero included; each bit is hit equally often.
TEST(LinkImpairmentsTest, BitsAreInvertedIndependently) {
  constexpr double kRate = 0.01;
  constexpr std::size_t kBits = 64;
  TestLink test({.p_on = 0, .bit_error_rate = kRate, .receiver_checks = false});
  double total = 0, squares = 0;
  std::vector<int> by_bit(kBits);
  for (int i = 0; i < kMessages; ++i) {
    const LinkFate fate = test.send(i * 10s, kBits / 8);
    ASSERT_EQ(fate.kind, Kind::kDelivered);
    ByteBuffer bytes(kBits / 8);
    if (fate.has_bit_errors) test.link.invert_bits(bytes);
    double inverted = 0;
    for (std::size_t bit = 0; bit < kBits; ++bit) {
      if ((bytes[bit / 8] & (std::byte{1} << (bit % 8))) == std::byte{0}) continue;
      ++by_bit[bit];
      ++inverted;
    }
    EXPECT_EQ(inverted > 0, fate.has_bit_errors);
    if (fate.has_bit_errors) {
      EXPECT_EQ(static_cast<double>(test.link.inverted_bits()), inverted);
    }
    total += inverted;
    squares += inverted * inverted;
  }
  const double mean = total / kMessages, variance = squares / kMessages - mean * mean;
  const double expected_variance = kBits * kRate * (1 - kRate);  // 0.6336
  EXPECT_NEAR(mean, kBits * kRate, kSigmas * std::sqrt(expected_variance / kMessages));
  // Var(s^2) = (mu4 - s^4)/n, mu4 = s^2 (1 + 3 s^2 (1 - 2/n)) nearly 1.80 for these: deviation
  // 0.0037.
  EXPECT_NEAR(variance, expected_variance, kSigmas * 0.0038);
  const double per_bit = kRate * kMessages;
  for (const int count : by_bit) EXPECT_NEAR(count, per_bit, kSigmas * std::sqrt(per_bit));
}

TEST(LinkImpairmentsTest, TruncationLeavesAnyShorterLengthEquallyOften) {
  TestLink test({.p_on = 0, .p_truncate = 0.5});
  std::vector<int> lengths(5);
  for (int i = 0; i < kMessages; ++i) {
    const std::size_t kept = test.send(i * 10s, 4).kept_bytes;
    ASSERT_LE(kept, 4u);
    ++lengths[kept];
  }
  EXPECT_NEAR(lengths[4], 0.5 * kMessages, kSigmas * std::sqrt(0.25 * kMessages));
  const double p = 0.125;
  for (int kept = 0; kept < 4; ++kept) {
    EXPECT_NEAR(lengths[kept], p * kMessages, kSigmas * std::sqrt(p * (1 - p) * kMessages)) << kept;
  }
}

// 1000 bytes at 8 kbit/s take 1 s each; the plain delay is 100 ms.
TEST(LinkImpairmentsTest, MessagesWaitForThoseBeforeThem) {
  RadioLinkOptions options = plain();
  options.rate_bps = 8000;
  TestLink test(options);
  EXPECT_EQ(test.send(0s, 1000).delay, 1100ms);
  EXPECT_EQ(test.send(0s, 1000).delay, 2100ms);
  EXPECT_EQ(test.send(1500ms, 1000).delay, 1600ms);  // until 2 s the second is on air
  EXPECT_EQ(test.send(10s, 500).delay, 600ms);       // the queue has emptied
  EXPECT_EQ(test.send(20s, 1).delay, 101ms);
}

TEST(LinkImpairmentsTest, TheNewestIsDroppedFromAFullQueue) {
  RadioLinkOptions options = plain();
  options.rate_bps = 8000;
  options.queue_bytes = 2000;
  TestLink test(options);
  EXPECT_EQ(test.send(0s, 1000).kind, Kind::kDelivered);
  EXPECT_EQ(test.send(0s, 1000).kind, Kind::kDelivered);
  EXPECT_EQ(test.send(1s - 1ns, 1).kind, Kind::kQueueFull);
  EXPECT_EQ(test.send(1s, 1000).kind, Kind::kDelivered);  // the first has left
  EXPECT_EQ(test.send(1s, 1).kind, Kind::kQueueFull);
}

// At full load a queue of k messages loses what exceeds the rate: 2 messages a second in, 1 out.
TEST(LinkImpairmentsTest, AnOverloadedLinkCarriesItsRate) {
  RadioLinkOptions options = plain();
  options.rate_bps = 8000;
  options.queue_bytes = 10'000;
  TestLink test(options);
  int delivered = 0;
  for (int i = 0; i < 2000; ++i) delivered += test.send(i * 500ms, 1000).kind == Kind::kDelivered;
  EXPECT_NEAR(delivered, 1000, 10);  // and at most the queue's content at the end
}

TEST(LinkImpairmentsTest, OrderIsPreservedOnRequest) {
  TestLink unordered({.p_on = 0, .p_duplicate = 0.1});
  TestLink ordered({.p_on = 0, .p_duplicate = 0.1, .preserve_order = true});
  Duration latest{};
  int overtaken = 0, unchanged = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Duration sent = i * 1s;
    const LinkFate as_drawn = unordered.send(sent), fate = ordered.send(sent);
    EXPECT_GT(sent + fate.delay, latest) << i;
    EXPECT_GE(fate.delay, as_drawn.delay) << i;
    unchanged += fate.delay == as_drawn.delay ? 1 : 0;
    overtaken += sent + as_drawn.delay < latest ? 1 : 0;
    latest = sent + std::max(fate.delay, fate.duplicate_delay.value_or(0s));
  }
  EXPECT_GT(overtaken, 1000);
  EXPECT_GT(unchanged, 5000);
}

TEST(LinkImpairmentsTest, LongMessagesAreDroppedOrFragmented) {
  RadioLinkOptions options = plain();
  options.mtu_bytes = 100;
  TestLink dropping(options);
  EXPECT_EQ(dropping.send(0s, 100).kind, Kind::kDelivered);
  EXPECT_EQ(dropping.send(1s, 101).kind, Kind::kTooLong);

  // Frames are lost independently with p_on = 1 - p_off = p: a message of n is lost with
  // 1 - (1 - p)^n.
  constexpr double kLoss = 0.1;
  options.p_on = kLoss;
  options.p_off = 1 - kLoss;
  options.fragment = true;
  TestLink fragmenting(options);
  int lost = 0;
  for (int i = 0; i < kMessages; ++i)
    lost += fragmenting.send(i * 1s, 301).kind != Kind::kDelivered;
  const double p = 1 - std::pow(1 - kLoss, 4);
  EXPECT_NEAR(lost, p * kMessages, kSigmas * std::sqrt(p * (1 - p) * kMessages));
}

TEST(LinkImpairmentsTest, AHeldMessageIsReleasedByTheNextThatPasses) {
  TestLink losing({.p_on = 0.3, .p_off = 0.3});
  TestLink holding({.p_on = 0.3, .p_off = 0.3, .hold_in_blackout = true});
  bool some_held = false;
  int released = 0;
  for (int i = 0; i < 1000; ++i) {
    const LinkFate lost = losing.send(i * 1s), held = holding.send(i * 1s);
    EXPECT_EQ(lost.kind == Kind::kBlackout, held.kind == Kind::kHeld) << i;
    EXPECT_EQ(held.ends_blackout, some_held && held.kind == Kind::kDelivered) << i;
    EXPECT_FALSE(lost.ends_blackout) << i;
    released += held.ends_blackout ? 1 : 0;
    some_held = held.kind == Kind::kHeld;
  }
  EXPECT_GT(released, 100);
}

TEST(LinkImpairmentsTest, WhatIsOffDrawsNothingAndMovesNothing) {
  TestLink plain_link({});
  TestLink rough({.p_duplicate = 0.1,
                  .p_truncate = 0.1,
                  .bit_error_rate = 1e-4,
                  .receiver_checks = false,
                  .rate_bps = 1'000'000'000'000,
                  .mtu_bytes = 1000});
  for (int i = 0; i < 1000; ++i) {
    const LinkFate a = plain_link.send(i * 10s), b = rough.send(i * 10s);
    EXPECT_EQ(a.kind, b.kind) << i;
    EXPECT_LE(b.delay - a.delay, 3ns) << i;  // 2048 bits at 1 Tbit/s
  }
  RandomStreams named(20250320);
  for (const char* purpose : {"blackout", "delay"}) {
    RandomStream& stream = named.stream("dsc", "link/osc", purpose);
    for (int i = 0; i < 1000; ++i) stream.uniform();
  }
  EXPECT_EQ(plain_link.streams.fingerprint(), named.fingerprint());
}

TEST(LinkImpairmentsTest, OptionsOutOfRangeAreRefused) {
  const auto refused = [](const RadioLinkOptions& options, const char* text) {
    EXPECT_THAT([&] { TestLink link(options); },
                testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr(text)));
  };
  refused({.p_duplicate = 1.1}, "p_duplicate = 1.1; accepted: 0 to 1");
  refused({.p_truncate = -0.1}, "p_truncate = -0.1");
  refused({.bit_error_rate = 0.6}, "bit_error_rate = 0.6; accepted: 0 to 0.5");
  refused({.half_duplex = true}, "half_duplex with rate_bps = 0");
  refused({.visibility = {.max_range_m = -1}}, "max_range_m = -1");
  RandomStreams streams(1);
  const auto alone = [&] { RadioLink({.rate_bps = 1, .half_duplex = true}, streams, "a", "b"); };
  EXPECT_THAT(alone, testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("medium")));
}

}  // namespace
}  // namespace orrery
