#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/radio/radio_link.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace orrery {

namespace {

// Bounds keep the longest possible delay, exp(mu + 8.3 sigma) s for a 53-bit uniform, below the
// 292 years that a Duration holds.
constexpr double kLowestMu = -20, kHighestMu = 10, kHighestSigma = 1.5;

// Written so that NaN fails.
void check(const char* option, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument("RadioLink: " + std::string(option) + " = " + to_text(value) +
                                "; accepted: " + to_text(low) + " to " + to_text(high));
  }
}

const RadioLinkOptions& checked(const RadioLinkOptions& options, const RadioMedium* medium) {
  check("delay.mu", options.delay.mu, kLowestMu, kHighestMu);
  check("delay.sigma", options.delay.sigma, 0, kHighestSigma);
  check("p_on", options.p_on, 0, 1);
  check("p_off", options.p_off, 0, 1);
  check("p_duplicate", options.p_duplicate, 0, 1);
  check("p_truncate", options.p_truncate, 0, 1);
  check("bit_error_rate", options.bit_error_rate, 0, 0.5);
  if (options.minimum_delay < 0ns) {
    throw std::invalid_argument("RadioLink: minimum_delay = " + to_string(options.minimum_delay) +
                                "; accepted: 0 s or more");
  }
  if (options.half_duplex && options.rate_bps == 0) {
    throw std::invalid_argument(
        "RadioLink: half_duplex with rate_bps = 0; accepted: above 0, since "
        "without a rate a message takes no time on air");
  }
  if (options.half_duplex && medium == nullptr) {
    throw std::invalid_argument("RadioLink: half_duplex without a medium to share");
  }
  check(options.visibility);
  return options;
}

LinkFate::Kind fate_at(LinkObstacle obstacle) {
  switch (obstacle) {
    case LinkObstacle::kRange:
      return LinkFate::Kind::kOutOfRange;
    case LinkObstacle::kEarth:
      return LinkFate::Kind::kOccluded;
    case LinkObstacle::kBeam:
      return LinkFate::Kind::kOffBoresight;
    case LinkObstacle::kNone:
      break;
  }
  return LinkFate::Kind::kDelivered;
}

RandomStream& stream(RandomStreams& streams, std::string_view from, std::string_view to,
                     std::string_view purpose) {
  return streams.stream(from, "link/" + std::string(to), purpose);
}

}  // namespace

Duration time_on_air(std::size_t bytes, std::uint64_t rate_bps) {
  if (rate_bps == 0) return Duration::zero();
  constexpr std::uint64_t kBitNs = 8'000'000'000;  // bits per byte times nanoseconds per second
  return Duration(static_cast<std::int64_t>((bytes * kBitNs + rate_bps - 1) / rate_bps));
}

LogNormalDelay log_normal_delay(double low_s, double high_s, double k) {
  if (!(low_s > 0 && high_s >= low_s && std::isfinite(high_s) && k > 0)) {
    throw std::invalid_argument("log_normal_delay: low_s = " + to_text(low_s) +
                                ", high_s = " + to_text(high_s) + ", k = " + to_text(k) +
                                "; accepted: 0 < low_s <= high_s, k > 0");
  }
  const double ln_low = std::log(low_s);
  const double ln_high = std::log(high_s);
  return {.mu = 0.5 * (ln_low + ln_high), .sigma = (ln_high - ln_low) / (2 * k)};
}

std::string_view to_string(LinkFate::Kind kind) {
  switch (kind) {
    case LinkFate::Kind::kDelivered:
      return "delivered";
    case LinkFate::Kind::kBlackout:
      return "blackout";
    case LinkFate::Kind::kHeld:
      return "held";
    case LinkFate::Kind::kCorrupted:
      return "corrupted";
    case LinkFate::Kind::kQueueFull:
      return "queue full";
    case LinkFate::Kind::kTooLong:
      return "too long";
    case LinkFate::Kind::kOutOfRange:
      return "out of range";
    case LinkFate::Kind::kOccluded:
      return "occluded";
    case LinkFate::Kind::kOffBoresight:
      return "off boresight";
  }
  throw std::invalid_argument("to_string(LinkFate::Kind): no such kind");
}

RadioLink::RadioLink(const RadioLinkOptions& options, RandomStreams& streams, std::string_view from,
                     std::string_view to, std::shared_ptr<RadioMedium> medium)
    : options_(checked(options, medium.get())),
      blackout_stream_(stream(streams, from, to, "blackout")),
      delay_stream_(stream(streams, from, to, "delay")),
      medium_(std::move(medium)) {
  const auto stream_if = [&](bool used, std::string_view purpose) {
    return used ? &stream(streams, from, to, purpose) : nullptr;
  };
  duplicate_stream_ = stream_if(options_.p_duplicate > 0, "duplicate");
  second_delay_stream_ = stream_if(options_.p_duplicate > 0, "second delay");
  truncation_stream_ = stream_if(options_.p_truncate > 0, "truncation");
  bit_error_stream_ = stream_if(options_.bit_error_rate > 0, "bit errors");
}

