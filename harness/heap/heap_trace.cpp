#include <orrery/harness/heap/arena.hpp>
#include <orrery/harness/heap/block_heap.hpp>
#include <orrery/harness/heap/heap_trace.hpp>

#include <bit>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

namespace orrery {
namespace {

constexpr char kMagic[] = "ORRHEAP1";
constexpr std::size_t kHeader_bytes = 16;

class Reader {
 public:
  explicit Reader(Bytes trace) : trace_(trace), at_(kHeader_bytes) {
    if (trace.size() < kHeader_bytes || std::memcmp(trace.data(), kMagic, 8) != 0) {
      fail("does not begin with ORRHEAP1 and a start", 0);
    }
  }
  bool at_end() const { return at_ == trace_.size(); }
  std::size_t at() const { return at_; }
  std::uint64_t number() {
    std::uint64_t value = 0;
    const std::size_t begin = at_;
    for (unsigned shift = 0;; shift += 7) {
      if (at_ == trace_.size()) fail("ends within a number", begin);
      if (shift > 63) fail("has a number above 64 bits", begin);
      const std::uint64_t byte = std::to_integer<std::uint64_t>(trace_[at_++]);
      value |= (byte & 0x7F) << shift;
      if ((byte & 0x80) == 0) return value;
    }
  }
  [[noreturn]] static void fail(const std::string& what, std::size_t at) {
    throw std::invalid_argument("heap trace " + what + " (byte " + std::to_string(at) + ")");
  }

 private:
  Bytes trace_;
  std::size_t at_;
};

}  // namespace

// ---- writing

HeapTraceWriter::HeapTraceWriter(SimTime start) : last_call_(start) {
  trace_.resize(kHeader_bytes);
  std::memcpy(trace_.data(), kMagic, 8);
  const std::uint64_t ns = static_cast<std::uint64_t>(to_ns(start));
  for (unsigned i = 0; i < 8; ++i) trace_[8 + i] = static_cast<std::byte>(ns >> (8 * i));
}

void HeapTraceWriter::number(std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) trace_.push_back(static_cast<std::byte>(value | 0x80));
  trace_.push_back(static_cast<std::byte>(value));
}

void HeapTraceWriter::record(HeapOperation operation, std::uint64_t value) {
  number(value << 3 | static_cast<std::uint64_t>(operation));
}

void HeapTraceWriter::malloc(const void* made, std::uint64_t bytes) {
  record(HeapOperation::kMalloc, bytes);
  live_[made] = made_++;
}

void HeapTraceWriter::calloc(const void* made, std::uint64_t bytes) {
  record(HeapOperation::kCalloc, bytes);
  live_[made] = made_++;
}

void HeapTraceWriter::memalign(const void* made, std::uint64_t bytes, std::uint64_t alignment) {
  record(HeapOperation::kMemalign, bytes);
  number(static_cast<std::uint64_t>(std::bit_width(alignment)) - 1);
  live_[made] = made_++;
}

void HeapTraceWriter::realloc(const void* old, const void* made, std::uint64_t bytes) {
  const auto block = live_.find(old);
  if (block == live_.end()) {
    malloc(made, bytes);
    return;
  }
  record(HeapOperation::kRealloc, bytes);
  number(made_ - block->second);
  live_.erase(block);
  live_[made] = made_++;
}

void HeapTraceWriter::free(const void* block) {
  const auto found = live_.find(block);
  if (found == live_.end()) return;
  record(HeapOperation::kFree, made_ - found->second);
  live_.erase(found);
}

void HeapTraceWriter::call_returned(SimTime t) {
  record(HeapOperation::kCall, static_cast<std::uint64_t>((t - last_call_).count()));
  last_call_ = t;
}

// ---- reading

SimTime heap_trace_start(Bytes trace) {
  const Reader checked(trace);
  std::uint64_t ns = 0;
  for (unsigned i = 0; i < 8; ++i) ns |= std::to_integer<std::uint64_t>(trace[8 + i]) << (8 * i);
  return from_ns(static_cast<std::int64_t>(ns));
}

