// What a test asks of the memory of a process.

#include <orrery/harness/flight/flight_process_impl.hpp>
#include <orrery/harness/flight/stack_frames.hpp>
#include <orrery/harness/kernel/text.hpp>

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace orrery {

std::vector<StackFrame> FlightProcess::Impl::frames(const CallStack& calls_made) const {
  internal::CrashCapture capture;
  for (const void* frame : calls_made)
    capture.frames[capture.frame_count++] = const_cast<void*>(frame);
  return internal::stack_frames(capture, library->loaded_paths());
}

std::string FlightProcess::Impl::check_heap() {
  if (heap == nullptr || crashed) return "";
  const std::optional<HeapFault> fault = heap->blocks().find_fault();
  if (!fault) return "";
  char address[32];
  std::snprintf(address, sizeof address, "%p", fault->address);
  std::string text = "heap of " + name + ": " + to_string(fault->kind) + " at " + address + "\n";
  const HeapWatch* watch = heap->watch_if_any();
  const HeapSite* site = watch == nullptr ? nullptr : watch->site_of(fault->address);
  if (site == nullptr) return text;
  text += "  the block was allocated at " + to_string(site->allocated_at) + " by\n" +
          to_string(frames(site->allocated_by));
  if (site->live) return text;
  return text + "  and freed at " + to_string(site->freed_at) + " by\n" +
         to_string(frames(site->freed_by));
}

std::vector<LeakReport> FlightProcess::Impl::leaks(std::uint64_t after, std::uint64_t until) const {
  if (!options.heap.track_sites) {
    throw std::logic_error("FlightProcess::leaks: " + name +
                           " keeps no record of its blocks; set HeapRules::track_sites");
  }
  std::vector<LeakReport> reports;
  if (heap == nullptr) return reports;
  for (const HeapLeak& leak : heap->watch_if_any()->live_since(after, until)) {
    reports.push_back({leak.blocks, leak.bytes, leak.first, frames(leak.allocated_by)});
  }
  return reports;
}

HeapFigures FlightProcess::heap() const {
  return impl_->heap == nullptr ? impl_->target_heap : impl_->heap->blocks().figures();
}

std::uint64_t FlightProcess::stack_high_water_bytes() const {
  return impl_->stack == nullptr ? 0 : impl_->stack->high_water_bytes();
}

void FlightProcess::set_heap_limit(std::uint64_t bytes) {
  FlightProcessOptions changed = impl_->options;
  changed.heap_bytes = bytes;
  check_heap_options("FlightProcess::set_heap_limit", internal::heap_options(changed));
  impl_->options.heap_bytes = bytes;
  if (impl_->heap != nullptr) impl_->heap->set_limit(bytes);
}

SimulatedHeap* FlightProcess::simulated_heap() {
  return impl_->heap.get();
}

std::string FlightProcess::check_heap() {
  return impl_->check_heap();
}

std::vector<LeakReport> FlightProcess::leaks(std::uint64_t after, std::uint64_t until) const {
  return impl_->leaks(after, until);
}

std::string to_string(const LeakReport& leak) {
  return std::to_string(leak.bytes) + " bytes in " + std::to_string(leak.blocks) +
         " blocks, the first of " + to_string(leak.first) + ", allocated by\n" +
         to_string(leak.allocated_by);
}

const std::shared_ptr<NonVolatileMemory>& FlightProcess::memory() const {
  return impl_->memory;
}

std::string FlightProcess::flip_bit(FlightMemory memory, double place) {
  impl_->require_between_calls("flip_bit");
  if (impl_->target != nullptr) return "";
  if (memory == FlightMemory::kGlobals) {
    return internal::flip_global(impl_->library->loaded_path(), impl_->library->base(), place);
  }
  if (impl_->heap == nullptr || !heap_simulation_available()) return "";
  BlockHeap& blocks = impl_->heap->blocks();
  const std::uint64_t bits = 8 * blocks.heap_bytes();
  if (bits == 0) return "";
  const auto bit =
      std::min(bits - 1, static_cast<std::uint64_t>(place * static_cast<double>(bits)));
  static_cast<std::byte*>(blocks.first_block())[bit / 8] ^= std::byte{1} << (bit % 8);
  return "bit " + std::to_string(bit % 8) + " of byte 0x" + hex_digits(bit / 8, 8) + " of the heap";
}

}  // namespace orrery
