/// What a process finds again after a reset: the ABI's slots, and files.
#pragma once

#include <orrery/harness/flight/flight_files.hpp>
#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace orrery {

/// What goes wrong with one write: a store into a slot, or a write to a file. Flight code is told
/// of `full` only.
struct WriteFault {
  bool full = false;                             // refused, as by a full medium
  std::optional<std::uint64_t> kept_bytes = {};  // torn: only the first so many arrive
  std::vector<std::uint64_t> flipped_bits = {};  // of what is written, counted from its start
};

class NonVolatileMemory {
 public:
  using Slots = std::vector<std::pair<std::uint32_t, ByteBuffer>>;  // by number, ascending
  /// Asked before each write, which counts from 1.
  using Faults = std::function<WriteFault(std::uint64_t number, std::uint64_t bytes)>;

  /// @param slot_bytes  Capacity of all slots together.
  NonVolatileMemory(std::uint64_t slot_bytes, FlightFiles file_tree)
      : files(std::move(file_tree)), slot_bytes_(slot_bytes) {}

  const Slots& slots() const { return slots_; }
  const ByteBuffer* slot(std::uint32_t number) const;  // null: none
  /// False: no room. A torn store leaves what was there before behind the bytes that arrived, and
  /// 0xff, as erased flash memory has, where there was nothing.
  bool store(std::uint32_t number, ByteBuffer content);

  /// As FlightFiles::write; -ENOSPC for a full medium as well. What is torn away was never written.
  int write_file(FlightFiles::Node& node, std::uint64_t at, ByteBuffer& bytes,
                 std::int64_t unix_ns);

  void set_faults(Faults faults) { faults_ = std::move(faults); }
  std::uint64_t writes() const { return writes_; }
  std::uint64_t faulty_writes() const { return faulty_writes_; }

  FlightFiles files;

 private:
  WriteFault next_fault(std::uint64_t bytes);

  Slots slots_;
  std::uint64_t slot_bytes_;
  Faults faults_;
  std::uint64_t writes_ = 0, faulty_writes_ = 0;
};

}  // namespace orrery
