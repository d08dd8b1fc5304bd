#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/radio/radio_link.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

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

const RadioLinkOptions& checked(const RadioLinkOptions& options) {
  check("delay.mu", options.delay.mu, kLowestMu, kHighestMu);
  check("delay.sigma", options.delay.sigma, 0, kHighestSigma);
  check("p_on", options.p_on, 0, 1);
  check("p_off", options.p_off, 0, 1);
  if (options.minimum_delay < 0ns) {
    throw std::invalid_argument("RadioLink: minimum_delay = " + to_string(options.minimum_delay) +
                                "; accepted: 0 s or more");
  }
  return options;
}

RandomStream& stream(RandomStreams& streams, std::string_view from, std::string_view to,
                     std::string_view purpose) {
  return streams.stream(from, "link/" + std::string(to), purpose);
}

}  // namespace

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
  }
  throw std::invalid_argument("to_string(LinkFate::Kind): no such kind");
}

RadioLink::RadioLink(const RadioLinkOptions& options, RandomStreams& streams, std::string_view from,
                     std::string_view to)
    : options_(checked(options)),
      blackout_stream_(stream(streams, from, to, "blackout")),
      delay_stream_(stream(streams, from, to, "delay")) {}

LinkFate RadioLink::send(SimTime t, std::size_t bytes) {
  (void)t, (void)bytes;
  step_blackout();
  const Duration delay = draw_delay();
  if (in_blackout_) return {.kind = LinkFate::Kind::kBlackout};
  return {.kind = LinkFate::Kind::kDelivered, .delay = delay};
}

void RadioLink::step_blackout() {
  const double u = blackout_stream_.uniform();
  in_blackout_ = in_blackout_ ? u >= options_.p_off : u < options_.p_on;
}

Duration RadioLink::draw_delay() {
  const double delay_s = delay_stream_.log_normal(options_.delay.mu, options_.delay.sigma);
  return std::max(options_.minimum_delay, from_seconds(delay_s));
}

}  // namespace orrery
