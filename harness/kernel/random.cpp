#include <orrery/harness/kernel/hash.hpp>
#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace orrery {
namespace {

__extension__ typedef unsigned __int128 uint128;

constexpr std::size_t kBatch = 16;  // streams whose normals are worked on together

std::uint32_t high(std::uint64_t x) {
  return static_cast<std::uint32_t>(x >> 32);
}
std::uint32_t low(std::uint64_t x) {
  return static_cast<std::uint32_t>(x);
}

[[noreturn]] void throw_parameter(const char* function, const char* name, double value,
                                  const char* range) {
  throw std::invalid_argument(std::string(function) + ": " + name + " = " + to_text(value) +
                              ", accepted: " + range);
}

void require_finite(const char* function, const char* name, double value) {
  if (!std::isfinite(value)) throw_parameter(function, name, value, "a finite number");
}

void require_not_negative(const char* function, const char* name, double value) {
  if (!(value >= 0.0 && std::isfinite(value))) {
    throw_parameter(function, name, value, "a finite number >= 0");
  }
}

// Numerator and denominator of Wichura's three rational approximations, constant term first.
struct Rational {
  double p[8], q[8];

  template <class Number>
  Number operator()(Number x) const {
    return horner(p, x) / horner(q, x);
  }

 private:
  template <class Number>
  static Number horner(const double (&c)[8], Number x) {
    return ((((((c[7] * x + c[6]) * x + c[5]) * x + c[4]) * x + c[3]) * x + c[2]) * x + c[1]) * x +
           c[0];
  }
};

// AS 241: coefficients a and b, |p - 1/2| <= 0.425.
constexpr Rational kCentral = {
    {3.3871328727963666080e0, 1.3314166789178437745e+2, 1.9715909503065514427e+3,
     1.3731693765509461125e+4, 4.5921953931549871457e+4, 6.7265770927008700853e+4,
     3.3430575583588128105e+4, 2.5090809287301226727e+3},
    {1.0, 4.2313330701600911252e+1, 6.8718700749205790830e+2, 5.3941960214247511077e+3,
     2.1213794301586595867e+4, 3.9307895800092710610e+4, 2.8729085735721942674e+4,
     5.2264952788528545610e+3}};
// c and d, tail probability above exp(-25).
constexpr Rational kTail = {
    {1.42343711074968357734e0, 4.63033784615654529590e0, 5.76949722146069140550e0,
     3.64784832476320460504e0, 1.27045825245236838258e0, 2.41780725177450611770e-1,
     2.27238449892691845833e-2, 7.74545014278341407640e-4},
    {1.0, 2.05319162663775882187e0, 1.67638483018380384940e0, 6.89767334985100004550e-1,
     1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4,
     1.05075007164441684324e-9}};
// e and f, below that.
constexpr Rational kFarTail = {
    {6.65790464350110377720e0, 5.46378491116411436990e0, 1.78482653991729133580e0,
     2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
     2.71155556874348757815e-5, 2.01033439929228813265e-7},
    {1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2,
     7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7,
     2.04426310338993978564e-15}};

constexpr double kCentralHalf = 0.425;

/// Of p = 1/2 + q, |q| <= kCentralHalf; beyond it the value means nothing.
template <class Number>
Number central_quantile(Number q) {
  return q * kCentral(0.180625 - q * q);
}

/// Of p = 1/2 + q with `tail` the smaller of p and 1 - p.
double tail_quantile(double q, double tail) {
  const double r = std::sqrt(-std::log(tail));
  const double size = r <= 5.0 ? kTail(r - 1.6) : kFarTail(r - 5.0);
  return q < 0.0 ? -size : size;
}

// normal_quantile for arguments known to lie in (0, 1).
double quantile(double p) {
  const double q = p - 0.5;
  if (std::fabs(q) <= kCentralHalf) return central_quantile(q);
  return tail_quantile(q, q < 0.0 ? p : 1.0 - p);
}

/// (k + 1/2) 2^-42 - 1/2, exact: the bits are put into the mantissa of a number in [1, 2).
double centred(std::uint64_t k) {
  return std::bit_cast<double>(std::uint64_t{0x3FF} << 52 | k << 10 | 1u << 9) - 1.5;
}

std::array<double, 3> centred_triple(const std::array<std::uint64_t, 2>& block) {
  constexpr std::uint64_t kLow22 = (1u << 22) - 1, kLow20 = (1u << 20) - 1;
  return {centred(block[0] >> 22), centred(block[1] >> 22),
          centred((block[0] & kLow22) << 20 | (block[1] & kLow20))};
}

/// Two numbers in one register of any x86-64 or AArch64; each rounds as it would alone.
typedef double TwoNumbers __attribute__((vector_size(16)));

using Batch = std::array<double, kBatch * 3>;
static_assert(kBatch * 3 % 2 == 0);

// First all as if they were central, by two and without a branch, so that nothing waits for
// anything; then the 15 % that are not.
void quantiles(const Batch& q, std::size_t n, Batch& out) {
  for (std::size_t i = 0; i < n; i += 2) {
    TwoNumbers two;
    std::memcpy(&two, &q[i], sizeof two);
    two = central_quantile(two);
    std::memcpy(&out[i], &two, sizeof two);
  }
  std::array<std::size_t, kBatch * 3> tails;
  std::size_t count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    tails[count] = i;
    count += std::fabs(q[i]) > kCentralHalf;
  }
  for (std::size_t k = 0; k < count; ++k) {
    const double x = q[tails[k]];
    out[tails[k]] = tail_quantile(x, 0.5 - std::fabs(x));
  }
}

}  // namespace

