/// A directed radio link: decides for each message whether it arrives, when, and in what state.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/models/radio/link_geometry.hpp>

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string_view>

namespace orrery {

/// Delay whose logarithm is normal: ln(delay / 1 s) ~ N(mu, sigma^2).
struct LogNormalDelay {
  double mu = 0;                      // ln of the median in seconds, -20 to 10
  double sigma = 0.7675283643313486;  // 0 to 1.5; default: ln(10)/3
};

/// The log-normal delay that has `low_s` at -k sigma and `high_s` at +k sigma. The default of a
/// link is log_normal_delay(0.1, 10.0).
/// @throws std::invalid_argument  unless 0 < low_s <= high_s, finite, and k > 0.
LogNormalDelay log_normal_delay(double low_s, double high_s, double k = 3);

/// Rounded up to nanoseconds; 0 at a rate of 0.
Duration time_on_air(std::size_t bytes, std::uint64_t rate_bps);

struct RadioLinkOptions {
  LogNormalDelay delay = {};      // median 1 s; 99.7 % within 0.1 s to 10 s
  Duration minimum_delay = 1ms;   // no message arrives sooner; at least 0
  double p_on = 0.05;             // blackout begins with this probability per message, 0 to 1
  double p_off = 0.25;            // and ends with this one, 0 to 1
  bool hold_in_blackout = false;  // false: lost; true: kept, and all released when it ends

  double p_duplicate = 0;       // arrives twice, with a second delay of its own, 0 to 1
  double p_truncate = 0;        // arrives without its tail, 0 to 1
  double bit_error_rate = 0;    // each bit is inverted with this probability, 0 to 0.5
  bool receiver_checks = true;  // true: the radio's CRC discards such a message; false: it arrives

  std::uint64_t rate_bps = 0;     // 0: no time on air, no queue
  std::uint64_t queue_bytes = 0;  // waiting and on air together, newest dropped; 0: no limit
  bool half_duplex = false;       // both directions share the time on air; needs rate_bps
  bool preserve_order = false;    // none arrives before one that was sent earlier
  std::uint32_t mtu_bytes = 0;    // longest frame; 0: no limit
  bool fragment = false;          // longer messages go in frames, all of which must arrive;
                                  // false: they are dropped

  LinkVisibility visibility = {};  // when the two ends can hear each other
};

/// What becomes of one message.
struct LinkFate {
  enum class Kind {
    kDelivered,
    kBlackout,    // lost in a blackout
    kHeld,        // waits for the blackout to end
    kCorrupted,   // bit errors, discarded by the receiver
    kQueueFull,   // dropped by the sender
    kTooLong,     // above the MTU, not fragmented
    kOutOfRange,  // the three of LinkVisibility
    kOccluded,
    kOffBoresight
  };
  Kind kind = Kind::kDelivered;
  Duration delay{};                              // from sending to arrival; of a delivered one
  std::optional<Duration> duplicate_delay = {};  // of the second copy
  std::size_t kept_bytes = 0;                    // less than were sent: truncated
  bool has_bit_errors = false;                   // apply invert_bits() to what is delivered
  bool ends_blackout = false;                    // those held arrive now, then this one
};

/// "delivered", "blackout" ...: the word in link records.
std::string_view to_string(LinkFate::Kind kind);

/// The time on air that both directions of a half-duplex link share.
struct RadioMedium {
  SimTime busy_until = SimTime::min();
};

/// One direction of a radio link. It holds no message and knows no event loop: the caller delivers,
/// and keeps those that are held.
///
/// Method   Blackout is a two-state Markov chain stepped once per frame, not per second (Gilbert,
///          Bell System Technical Journal 39, 1960; Bell and D'Amico, Fig. 15): the chain takes its
///          step, then the message is lost if the new state is blackout. Long-run loss
///          p_on/(p_on + p_off); a blackout swallows 1/p_off messages on average; sending more
///          often makes it shorter in seconds. Delays are independent and log-normal (Fig. 16), so
///          messages may overtake one another. Bit errors are independent: a message of n bits is
///          hit with probability 1 - (1 - rate)^n. The queue is served in order, one message at a
///          time, 8 bytes/rate_bps seconds each; the delay above is added to it.
/// Order    Visibility and MTU are judged first: what cannot be sent takes no draw and no time on
///          air. Then queue, blackout, delay, duplicate, truncation, bit errors.
/// Streams  ("from", "link/<to>", "blackout", "delay", ...), each purpose its own, those of unused
///          options untouched. Each frame takes one draw of blackout and each message one of delay,
///          whatever its fate: options of the blackout leave every delay as it was.
class RadioLink {
 public:
  /// @param medium  Shared by both directions if half_duplex, else unused.
  /// @throws std::invalid_argument  an option outside its range, half_duplex without rate_bps or
  ///                                without a medium.
  RadioLink(const RadioLinkOptions& options, RandomStreams& streams, std::string_view from,
            std::string_view to, std::shared_ptr<RadioMedium> medium = {});

  /// Fate of the next message, `bytes` long and sent at `t`, not before the last.
  /// @param geometry  Of the two ends at `t`; read if needs_geometry().
  LinkFate send(SimTime t, std::size_t bytes, const LinkGeometry& geometry = {});
  bool needs_geometry() const { return options_.visibility.is_limited(); }

  /// Inverts the bits of the message that send() was asked about last, which has_bit_errors.
  void invert_bits(ByteBuffer& bytes);
  /// How many are inverted, in a message of `bytes`; for tests and records.
  std::uint64_t inverted_bits() const { return inverted_bits_; }

  bool in_blackout() const { return in_blackout_; }
  const RadioLinkOptions& options() const { return options_; }

 private:
  struct Queued {
    SimTime leaves;
    std::uint64_t bytes;
  };
  std::optional<LinkFate::Kind> refusal(std::size_t bytes, const LinkGeometry& geometry) const;
  void damage(std::size_t bytes, LinkFate& fate);
  bool frames_lost(std::size_t bytes);
  void step_blackout();
  Duration draw_delay(RandomStream& stream) const;
  std::optional<SimTime> leaves_queue(SimTime t, std::size_t bytes);
  SimTime in_order(SimTime arrival);
  std::uint64_t bits_to_next_error();

  RadioLinkOptions options_;
  RandomStream& blackout_stream_;
  RandomStream& delay_stream_;
  // Null while the option that draws from it is off.
  RandomStream* duplicate_stream_ = nullptr;
  RandomStream* second_delay_stream_ = nullptr;
  RandomStream* truncation_stream_ = nullptr;
  RandomStream* bit_error_stream_ = nullptr;
  std::shared_ptr<RadioMedium> medium_;
  std::deque<Queued> queue_;
  std::uint64_t queued_bytes_ = 0;
  SimTime latest_arrival_ = SimTime::min();
  std::uint64_t first_error_ = 0;  // bits before the first inverted one of the message
  std::uint64_t inverted_bits_ = 0;
  bool in_blackout_ = false;
  bool holds_some_ = false;
};

}  // namespace orrery
