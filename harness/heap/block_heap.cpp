#include <orrery/harness/heap/block_heap.hpp>

#include <stdexcept>
#include <string>

namespace orrery {
namespace {

void check_limit(const char* function, std::uint64_t bytes) {
  if (bytes > BlockHeap::kMaxLimit_bytes) {
    throw std::invalid_argument(std::string(function) + ": heap limit = " + std::to_string(bytes) +
                                " bytes is above " + std::to_string(BlockHeap::kMaxLimit_bytes));
  }
}

}  // namespace

void check_heap_options(const char* function, const HeapOptions& options) {
  if (options.alignment != 8 && options.alignment != 16) {
    throw std::invalid_argument(std::string(function) + ": heap_alignment = " +
                                std::to_string(options.alignment) + " bytes; it is 8 or 16");
  }
  check_limit(function, options.limit_bytes);
  const std::uint32_t least = options.rules.least_block_bytes;
  if (least < 16 || least > 4096 || least % static_cast<std::uint32_t>(options.alignment) != 0) {
    throw std::invalid_argument(std::string(function) +
                                ": least_block_bytes = " + std::to_string(least) +
                                "; it is a multiple of the alignment from 16 to 4096");
  }
}

const char* to_string(HeapPolicy policy) {
  switch (policy) {
    case HeapPolicy::kFirstFit:
      return "first fit";
    case HeapPolicy::kBestFit:
      return "best fit";
    case HeapPolicy::kNextFit:
      return "next fit";
    case HeapPolicy::kTlsf:
      return "TLSF";
    case HeapPolicy::kFreeRtos4:
      return "FreeRTOS heap_4";
    case HeapPolicy::kNewlib:
      return "newlib";
    case HeapPolicy::kScatter:
      return "scatter";
  }
  return "unknown heap policy";
}

const char* to_string(HeapFault::Kind kind) {
  switch (kind) {
    case HeapFault::Kind::kDoubleFree:
      return "double free";
    case HeapFault::Kind::kInteriorPointer:
      return "pointer into a block";
    case HeapFault::Kind::kForeignPointer:
      return "pointer to no block of this heap";
    case HeapFault::Kind::kCorruptBlock:
      return "overwritten block header, footer or link";
    case HeapFault::Kind::kWriteAfterFree:
      return "write to memory after it was freed";
    case HeapFault::Kind::kExhausted:
      return "heap limit passed";
  }
  return "unknown heap fault";
}

std::uint64_t BlockHeap::arena_bytes(const HeapOptions& options) {
  constexpr std::uint64_t kOverhead_bytes = 64;
  const std::uint64_t limit = std::min(options.limit_bytes, kMaxLimit_bytes);
  const std::uint64_t blocks = options.rules.policy == HeapPolicy::kScatter
                                   ? std::min(4 * limit + (std::uint64_t{1} << 16), kMaxLimit_bytes)
                                   : limit;
  return blocks + kOverhead_bytes;
}

BlockHeap::BlockHeap(void* arena, const HeapOptions& options, std::uint32_t least_block_bytes)
    : least_(least_block_bytes), options_(options) {
  check_heap_options("make_heap", options);
  if (reinterpret_cast<std::uintptr_t>(arena) % 16 != 0) {
    throw std::invalid_argument("make_heap: the arena is not aligned to 16 bytes");
  }
  area_.arena = static_cast<std::byte*>(arena);
  area_.align = static_cast<std::uint32_t>(options.alignment);
  area_.first = area_.top = area_.align;
  area_.word(area_.first - 8) = kLive;  // footer of a block before the first: nothing to join
  area_.header(area_.top) = kLive;      // header of a block after the last
}

void BlockHeap::set_fault_handler(FaultHandler handler, void* context) {
  handler_ = handler;
  handler_context_ = context;
}

std::optional<HeapFault> BlockHeap::find_fault() {
  std::optional<HeapFault> first;
  const FaultHandler handler = handler_;
  void* const context = handler_context_;
  set_fault_handler(
      [](void* found, const HeapFault& fault) {
        static_cast<std::optional<HeapFault>*>(found)->emplace(fault);
      },
      &first);
  check();
  set_fault_handler(handler, context);
  return first;
}

void BlockHeap::set_limit(std::uint64_t bytes) {
  check_limit("BlockHeap::set_limit", bytes);
  options_.limit_bytes = bytes;
}

std::size_t BlockHeap::usable_bytes(void* payload) {
  if (payload == nullptr) return 0;
  const Offset block = live_block(payload, "malloc_usable_size");
  return block == 0 ? 0 : area_.size(block) - kTags_bytes;
}

// Walks all blocks, which is dear, but something is wrong anyway.
HeapFault::Kind BlockHeap::diagnose(const void* payload) const {
  const std::uint64_t distance = area_.distance(payload);
  if (distance < area_.first || distance >= area_.top) return HeapFault::Kind::kForeignPointer;
  for (Offset block = area_.first; block < area_.top;) {
    const std::uint32_t found = area_.header(block);
    if (!area_.sound(block, found)) return HeapFault::Kind::kCorruptBlock;
    const std::uint32_t size = found & ~kLive;
    if (distance < std::uint64_t{block} - 4 + size) {
      return (found & kLive) != 0 ? HeapFault::Kind::kInteriorPointer
                                  : HeapFault::Kind::kDoubleFree;
    }
    block += size;
  }
  return HeapFault::Kind::kForeignPointer;
}

void* BlockHeap::fail(HeapFault::Kind kind, const void* address, const char* during,
                      std::uint64_t bytes) const {
  if (handler_ != nullptr) handler_(handler_context_, HeapFault{kind, address, bytes, during});
  return nullptr;
}

void BlockHeap::visit_blocks(const std::function<void(const Block&)>& visit) const {
  for (Offset block = area_.first; has_blocks_ && block < area_.top;) {
    const std::uint32_t found = area_.header(block);
    if (!area_.sound(block, found)) return;
    const std::uint32_t size = found & ~kLive;
    visit({block - area_.first, size, (found & kLive) != 0});
    block += size;
  }
}

HeapFigures BlockHeap::figures() const {
  HeapFigures f;
  f.limit_bytes = options_.limit_bytes;
  f.alignment = options_.alignment;
  f.resting_bytes = live_bytes_;
  f.live_blocks = allocations_ - frees_;
  f.payload_bytes = live_bytes_ - (has_blocks_ ? kTags_bytes * f.live_blocks : 0);
  f.transient_peak_bytes = peak_bytes_;
  f.high_water_bytes = high_water_bytes();
  f.heap_bytes = heap_bytes();
  f.largest_free_bytes = largest_free_bytes();
  f.free_list_length = free_list_length();
  f.allocations = allocations_;
  f.frees = frees_;
  f.failures = failures_;
  f.search_steps = search_steps_;
  return f;
}

}  // namespace orrery
