/// A directed radio link: decides for each message whether it arrives, and when.
#pragma once

#include <orrery/harness/kernel/random.hpp>
#include <orrery/harness/kernel/time.hpp>

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

struct RadioLinkOptions {
  LogNormalDelay delay;          // median 1 s; 99.7 % within 0.1 s to 10 s
  Duration minimum_delay = 1ms;  // no message arrives sooner; at least 0
  double p_on = 0.05;            // blackout begins with this probability per message, 0 to 1
  double p_off = 0.25;           // and ends with this one, 0 to 1
};

/// What becomes of one message. More kinds (dropped, corrupted) and a duplicate's delay have their
/// place here.
struct LinkFate {
  enum class Kind { kDelivered, kBlackout };
  Kind kind = Kind::kDelivered;
  Duration delay{};  // from sending to arrival; meaningless unless delivered
};

/// "delivered", "blackout": the word in link records.
std::string_view to_string(LinkFate::Kind kind);

/// One direction of a radio link. It holds no message and knows no event loop: the caller delivers.
///
/// Method   Blackout is a two-state Markov chain stepped once per message, not per second (Gilbert,
///          Bell System Technical Journal 39, 1960; Bell and D'Amico, Fig. 15): the chain takes its
///          step, then the message is lost if the new state is blackout. Long-run loss
///          p_on/(p_on + p_off); a blackout swallows 1/p_off messages on average; sending more
///          often makes it shorter in seconds. Delays are independent and log-normal (Fig. 16), so
///          messages may overtake one another.
/// Streams  ("from", "link/<to>", "blackout" and "delay"), two of its own for each direction. Each
///          message takes one draw of each, whatever its fate: options of the blackout leave every
///          delay as it was.
class RadioLink {
 public:
  /// @throws std::invalid_argument  an option outside its range.
  RadioLink(const RadioLinkOptions& options, RandomStreams& streams, std::string_view from,
            std::string_view to);

  /// Fate of the next message, `bytes` long and sent at `t`. Neither matters yet; windows of
  /// visibility and bandwidth will read them.
  LinkFate send(SimTime t, std::size_t bytes);

  bool in_blackout() const { return in_blackout_; }
  const RadioLinkOptions& options() const { return options_; }

 private:
  void step_blackout();
  Duration draw_delay();

  RadioLinkOptions options_;
  RandomStream& blackout_stream_;
  RandomStream& delay_stream_;
  bool in_blackout_ = false;
};

}  // namespace orrery
