/// A heap of tagged blocks: what all policies share.
#pragma once

#include <orrery/harness/heap/heap_figures.hpp>
#include <orrery/harness/heap/heap_options.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

namespace orrery {

namespace internal {

using HeapOffset = std::uint32_t;  // from the arena's first byte to a payload; 0: none

/// The arena of a heap and the extent of its blocks; what the lists of free blocks see of it.
struct HeapArea {
  // These lie where user data of other types did.
  using Word [[gnu::may_alias]] = std::uint32_t;
  using Link [[gnu::may_alias]] = std::uint64_t;
  static constexpr std::uint32_t kLive = 1;
  static constexpr HeapOffset kBad = 1;  // no payload lies there

  std::byte* arena = nullptr;
  std::uint32_t align = 16;
  HeapOffset first = 0;  // payload of the first block, if there is one
  HeapOffset top = 0;    // payload that the next block at the top would have

  std::byte* at(HeapOffset offset) const { return arena + offset; }
  Word& word(HeapOffset offset) const { return *reinterpret_cast<Word*>(arena + offset); }
  /// A free block's first 8 payload bytes, which belong to the list of free blocks.
  Link& link(HeapOffset payload) const { return *reinterpret_cast<Link*>(arena + payload); }
  Word& header(HeapOffset payload) const { return word(payload - 4); }
  Word& footer(HeapOffset payload, std::uint32_t size) const { return word(payload + size - 8); }
  std::uint32_t size(HeapOffset payload) const { return header(payload) & ~kLive; }
  void tag(HeapOffset payload, std::uint32_t size, std::uint32_t live) const {
    header(payload) = size | live;
    footer(payload, size) = size | live;
  }
  std::uint64_t distance(const void* address) const {
    return reinterpret_cast<std::uintptr_t>(address) - reinterpret_cast<std::uintptr_t>(arena);
  }
  bool within(HeapOffset payload) const {
    return payload - first < top - first && (payload & (align - 1)) == 0;
  }
  /// True if `tag` can be this block's header, and its footer says the same.
  bool sound(HeapOffset payload, std::uint32_t tag) const {
    const std::uint32_t size = tag & ~kLive;
    return size >= 16 && (size & (align - 1)) == 0 && size <= top - payload &&
           footer(payload, size) == tag;
  }
};

}  // namespace internal

/// A heap on a contiguous arena that grows at the top only.
///
/// Block     header and footer of 4 bytes, both (size | live bit), around the payload. Size counts
///           all of it and is a multiple of the alignment; the least is 16 unless the policy or
///           HeapRules say otherwise. The first 8 payload bytes of a free block belong to the list
///           of free blocks.
/// malloc    the block that the policy chooses, split if the rest makes a block; else a new block
///           at the top.
/// free      joins free neighbours at once.
/// realloc   shrinks by splitting, grows into a free successor, else moves. Size 0 frees.
/// memalign  above the alignment: asks for more and frees what lies before the aligned payload.
/// Order     depends on the calls and the options alone, never on the arena's address.
/// Checks    blocks that are touched; check() visits all. A fault goes to the handler; if that
///           returns, the call does nothing and returns null.
/// Source    Bell and D'Amico (heap model); Knuth, TAOCP 1, 2.5 (boundary tags).
/// Checked   test_suites/unit/harness/heap: first_fit_heap_test.cpp, heap_model_test.cpp
class BlockHeap {
 public:
  /// Faults of the user, and kExhausted. The handler need not return.
  using FaultHandler = void (*)(void* context, const HeapFault&);

  /// Largest limit: links and sizes are 32 bits, and 1 MiB stays free as a guard.
  static constexpr std::uint64_t kMaxLimit_bytes = (std::uint64_t{1} << 32) - (1 << 20);
  /// What an arena must hold for these options: the limit (kScatter: four times as much, so that
  /// there is room to choose from), what lies before the first block, and the end mark.
  static std::uint64_t arena_bytes(const HeapOptions& options);

  virtual ~BlockHeap() = default;
  BlockHeap(const BlockHeap&) = delete;
  BlockHeap& operator=(const BlockHeap&) = delete;

  void set_fault_handler(FaultHandler handler, void* context);
  /// Below heap_bytes is allowed. The arena must be as large. @throws std::invalid_argument
  void set_limit(std::uint64_t bytes);
  const HeapOptions& options() const { return options_; }

  // noexcept, as malloc is: a handler may jump, but not throw.
  /// Null, and errno ENOMEM, past the limit. malloc(0) is a block of its own.
  virtual void* allocate(std::size_t bytes) noexcept = 0;
  virtual void* allocate_zeroed(std::size_t count, std::size_t bytes) noexcept = 0;
  /// @param alignment  a power of two; null if it is none.
  virtual void* allocate_aligned(std::size_t alignment, std::size_t bytes) noexcept = 0;
  virtual void* reallocate(void* payload, std::size_t bytes) noexcept = 0;
  virtual void release(void* payload) noexcept = 0;  // null: nothing
  /// Bytes that may be written; 0 for null.
  std::size_t usable_bytes(void* payload);

