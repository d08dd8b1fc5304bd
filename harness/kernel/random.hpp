/// Random streams: counter-based, each named by (seed, spacecraft, component, purpose).
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace orrery {

/// Philox4x32-10: ten rounds over `counter` under `key`.
/// Source  Salmon, Moraes, Dror & Shaw, Parallel random numbers: as easy as 1, 2, 3 (SC'11).
std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key);

/// The number below which a standard normal variable lies with probability `p`.
/// Method  Wichura, Algorithm AS 241 (PPND16), Applied Statistics 37 (1988): relative 1e-16.
/// @throws std::invalid_argument  p outside (0, 1).
double normal_quantile(double p);

/// One stream of random numbers with its own distributions, so that results do not depend on the
/// standard library.
///
/// Method   Philox4x32-10 keyed by a hash of the name; draw k is a function of (name, k) alone.
/// Note     Take no two draws in one expression: compilers evaluate arguments in different orders.
/// Errors   A parameter that is not finite or out of range throws std::invalid_argument.
class RandomStream {
 public:
  /// `key` comes from RandomStreams; equal keys give equal streams.
  explicit RandomStream(std::uint64_t key) : key_(key) {}

  std::uint64_t bits();
  /// Uniform in the open interval (0, 1): the 2^52 odd multiples of 2^-53.
  double uniform();
  /// From `low` to `high`; rounding may give the ends themselves. low <= high.
  double uniform(double low, double high);
  /// One draw: normal_quantile of uniform(). Within +-8.21.
  double normal();
  /// sigma >= 0.
  double normal(double mean, double sigma);
  /// exp of a normal with mean `mu` and deviation `sigma` >= 0 (of the logarithm).
  double log_normal(double mu, double sigma);
  /// mean >= 0. One draw.
  double exponential(double mean);
  /// Each of low ... high with equal probability, without bias: one draw, rarely more.
  /// @throws std::invalid_argument  low > high.
  std::int64_t integer(std::int64_t low, std::int64_t high);
  /// True with this probability, 0 to 1. Always one draw, for 0 (never) and 1 (always) as well.
  bool bernoulli(double probability);

  /// The next whole block of Philox, which counts as two draws; where one draw is left of the last
  /// block, that one is passed over and counted as well.
  std::array<std::uint64_t, 2> block();

  /// 64-bit draws so far.
  std::uint64_t draws() const { return draws_; }

 private:
  std::uint64_t key_;
  std::uint64_t draws_ = 0;
  std::uint64_t second_ = 0;  // a block of Philox gives two draws
};

/// Three standard normals from one block() of each stream; a stream that occurs twice gives its
/// next block the second time. What one stream gives does not depend on the others.
///
/// Method   normal_quantile of (k + 1/2) 2^-42 with 42 bits k of the block each: within +-7.1. For
/// a
///          dozen streams two to three times as fast as so many normal(), whose latencies do not
///          overlap.
/// @param out  As many as there are streams.
void normal_triples(std::span<RandomStream* const> streams, std::span<std::array<double, 3>> out);

/// All streams of a run.
class RandomStreams {
 public:
  /// @throws std::invalid_argument  seed >= 2^53.
  explicit RandomStreams(std::uint64_t seed);

  /// The stream of that name, made at first use; the reference lives as long as this object.
  /// No allocation after the first use.
  RandomStream& stream(std::string_view spacecraft, std::string_view component,
                       std::string_view purpose);
  std::uint64_t seed() const { return seed_; }
  /// 8 hex digits over every stream's name and draw count.
  std::string fingerprint() const;

 private:
  using Name = std::array<std::string, 3>;
  using NameView = std::array<std::string_view, 3>;
  struct NameOrder {
    using is_transparent = void;
    template <class A, class B>
    bool operator()(const A& a, const B& b) const {
      return view(a) < view(b);
    }
    static const NameView& view(const NameView& name) { return name; }
    static NameView view(const Name& name) { return {name[0], name[1], name[2]}; }
  };

  std::uint64_t seed_;
  std::map<Name, RandomStream, NameOrder> streams_;
};

}  // namespace orrery
