/// What a heap does beside its work when it is asked to: failing requests, filling, call stacks, a
/// trace.
#pragma once

#include <orrery/harness/heap/heap_options.hpp>
#include <orrery/harness/heap/heap_trace.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

namespace orrery {

/// Return addresses, innermost first.
using CallStack = std::vector<const void*>;

/// Where a block was made, and where it was freed if it was.
struct HeapSite {
  const void* block = nullptr;
  std::uint64_t bytes = 0;   // asked for
  std::uint64_t number = 0;  // of the request, from 1
  bool live = true;
  SimTime allocated_at, freed_at;
  CallStack allocated_by, freed_by;
};

/// Blocks of one origin that are still live.
struct HeapLeak {
  std::uint64_t blocks = 0;
  std::uint64_t bytes = 0;  // asked for
  SimTime first;            // when the oldest was allocated
  CallStack allocated_by;
};

/// Runs without a current heap. Kept out of SimulatedHeap, whose common path is one test of whether
/// there is a watch at all.
class HeapWatch {
 public:
  explicit HeapWatch(const HeapRules& rules) : rules_(rules) {}

  /// Asked for each request for memory with its number, counted from 1 from here on: true refuses
  /// it, which is null to the caller. Empty: none.
  void fail_allocations(std::function<bool(std::uint64_t number)> refuse);
  std::uint64_t requests() const { return requests_; }  // since the last such call
  std::uint64_t refused() const { return refused_; }

  void start_trace(SimTime start) { trace_.emplace(start); }
  HeapTraceWriter* trace() { return trace_ ? &*trace_ : nullptr; }

  /// Number of the last request, for live_since().
  std::uint64_t mark() const { return number_; }
  /// The blocks allocated after mark `after` up to mark `until` that are live, by call stack; most
  /// bytes first. Needs HeapRules::track_sites.
  std::vector<HeapLeak> live_since(std::uint64_t after, std::uint64_t until = UINT64_MAX) const;
  /// The block that the address lies in: live, or the one last freed there.
  const HeapSite* site_of(const void* address) const;

  // ---- for SimulatedHeap
  bool refuses();
  void allocated(void* made, std::uint64_t bytes, std::size_t usable);
  void zeroed(void* made, std::uint64_t bytes);
  void aligned(void* made, std::uint64_t bytes, std::uint64_t alignment, std::size_t usable);
  void reallocated(const void* old, std::size_t old_usable, void* made, std::uint64_t bytes,
                   std::size_t usable);
  void released(const void* block);

 private:
  void fill(void* begin, std::size_t bytes) const;
  void enter(const void* made, std::uint64_t bytes);
  void leave(const void* block);

  HeapRules rules_;
  std::function<bool(std::uint64_t)> refuse_;
  std::uint64_t requests_ = 0, refused_ = 0, number_ = 0;
  std::optional<HeapTraceWriter> trace_;
  std::map<std::uintptr_t, HeapSite> sites_;
};

}  // namespace orrery