std::vector<HeapTraceStep> read_heap_trace(Bytes trace) {
  std::vector<HeapTraceStep> steps;
  Reader reader(trace);
  std::uint64_t made = 0;
  Duration t{};
  while (!reader.at_end()) {
    const std::size_t begin = reader.at();
    const std::uint64_t first = reader.number(), value = first >> 3;
    const auto block_of_age = [&](std::uint64_t age) {
      if (age == 0 || age > made) Reader::fail("names a block that was never made", begin);
      return made - age;
    };
    HeapTraceStep step;
    step.operation = static_cast<HeapOperation>(first & 7);
    step.bytes = value;
    switch (step.operation) {
      case HeapOperation::kMalloc:
      case HeapOperation::kCalloc:
        step.block = made++;
        break;
      case HeapOperation::kMemalign: {
        const std::uint64_t log2 = reader.number();
        if (log2 > 32) Reader::fail("has an alignment above 2^32", begin);
        step.alignment = std::uint64_t{1} << log2;
        step.block = made++;
        break;
      }
      case HeapOperation::kRealloc:
        step.old_block = block_of_age(reader.number());
        step.block = made++;
        break;
      case HeapOperation::kFree:
        step.bytes = 0;
        step.block = block_of_age(value);
        break;
      case HeapOperation::kCall:
        step.bytes = 0;
        t += Duration(static_cast<std::int64_t>(value));
        step.since_start = t;
        break;
      default:
        Reader::fail("has an unknown operation " + std::to_string(first & 7), begin);
    }
    steps.push_back(step);
  }
  return steps;
}

// ---- replay

namespace {

class Replayer {
 public:
  Replayer(const HeapOptions& options, SimTime start)
      : heap_(make_heap(opened(options), options)), start_(start) {
    result_.history = HeapHistory(start);
  }

  void play(const HeapTraceStep& step) {
    switch (step.operation) {
      case HeapOperation::kMalloc:
        made(heap_->allocate(step.bytes));
        return;
      case HeapOperation::kCalloc:
        made(heap_->allocate_zeroed(1, step.bytes));
        return;
      case HeapOperation::kMemalign:
        made(heap_->allocate_aligned(step.alignment, step.bytes));
        return;
      case HeapOperation::kRealloc:
        resize(step);
        return;
      case HeapOperation::kFree:
        heap_->release(std::exchange(blocks_[step.block], nullptr));
        return;
      case HeapOperation::kCall:
        end_call(start_ + step.since_start);
        return;
    }
  }
  HeapReplay finish() {
    result_.figures = heap_->figures();
    return std::move(result_);
  }

 private:
  void* opened(const HeapOptions& options) {
    arena_.open(BlockHeap::arena_bytes(options));
    return arena_.base();
  }
  void made(void* block) {
    result_.refused += block == nullptr ? 1 : 0;
    blocks_.push_back(block);
  }
  void resize(const HeapTraceStep& step) {
    void* old = std::exchange(blocks_[step.old_block], nullptr);
    void* now = heap_->reallocate(old, step.bytes);
    if (now == nullptr) heap_->release(old);
    made(now);
  }
  void end_call(SimTime t) {
    result_.history.add({.t = t,
                         .resting_bytes = heap_->live_bytes(),
                         .transient_peak_bytes = heap_->peak_since_mark_bytes(),
                         .heap_bytes = heap_->heap_bytes(),
                         .largest_free_bytes = heap_->largest_free_bytes(),
                         .free_list_length = heap_->free_list_length(),
                         .allocations = heap_->allocations() - allocations_before_});
    heap_->mark();
    allocations_before_ = heap_->allocations();
  }

  Arena arena_;
  std::unique_ptr<BlockHeap> heap_;
  SimTime start_;
  std::vector<void*> blocks_;
  std::uint64_t allocations_before_ = 0;
  HeapReplay result_;
};

}  // namespace

HeapReplay replay(Bytes trace, const HeapOptions& options) {
  Replayer replayer(options, heap_trace_start(trace));
  for (const HeapTraceStep& step : read_heap_trace(trace)) replayer.play(step);
  return replayer.finish();
}

}  // namespace orrery
