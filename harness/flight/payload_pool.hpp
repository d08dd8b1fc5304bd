/// Buffers for payloads on their way, so that an event holds an index and nothing allocates once
/// the buffers have grown to their sizes.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <vector>

namespace orrery::internal {

class PayloadPool {
 public:
  std::uint32_t put(Bytes bytes) {
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(buffers_.size()));
      buffers_.emplace_back();
      free_.reserve(buffers_.size());  // so that give_back() never allocates
    }
    const std::uint32_t slot = free_.back();
    free_.pop_back();
    buffers_[slot].assign(bytes.begin(), bytes.end());
    return slot;
  }
  /// Valid until the next put().
  Bytes operator[](std::uint32_t slot) const { return buffers_[slot]; }
  void give_back(std::uint32_t slot) { free_.push_back(slot); }

  /// Out of the pool while somebody looks at it, who may put more.
  ByteBuffer take(std::uint32_t slot) { return std::move(buffers_[slot]); }
  void give_back(std::uint32_t slot, ByteBuffer&& buffer) {
    buffers_[slot] = std::move(buffer);
    free_.push_back(slot);
  }

 private:
  std::vector<ByteBuffer> buffers_;
  std::vector<std::uint32_t> free_;
};

/// A payload that goes back to its pool at the end of the scope, by an exception too.
class TakenPayload {
 public:
  TakenPayload(PayloadPool& pool, std::uint32_t slot)
      : pool_(pool), slot_(slot), buffer_(pool.take(slot)) {}
  ~TakenPayload() { pool_.give_back(slot_, std::move(buffer_)); }
  TakenPayload(const TakenPayload&) = delete;
  TakenPayload& operator=(const TakenPayload&) = delete;
  Bytes bytes() const { return buffer_; }

 private:
  PayloadPool& pool_;
  std::uint32_t slot_;
  ByteBuffer buffer_;
};

}  // namespace orrery::internal
