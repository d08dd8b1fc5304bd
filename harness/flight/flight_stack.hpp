/// The stack of one flight process.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstddef>
#include <cstdint>

namespace orrery::internal {

/// Memory for a stack at the same addresses in every run, above a guard of 1 MiB that faults.
/// Pages hold memory once they are used.
class FlightStack {
 public:
  static constexpr std::uint64_t kLeast_bytes = 64 * 1024;
  static constexpr std::uint64_t kMost_bytes = 32 * 1024 * 1024;
  /// False where calls stay on the stack of their caller: under AddressSanitizer, which must know
  /// every stack, and on other processors than x86-64.
  static bool available();

  /// @throws std::runtime_error  no address is free, or the kernel refuses.
  explicit FlightStack(std::uint64_t bytes);
  ~FlightStack();
  FlightStack(const FlightStack&) = delete;
  FlightStack& operator=(const FlightStack&) = delete;

  std::uint64_t bytes() const { return bytes_; }
  bool guards(const void* address) const;
  /// Most that was in use so far, to the byte: from the top to the lowest byte that is not zero.
  /// Costs a look at every page in use.
  std::uint64_t high_water_bytes() const;
  /// Between calls: what they have left behind becomes bytes drawn from `seed`, so that code that
  /// reads a variable before it has written it does not find the same as in another run.
  void overwrite_used(std::uint64_t seed);
  /// function(argument), on this stack.
  void call(void (*function)(void*), void* argument) const;

 private:
  std::size_t slot_;
  std::byte* guard_;
  std::byte* bottom_;
  std::uint64_t bytes_;
};

}  // namespace orrery::internal
