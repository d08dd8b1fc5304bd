#include <orrery/harness/kernel/fingerprint.hpp>
#include <orrery/harness/kernel/hash.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>

namespace orrery {
namespace {

bool same(const EventRecord& a, const EventRecord& b) {
  return a.key == b.key && a.kind->id == b.kind->id && a.chain == b.chain;
}

}  // namespace

void Fingerprint::add_owner() {
  chains_.push_back(0);
  if (keeps_unordered_) unordered_.emplace_back();
}

void Fingerprint::event(const EventKey& key, std::uint16_t kind_id) {
  const std::uint64_t what = std::uint64_t{static_cast<std::uint8_t>(key.phase)} << 32 |
                             std::uint64_t{kind_id} << 16 | key.origin;
  std::uint64_t& chain = chains_[key.destination];
  chain = hash_word(chain, static_cast<std::uint64_t>(to_ns(key.t)));
  chain = hash_word(chain, what);
  chain = hash_word(chain, key.counter);
  if (keeps_unordered_) this_event_ = hash_word(static_cast<std::uint64_t>(to_ns(key.t)), what);
}

void Fingerprint::end_event(const EventKey& key) {
  Unordered& owner = unordered_[key.destination];
  if (key.t != owner.t) {
    owner.chain = owner.folded();
    owner.sum = 0;
    owner.t = key.t;
  }
  owner.sum += this_event_;
}

std::uint64_t Fingerprint::Unordered::folded() const {
  return hash_word(chain, sum);
}

std::uint64_t Fingerprint::unordered_hash() const {
  std::uint64_t h = hash_word(0, unordered_.size());
  for (const Unordered& owner : unordered_) h = hash_word(h, owner.folded());
  return h;
}

void Fingerprint::payload(OwnerId owner, Bytes bytes) {
  chains_[owner] = hash_bytes(chains_[owner], bytes);
  if (keeps_unordered_) this_event_ = hash_bytes(this_event_, bytes);
}

std::uint64_t Fingerprint::hash() const {
  std::uint64_t h = hash_word(0, chains_.size());
  for (const std::uint64_t chain : chains_) h = hash_word(h, chain);
  return h;
}

std::string Fingerprint::value() const {
  return hex_digits(hash(), 16);
}

std::optional<EventDifference> first_difference(const std::vector<EventRecord>& a,
                                                const std::vector<EventRecord>& b) {
  const auto [at_a, at_b] = std::mismatch(a.begin(), a.end(), b.begin(), b.end(), same);
  if (at_a == a.end() && at_b == b.end()) return std::nullopt;
  EventDifference difference;
  difference.index = static_cast<std::size_t>(at_a - a.begin());
  if (at_a != a.end()) difference.a = *at_a;
  if (at_b != b.end()) difference.b = *at_b;
  return difference;
}

}  // namespace orrery