std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t product_0 = std::uint64_t{0xD2511F53} * counter[0];
    const std::uint64_t product_1 = std::uint64_t{0xCD9E8D57} * counter[2];
    counter = {high(product_1) ^ counter[1] ^ key[0], low(product_1),
               high(product_0) ^ counter[3] ^ key[1], low(product_0)};
    key[0] += 0x9E3779B9;  // golden ratio
    key[1] += 0xBB67AE85;  // sqrt(3) - 1
  }
  return counter;
}

double normal_quantile(double p) {
  if (!(p > 0.0 && p < 1.0)) throw_parameter("normal_quantile", "p", p, "0 < p < 1");
  return quantile(p);
}

std::uint64_t RandomStream::bits() {
  if (draws_ % 2 == 1) {
    ++draws_;
    return second_;
  }
  const auto pair = block();
  --draws_;
  second_ = pair[1];
  return pair[0];
}

std::array<std::uint64_t, 2> RandomStream::block() {
  const std::uint64_t block = (draws_ + 1) / 2;
  draws_ = 2 * block + 2;
  const auto word = philox4x32({low(block), high(block), 0, 0}, {low(key_), high(key_)});
  return {std::uint64_t{word[1]} << 32 | word[0], std::uint64_t{word[3]} << 32 | word[2]};
}

double RandomStream::uniform() {
  // Odd multiples of 2^-53 are exact, lie symmetrically about 1/2 and never reach 0 or 1.
  return static_cast<double>(bits() >> 11 | 1) * 0x1p-53;
}

double RandomStream::uniform(double low, double high) {
  require_finite("RandomStream::uniform", "low", low);
  require_finite("RandomStream::uniform", "high", high);
  require_not_negative("RandomStream::uniform", "high - low", high - low);
  return low + (high - low) * uniform();
}

double RandomStream::normal() {
  return quantile(uniform());
}

double RandomStream::normal(double mean, double sigma) {
  require_finite("RandomStream::normal", "mean", mean);
  require_not_negative("RandomStream::normal", "sigma", sigma);
  return mean + sigma * normal();
}

double RandomStream::log_normal(double mu, double sigma) {
  require_finite("RandomStream::log_normal", "mu", mu);
  require_not_negative("RandomStream::log_normal", "sigma", sigma);
  return std::exp(mu + sigma * normal());
}

double RandomStream::exponential(double mean) {
  require_not_negative("RandomStream::exponential", "mean", mean);
  return mean * -std::log(uniform());
}

std::int64_t RandomStream::integer(std::int64_t low, std::int64_t high) {
  if (low > high) {
    throw std::invalid_argument("RandomStream::integer: low = " + std::to_string(low) +
                                " is above high = " + std::to_string(high));
  }
  // Lemire, Fast random integer generation in an interval (2019), algorithm 5. 0 stands for 2^64.
  const std::uint64_t count =
      static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low) + 1;
  if (count == 0) return static_cast<std::int64_t>(bits());
  uint128 product = uint128{bits()} * count;
  if (static_cast<std::uint64_t>(product) < count) {
    const std::uint64_t biased = (0 - count) % count;
    while (static_cast<std::uint64_t>(product) < biased) product = uint128{bits()} * count;
  }
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(low) +
                                   static_cast<std::uint64_t>(product >> 64));
}

bool RandomStream::bernoulli(double probability) {
  if (!(probability >= 0.0 && probability <= 1.0)) {
    throw_parameter("RandomStream::bernoulli", "probability", probability, "0 to 1");
  }
  return uniform() < probability;
}

void normal_triples(std::span<RandomStream* const> streams, std::span<std::array<double, 3>> out) {
  // Written as words of 64 bits and read in pairs only when all are there: a pair that was just
  // written has to wait for the first cache.
  std::array<std::array<std::uint64_t, 2>, kBatch> blocks;
  Batch q, x;
  for (std::size_t from = 0; from < streams.size(); from += kBatch) {
    const std::size_t n = std::min(kBatch, streams.size() - from);
    for (std::size_t i = 0; i < n; ++i) blocks[i] = streams[from + i]->block();
    for (std::size_t i = 0; i < n; ++i) {
      const auto triple = centred_triple(blocks[i]);
      q[3 * i] = triple[0], q[3 * i + 1] = triple[1], q[3 * i + 2] = triple[2];
    }
    if (n % 2 != 0) q[3 * n] = 0;  // the last one's neighbour
    quantiles(q, 3 * n, x);
    for (std::size_t i = 0; i < n; ++i) out[from + i] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
  }
}

RandomStreams::RandomStreams(std::uint64_t seed) : seed_(seed) {
  constexpr std::uint64_t kLimit = std::uint64_t{1} << 53;  // exact as a number in JSON
  if (seed >= kLimit) {
    throw std::invalid_argument("RandomStreams: seed = " + std::to_string(seed) +
                                ", accepted: 0 to 2^53 - 1");
  }
}

RandomStream& RandomStreams::stream(std::string_view spacecraft, std::string_view component,
                                    std::string_view purpose) {
  const NameView name = {spacecraft, component, purpose};
  const auto found = streams_.find(name);
  if (found != streams_.end()) return found->second;
  std::uint64_t key = hash_word(0, seed_);
  for (const std::string_view part : name) key = hash_text(key, part);
  return streams_
      .try_emplace({std::string(spacecraft), std::string(component), std::string(purpose)}, key)
      .first->second;
}

std::string RandomStreams::fingerprint() const {
  std::uint64_t h = hash_word(0, streams_.size());
  for (const auto& [name, stream] : streams_) {
    for (const std::string& part : name) h = hash_text(h, part);
    h = hash_word(h, stream.draws());
  }
  return hex_digits(h, 8);
}

}  // namespace orrery