LinkFate RadioLink::send(SimTime t, std::size_t bytes, const LinkGeometry& geometry) {
  LinkFate fate{.kept_bytes = bytes};
  if (const std::optional<LinkFate::Kind> kind = refusal(bytes, geometry)) {
    fate.kind = *kind;
    return fate;
  }
  const std::optional<SimTime> leaves = leaves_queue(t, bytes);
  if (!leaves) {
    fate.kind = LinkFate::Kind::kQueueFull;
    return fate;
  }
  const bool lost = frames_lost(bytes);
  const Duration delay = draw_delay(delay_stream_);
  if (lost) {
    fate.kind = options_.hold_in_blackout ? LinkFate::Kind::kHeld : LinkFate::Kind::kBlackout;
    holds_some_ = holds_some_ || options_.hold_in_blackout;
    return fate;
  }
  fate.ends_blackout = std::exchange(holds_some_, false);
  fate.delay = in_order(*leaves + delay) - t;
  if (duplicate_stream_ != nullptr && duplicate_stream_->bernoulli(options_.p_duplicate)) {
    fate.duplicate_delay = in_order(*leaves + draw_delay(*second_delay_stream_)) - t;
  }
  damage(bytes, fate);
  return fate;
}

std::optional<LinkFate::Kind> RadioLink::refusal(std::size_t bytes,
                                                 const LinkGeometry& geometry) const {
  if (needs_geometry()) {
    const LinkObstacle in_the_way = obstacle(geometry, options_.visibility);
    if (in_the_way != LinkObstacle::kNone) return fate_at(in_the_way);
  }
  if (options_.mtu_bytes > 0 && bytes > options_.mtu_bytes && !options_.fragment) {
    return LinkFate::Kind::kTooLong;
  }
  return {};
}

std::optional<SimTime> RadioLink::leaves_queue(SimTime t, std::size_t bytes) {
  if (options_.rate_bps == 0) return t;
  while (!queue_.empty() && queue_.front().leaves <= t) {
    queued_bytes_ -= queue_.front().bytes;
    queue_.pop_front();
  }
  if (options_.queue_bytes > 0 && queued_bytes_ + bytes > options_.queue_bytes) return {};
  SimTime start = queue_.empty() ? t : queue_.back().leaves;
  if (options_.half_duplex) start = std::max(t, medium_->busy_until);
  const SimTime leaves = start + time_on_air(bytes, options_.rate_bps);
  if (options_.half_duplex) medium_->busy_until = leaves;
  queue_.push_back({leaves, bytes});
  queued_bytes_ += bytes;
  return leaves;
}

bool RadioLink::frames_lost(std::size_t bytes) {
  const std::size_t frames =
      options_.mtu_bytes == 0
          ? 1
          : std::max<std::size_t>(1, (bytes + options_.mtu_bytes - 1) / options_.mtu_bytes);
  bool lost = false;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    step_blackout();
    lost = lost || in_blackout_;
  }
  return lost;
}

void RadioLink::step_blackout() {
  const double u = blackout_stream_.uniform();
  in_blackout_ = in_blackout_ ? u >= options_.p_off : u < options_.p_on;
}

Duration RadioLink::draw_delay(RandomStream& stream) const {
  const double delay_s = stream.log_normal(options_.delay.mu, options_.delay.sigma);
  return std::max(options_.minimum_delay, from_seconds(delay_s));
}

SimTime RadioLink::in_order(SimTime arrival) {
  if (!options_.preserve_order) return arrival;
  latest_arrival_ = std::max(arrival, latest_arrival_ + 1ns);
  return latest_arrival_;
}

void RadioLink::damage(std::size_t bytes, LinkFate& fate) {
  if (truncation_stream_ != nullptr && truncation_stream_->bernoulli(options_.p_truncate) &&
      bytes > 0) {
    const auto longest = static_cast<std::int64_t>(bytes) - 1;
    fate.kept_bytes = static_cast<std::size_t>(truncation_stream_->integer(0, longest));
  }
  if (bit_error_stream_ == nullptr) return;
  first_error_ = bits_to_next_error();
  fate.has_bit_errors = first_error_ < 8 * fate.kept_bytes;
  if (fate.has_bit_errors && options_.receiver_checks) fate.kind = LinkFate::Kind::kCorrupted;
}

void RadioLink::invert_bits(ByteBuffer& bytes) {
  const std::uint64_t bits = 8 * bytes.size();
  inverted_bits_ = 0;
  for (std::uint64_t bit = first_error_; bit < bits; bit += 1 + bits_to_next_error()) {
    bytes[bit / 8] ^= std::byte{1} << (bit % 8);
    ++inverted_bits_;
  }
}

// Geometric: the number of good bits before the next bad one. Costs a draw per error, not per bit.
std::uint64_t RadioLink::bits_to_next_error() {
  const double u = bit_error_stream_->uniform();
  const double bits = std::floor(std::log(u) / std::log1p(-options_.bit_error_rate));
  return static_cast<std::uint64_t>(std::min(bits, 1e15));
}

}  // namespace orrery