  /// Everything since construction.
  HeapFigures figures() const;
  std::uint64_t limit_bytes() const { return options_.limit_bytes; }
  std::uint64_t live_bytes() const { return live_bytes_; }
  std::uint64_t high_water_bytes() const { return std::max(earlier_peak_bytes_, peak_bytes_); }
  std::uint64_t allocations() const { return allocations_; }
  std::uint64_t peak_since_mark_bytes() const { return peak_bytes_; }
  std::uint64_t heap_bytes() const { return area_.top - area_.first; }
  void* first_block() const { return area_.at(area_.first); }  // heap_bytes() from here on
  /// A few buckets of the free list are visited where it holds many blocks; else constant time.
  virtual std::uint64_t largest_free_bytes() const = 0;
  virtual std::uint64_t free_list_length() const = 0;
  /// From here on, transient_peak_bytes starts at what is live.
  void mark() {
    earlier_peak_bytes_ = high_water_bytes();
    peak_bytes_ = live_bytes_;
  }

  /// Visits every block and the list. True if all hold together; else false, and the handler was
  /// told of the first fault.
  virtual bool check() = 0;
  /// check() without the handler: the first fault, if there is one.
  std::optional<HeapFault> find_fault();

  struct Block {
    std::uint64_t begin = 0;  // bytes from the heap's first block
    std::uint64_t bytes = 0;
    bool live = false;
  };
  /// All blocks by address, up to the first that is corrupt.
  void visit_blocks(const std::function<void(const Block&)>& visit) const;

 protected:
  using Offset = internal::HeapOffset;
  static constexpr std::uint32_t kLive = internal::HeapArea::kLive;
  static constexpr std::uint32_t kTags_bytes = 8;  // header and footer
  static constexpr std::uint32_t kLeastBlock_bytes = 16;

  BlockHeap(void* arena, const HeapOptions& options, std::uint32_t least_block_bytes);

  void* pointer(Offset payload) const { return area_.at(payload); }
  /// Size of the block for a payload. Requests that cannot be met come out above any limit.
  std::uint64_t block_size(std::size_t bytes) const {
    if (bytes > kMaxLimit_bytes) return UINT64_MAX;
    const std::uint64_t align = area_.align;
    const std::uint64_t size = std::max<std::uint64_t>(bytes, 1) + kTags_bytes;
    return std::max<std::uint64_t>((size + align - 1) & ~(align - 1), least_);
  }
  /// The block that begins there if it is live and sound, else 0 after a report.
  Offset live_block(void* payload, const char* during) {
    const std::uint64_t distance = area_.distance(payload);
    const Offset block = static_cast<Offset>(distance);
    if (distance < area_.top && area_.within(block)) {
      const std::uint32_t found = area_.header(block);
      if ((found & kLive) != 0 && area_.sound(block, found)) return block;
    }
    fail(diagnose(payload), payload, during);
    return 0;
  }
  void* fail(HeapFault::Kind kind, const void* address, const char* during,
             std::uint64_t bytes = 0) const;
  HeapFault::Kind diagnose(const void* payload) const;

  void count_allocation(Offset payload) {
    add_live(area_.size(payload));
    ++allocations_;
  }
  void add_live(std::uint64_t bytes) {
    live_bytes_ += bytes;
    if (peak_bytes_ < live_bytes_) peak_bytes_ = live_bytes_;
  }

  internal::HeapArea area_;
  bool has_blocks_ = true;  // in the arena; else only counts are kept
  std::uint32_t least_;
  std::uint64_t live_bytes_ = 0;
  std::uint64_t peak_bytes_ = 0, earlier_peak_bytes_ = 0;  // since mark(), and before it
  std::uint64_t allocations_ = 0, frees_ = 0, failures_ = 0, search_steps_ = 0;
  HeapOptions options_;

 private:
  FaultHandler handler_ = nullptr;
  void* handler_context_ = nullptr;
};

/// @throws std::invalid_argument  an option is outside its range; the message begins with
/// `function`.
void check_heap_options(const char* function, const HeapOptions& options);

/// @param arena  arena_bytes(options), aligned to 16, zeroed or not.
/// @throws std::invalid_argument  alignment not 8 or 16, limit above kMaxLimit_bytes, least block
///                                outside its range, arena not aligned.
std::unique_ptr<BlockHeap> make_heap(void* arena, const HeapOptions& options);

}  // namespace orrery
