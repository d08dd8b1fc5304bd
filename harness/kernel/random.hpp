/// Random streams: counter-based, each named by (seed, spacecraft, component, purpose).
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace orrery {

/// One stream of random numbers with its own distributions, so that results do not depend on the
/// standard library.
///
/// Method   Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC'11) keyed by a hash of the name; draw k
/// is a
///          function of (name, k) alone.
/// Note     Take no two draws in one expression: compilers evaluate arguments in different orders.
class RandomStream {
 public:
  /// `key` comes from RandomStreams; equal keys give equal streams.
  explicit RandomStream(std::uint64_t key) : key_(key) {}

  std::uint64_t bits();
  /// Uniform in the open interval (0, 1), 53 bits.
  double uniform();
  double uniform(double low, double high);
  /// One draw: inverse of the normal distribution, Wichura, AS 241 (1988), relative 1e-16.
  double normal();
  double normal(double mean, double sigma);
  /// exp of a normal with mean `mu` and deviation `sigma` (of the logarithm).
  double log_normal(double mu, double sigma);
  double exponential(double mean);
  /// Each of low ... high with equal probability, without bias.
  /// @throws std::invalid_argument  low > high.
  std::int64_t integer(std::int64_t low, std::int64_t high);
  bool bernoulli(double probability);

  std::uint64_t draws() const { return draws_; }

 private:
  std::uint64_t key_;
  std::uint64_t draws_ = 0;
  std::uint64_t block_[2] = {0, 0};
};

/// All streams of a run.
class RandomStreams {
 public:
  /// @throws std::invalid_argument  seed >= 2^53.
  explicit RandomStreams(std::uint64_t seed);

  /// The stream of that name, made at first use; the reference lives as long as this object.
  RandomStream& stream(std::string_view spacecraft, std::string_view component,
                       std::string_view purpose);
  std::uint64_t seed() const { return seed_; }
  /// 8 hex digits over every stream's name and draw count.
  std::string fingerprint() const;

 private:
  std::uint64_t seed_;
  std::map<std::string, std::unique_ptr<RandomStream>, std::less<>> streams_;
};

}  // namespace orrery
