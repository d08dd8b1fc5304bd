/// Address space for simulated heaps, at the same addresses in every run.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdint>

namespace orrery {

/// A slot of 4 GiB of address space that holds memory once it is used. Slot i lies at
/// kBase + i * kSlot_bytes, and the lowest free slot is taken: so pointers repeat for worlds that
/// are made one after another, with address layout randomisation on.
class Arena {
 public:
  static constexpr std::uintptr_t kBase = 0x2000'0000'0000;
  static constexpr std::uintptr_t kSlot_bytes = std::uintptr_t{1} << 32;
  static constexpr std::size_t kSlots = 1024;

  /// @throws std::runtime_error  the address is taken, or the kernel refuses; std::length_error
  ///                             all slots are in use.
  Arena();
  ~Arena();
  Arena(const Arena&) = delete;
  Arena& operator=(const Arena&) = delete;

  std::byte* base() const { return base_; }
  std::size_t slot() const { return slot_; }
  /// Makes the first `bytes`, rounded up to pages, usable; the rest faults. Never takes back.
  /// @throws std::invalid_argument  above kSlot_bytes; std::runtime_error  the kernel refuses.
  void open(std::uint64_t bytes);
  /// All memory goes back to the system; what is read next is zero.
  void reset();

  /// True for an address in any slot, in use or not.
  static bool contains(const void* address) {
    return reinterpret_cast<std::uintptr_t>(address) - kBase < kSlots * kSlot_bytes;
  }
  static std::size_t slot_of(const void* address) {
    return (reinterpret_cast<std::uintptr_t>(address) - kBase) / kSlot_bytes;
  }

 private:
  std::size_t slot_;
  std::byte* base_;
  std::uint64_t open_bytes_ = 0;
};

}  // namespace orrery
