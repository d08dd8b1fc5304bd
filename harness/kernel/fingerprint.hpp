/// Rolling hash of executed events, one chain per owner.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/event.hpp>
#include <orrery/harness/kernel/hash.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace orrery {

/// One executed event, as kept for comparing two runs.
struct EventRecord {
  EventKey key;
  const EventKind* kind = nullptr;
  std::uint64_t chain = 0;  // the destination's chain after this event, payload included
};

/// The hash of what a run did (hash.hpp). Doubles in a payload go through fingerprint_bits().
class Fingerprint {
 public:
  void add_owner();
  /// Mixes (t, phase, kind id, origin, counter) into the chain of key.destination.
  void event(const EventKey& key, std::uint16_t kind_id);
  /// Mixes the length and the bytes.
  void payload(OwnerId owner, Bytes bytes);
  /// From here on, before the first event: also a hash to which the order of events at one instant
  /// and the counters of their origins do not matter, so that runs with other ties can be compared.
  void keep_unordered() { unordered_.resize(chains_.size()), keeps_unordered_ = true; }
  bool keeps_unordered() const { return keeps_unordered_; }
  /// The running event is complete, payload included.
  void end_event(const EventKey& key);
  /// The hash of the event that is running or ran last, without its counter.
  std::uint64_t this_event() const { return this_event_; }
  std::uint64_t unordered_hash() const;

  std::uint64_t chain(OwnerId owner) const { return chains_[owner]; }
  /// The run's value: a hash over the chains in owner order, 16 hex digits as text.
  std::uint64_t hash() const;
  std::string value() const;

 private:
  // The events of the owner's last instant add up, which no order changes.
  struct Unordered {
    std::uint64_t chain = 0, sum = 0;
    SimTime t = SimTime::min();
    std::uint64_t folded() const;
  };
  std::vector<std::uint64_t> chains_;
  std::vector<Unordered> unordered_;
  std::uint64_t this_event_ = 0;
  bool keeps_unordered_ = false;
};

/// The first place at which two logs differ. Equal keys there mean that the payload differed.
struct EventDifference {
  std::size_t index = 0;            // in both logs
  std::optional<EventRecord> a, b;  // empty: that log ended here
};
std::optional<EventDifference> first_difference(const std::vector<EventRecord>& a,
                                                const std::vector<EventRecord>& b);

}  // namespace orrery
