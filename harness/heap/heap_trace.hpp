/// What a process asked of its heap, to be asked of another one.
#pragma once

#include <orrery/harness/heap/heap_figures.hpp>
#include <orrery/harness/heap/heap_history.hpp>
#include <orrery/harness/heap/heap_options.hpp>
#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace orrery {

/// A trace is 8 bytes "ORRHEAP1", the start as a little-endian i64 of GPS nanoseconds, then records
/// of one or two numbers, each an unsigned LEB128. The first is (value << 3 | operation):
///
///   0 malloc    value: bytes
///   1 calloc    value: bytes, the product
///   2 memalign  value: bytes; second: log2 of the alignment
///   3 realloc   value: bytes; second: age of the old block
///   4 free      value: age of the block
///   5 call      value: ns since the last such record, or since the start; a call has returned
///
/// A block's age is the number of blocks made since, itself included; malloc, calloc, memalign and
/// realloc make one. Requests that failed are not in it; realloc of null is a malloc, to 0 a free.
enum class HeapOperation : std::uint8_t { kMalloc, kCalloc, kMemalign, kRealloc, kFree, kCall };

/// A record with ages resolved: blocks are numbered from 0 in the order in which they were made.
struct HeapTraceStep {
  HeapOperation operation = HeapOperation::kMalloc;
  std::uint64_t bytes = 0;      // of a request
  std::uint64_t alignment = 0;  // of a memalign
  std::uint64_t block = 0;      // made by this step, or freed
  std::uint64_t old_block = 0;  // of a realloc
  Duration since_start{};       // of a call
};

/// Writes a trace of about 3 bytes per operation.
class HeapTraceWriter {
 public:
  explicit HeapTraceWriter(SimTime start);
  void malloc(const void* made, std::uint64_t bytes);
  void calloc(const void* made, std::uint64_t bytes);
  void memalign(const void* made, std::uint64_t bytes, std::uint64_t alignment);
  void realloc(const void* old, const void* made, std::uint64_t bytes);
  /// Blocks that were made before the trace began are left out.
  void free(const void* block);
  void call_returned(SimTime t);
  const ByteBuffer& trace() const { return trace_; }

 private:
  void record(HeapOperation operation, std::uint64_t value);
  void number(std::uint64_t value);

  ByteBuffer trace_;
  SimTime last_call_;
  std::uint64_t made_ = 0;
  std::unordered_map<const void*, std::uint64_t> live_;  // only looked up
};

/// @throws std::invalid_argument  not a trace, or cut off; the message names the byte.
std::vector<HeapTraceStep> read_heap_trace(Bytes trace);
SimTime heap_trace_start(Bytes trace);

struct HeapReplay {
  HeapFigures figures;        // at the end
  HeapHistory history;        // a sample per call of the trace
  std::uint64_t refused = 0;  // requests that this heap could not meet, and the recorded one could
};
/// Asks of a heap with these options what the trace says. Blocks that were refused are not freed.
/// @throws std::invalid_argument  as read_heap_trace and make_heap.
HeapReplay replay(Bytes trace, const HeapOptions& options);

}  // namespace orrery
