#include <orrery/harness/kernel/fingerprint.hpp>
#include <orrery/harness/kernel/hash.hpp>

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace orrery {
namespace {

constexpr EventKind kBeep = {1001, "beep"};
constexpr EventKind kBoop = {1002, "boop"};

Bytes bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

// The first outputs of SplitMix64 from seed 1234567 as published with Vigna's reference code
// (prng.di.unimi.it) and on Rosetta Code. Our mix of the word 0 into h is one step from state h.
TEST(HashTest, MixIsSplitMix64) {
  constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15u;
  EXPECT_EQ(hash_word(1234567, 0), 6457827717110365317u);
  EXPECT_EQ(hash_word(1234567 + kGolden, 0), 3203168211198807973u);
  EXPECT_EQ(hash_word(1234567 + 2 * kGolden, 0), 9817491932198370423u);
}

TEST(HashTest, EveryBitOfChainAndWordReachesHalfOfTheOutput) {
  // 64 inputs x 64 output bits: the mean number of flipped bits is 32 with a deviation of
  // 4 / sqrt(64 * 100) = 0.05 over 100 base points; 0.3 is six of them.
  for (const bool flip_word : {false, true}) {
    double flipped = 0;
    for (std::uint64_t base = 1; base <= 100; ++base) {
      const std::uint64_t h = hash_word(base, 17);
      for (int bit = 0; bit < 64; ++bit) {
        const std::uint64_t mask = std::uint64_t{1} << bit;
        flipped += std::popcount(
            h ^ (flip_word ? hash_word(base, 17 ^ mask) : hash_word(base ^ mask, 17)));
      }
    }
    EXPECT_NEAR(flipped / 6400, 32.0, 0.3);
  }
}

TEST(HashTest, PartsOfANameDoNotRunTogether) {
  const auto name = [](std::string_view a, std::string_view b) {
    return hash_text(hash_text(0, a), b);
  };
  EXPECT_NE(name("a", "bc"), name("ab", "c"));
  EXPECT_NE(name("", "abc"), name("abc", ""));
}

TEST(HashTest, LengthsThatFillNoWordDiffer) {
  // Zero bytes are what the last word is filled up with.
  std::set<std::uint64_t> seen;
  const std::vector<std::byte> zeros(64);
  for (std::size_t n = 0; n <= 64; ++n) seen.insert(hash_bytes(0, Bytes(zeros).first(n)));
  EXPECT_EQ(seen.size(), 65u);
}

TEST(HashTest, EveryByteCounts) {
  std::string text = "two spacecraft, 300 m";
  const std::uint64_t h = hash_text(0, text);
  for (char& c : text) {
    c = static_cast<char>(c ^ 1);
    EXPECT_NE(hash_text(0, text), h);
    c = static_cast<char>(c ^ 1);
  }
}

TEST(FingerprintBitsTest, AllNansAreOne) {
  const double quiet = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(fingerprint_bits(quiet), 0x7ff8000000000000u);
  EXPECT_EQ(fingerprint_bits(std::copysign(quiet, -1.0)), 0x7ff8000000000000u);
  EXPECT_EQ(fingerprint_bits(std::bit_cast<double>(0xfff800000000beefu)), 0x7ff8000000000000u);
}

TEST(FingerprintBitsTest, NumbersKeepTheirBits) {
  EXPECT_EQ(fingerprint_bits(1.0), 0x3ff0000000000000u);
  EXPECT_EQ(fingerprint_bits(-0.0), 0x8000000000000000u);
  EXPECT_EQ(fingerprint_bits(-std::numeric_limits<double>::infinity()), 0xfff0000000000000u);
}

struct FingerprintTest : testing::Test {
  FingerprintTest() {
    for (int i = 0; i < 3; ++i) print.add_owner();
  }
  std::string after(const EventKey& next, std::uint16_t kind) const {
    Fingerprint copy = print;
    copy.event(next, kind);
    return copy.value();
  }
  Fingerprint print;
  EventKey key = {from_ns(5), Phase::kTick, 1, 2, 3};
};

TEST_F(FingerprintTest, EveryFieldOfAnEventCounts) {
  std::set<std::string> values = {print.value(), after(key, 7), after(key, 8)};
  for (const EventKey& other :
       {EventKey{from_ns(6), Phase::kTick, 1, 2, 3}, EventKey{from_ns(5), Phase::kOutput, 1, 2, 3},
        EventKey{from_ns(5), Phase::kTick, 0, 2, 3}, EventKey{from_ns(5), Phase::kTick, 1, 1, 3},
        EventKey{from_ns(5), Phase::kTick, 1, 2, 4}}) {
    values.insert(after(other, 7));
  }
  EXPECT_EQ(values.size(), 8u);
}

TEST_F(FingerprintTest, ValueIsSixteenHexDigits) {
  EXPECT_EQ(print.value().size(), 16u);
  EXPECT_EQ(print.value().find_first_not_of("0123456789abcdef"), std::string::npos);
}

TEST_F(FingerprintTest, OnlyTheDestinationsChainMoves) {
  const std::uint64_t chain_0 = print.chain(0);
  const std::uint64_t chain_1 = print.chain(1);
  print.event(key, 7);
  EXPECT_EQ(print.chain(0), chain_0);
  EXPECT_NE(print.chain(1), chain_1);
}

// Threads may interleave owners differently; each owner's own order is what counts.
TEST_F(FingerprintTest, InterleavingOfOwnersDoesNotCount) {
  const EventKey other = {from_ns(5), Phase::kTick, 2, 2, 3};
  Fingerprint swapped = print;
  print.event(key, 7);
  print.event(other, 7);
  swapped.event(other, 7);
  swapped.event(key, 7);
  EXPECT_EQ(print.value(), swapped.value());
}

TEST_F(FingerprintTest, OrderWithinAnOwnerCounts) {
  Fingerprint swapped = print;
  print.payload(1, bytes_of("first"));
  print.payload(1, bytes_of("second"));
  swapped.payload(1, bytes_of("second"));
  swapped.payload(1, bytes_of("first"));
  EXPECT_NE(print.value(), swapped.value());
}

TEST_F(FingerprintTest, SplitPayloadsDiffer) {
  Fingerprint split = print;
  print.payload(1, bytes_of("abcd"));
  split.payload(1, bytes_of("ab"));
  split.payload(1, bytes_of("cd"));
  EXPECT_NE(print.value(), split.value());
}

struct FirstDifferenceTest : testing::Test {
  std::vector<EventRecord> log() const {
    std::vector<EventRecord> records;
    for (int i = 0; i < 5; ++i) {
      records.push_back({{from_ns(i), Phase::kDevice, 0, 0, static_cast<std::uint64_t>(i)},
                         &kBeep,
                         static_cast<std::uint64_t>(100 + i)});
    }
    return records;
  }
};

TEST_F(FirstDifferenceTest, EqualLogsHaveNone) {
  EXPECT_FALSE(first_difference(log(), log()));
  EXPECT_FALSE(first_difference({}, {}));
}

TEST_F(FirstDifferenceTest, NamesTheEventThatDiffers) {
  std::vector<EventRecord> other = log();
  other[3].key.t = from_ns(33);
  const auto difference = first_difference(log(), other);
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->index, 3u);
  EXPECT_EQ(difference->a->key.t, from_ns(3));
  EXPECT_EQ(difference->b->key.t, from_ns(33));
}

TEST_F(FirstDifferenceTest, SeesKindAndPayloadAtEqualKeys) {
  std::vector<EventRecord> kind = log();
  kind[2].kind = &kBoop;
  EXPECT_EQ(first_difference(log(), kind)->index, 2u);
  std::vector<EventRecord> payload = log();
  payload[1].chain = 7;
  EXPECT_EQ(first_difference(log(), payload)->index, 1u);
}

TEST_F(FirstDifferenceTest, ALogThatEndedIsEmptyThere) {
  std::vector<EventRecord> shorter = log();
  shorter.resize(2);
  const auto difference = first_difference(log(), shorter);
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->index, 2u);
  EXPECT_TRUE(difference->a);
  EXPECT_FALSE(difference->b);
}

}  // namespace
}  // namespace orrery
