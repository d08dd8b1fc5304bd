/// The paper's allocator: boundary tags, a LIFO free list, first fit, immediate coalescing.
#pragma once

#include <orrery/harness/heap/heap_figures.hpp>

#include <cstddef>
#include <cstdint>

namespace orrery {

/// Where the paper is silent, the default is its literal reading.
struct FirstFitOptions {
  int alignment = 16;                      // of payloads: 16 (x86-64's ABI) or 8 (the paper)
  std::uint64_t limit_bytes = 64'000'000;  // cap on HeapFigures::heap_bytes
  bool remainder_keeps_place = false;    // of a split block in the list; else it goes to the front
  bool growth_joins_last_block = false;  // if that is free; else a new block is made behind it
  bool realloc_grows_top = false;        // of the last block, in place; else it moves
};

/// What a heap found to be wrong in what its user did.
struct HeapFault {
  enum class Kind : std::uint8_t {
    kDoubleFree,       // the pointer lies in a free block
    kInteriorPointer,  // in a live block, but not at its start
    kForeignPointer,   // in no block of this heap
    kCorruptBlock,     // header, footer or link of a block was overwritten
    kExhausted,        // a request would have passed the limit
  };
  Kind kind = Kind::kForeignPointer;
  const void* address = nullptr;  // the pointer handed in, or the corrupt block's payload
  std::uint64_t bytes = 0;        // of the request, with kExhausted
  const char* during = "";        // "malloc", "free" ...
};
const char* to_string(HeapFault::Kind kind);

/// A heap on a contiguous arena that grows at the top only.
///
/// Block     header and footer of 4 bytes, both (size | live bit), around the payload. Size counts
///           all of it and is a multiple of the alignment; the least is 16. Free blocks keep next
///           and previous in their first 8 payload bytes, as 32-bit offsets into the arena.
/// malloc    the first block of the list that is large enough, most recently freed first; split if
///           16 bytes or more remain; else a new block at the top.
/// free      joins free neighbours at once and goes to the front of the list.
/// realloc   shrinks by splitting, grows into a free successor, else moves. Size 0 frees.
/// memalign  above the alignment: asks for more and frees what lies before the aligned payload.
/// Order     depends on the calls alone, never on the arena's address.
/// Checks    blocks that are touched; check() visits all. A fault goes to the handler; if that
///           returns, the call does nothing and returns null.
/// Source    Bell and D'Amico (heap model); Knuth, TAOCP 1, 2.5 (boundary tags).
/// Checked   test_suites/unit/harness/heap/first_fit_heap_test.cpp
class FirstFitHeap {
 public:
  /// Faults of the user, and kExhausted. The handler need not return.
  using FaultHandler = void (*)(void* context, const HeapFault&);

  /// Largest limit: links and sizes are 32 bits, and 1 MiB stays free as a guard.
  static constexpr std::uint64_t kMaxLimit_bytes = (std::uint64_t{1} << 32) - (1 << 20);
  /// An arena holds this much more than the limit: before the first block, and its end mark.
  static constexpr std::uint64_t kOverhead_bytes = 64;

  /// @param arena  limit_bytes + kOverhead_bytes, aligned to 16, zeroed or not.
  /// @throws std::invalid_argument  alignment not 8 or 16, limit above kMaxLimit_bytes, arena not
  ///                                aligned.
  FirstFitHeap(void* arena, const FirstFitOptions& options);

  void set_fault_handler(FaultHandler handler, void* context);
  /// Below heap_bytes is allowed. The arena must be as large. @throws std::invalid_argument
  void set_limit(std::uint64_t bytes);

  /// Null past the limit. malloc(0) is a block of its own.
  void* allocate(std::size_t bytes);
  void* allocate_zeroed(std::size_t count, std::size_t bytes);
  /// @param alignment  a power of two; null if it is none.
  void* allocate_aligned(std::size_t alignment, std::size_t bytes);
  void* reallocate(void* payload, std::size_t bytes);
  void release(void* payload);  // null: nothing
  /// Bytes that may be written; 0 for null.
  std::size_t usable_bytes(void* payload);

  /// Everything since construction. Constant time, but the list is walked for the largest free
  /// block if the last such one was taken.
  HeapFigures figures() const;
  std::uint64_t limit_bytes() const { return options_.limit_bytes; }
  std::uint64_t live_bytes() const { return live_bytes_; }
  std::uint64_t allocations() const { return allocations_; }
  std::uint64_t peak_since_mark_bytes() const { return peak_bytes_; }
  std::uint64_t heap_bytes() const { return top_ - first_; }
  std::uint64_t largest_free_bytes() const;
  /// From here on, transient_peak_bytes starts at what is live.
  void mark() { peak_bytes_ = live_bytes_; }

  /// Visits every block and the list. True if all hold together; else false, and the handler was
  /// told of the first fault.
  bool check();

 private:
  using Offset = std::uint32_t;      // from the arena to a payload; 0: none
  static constexpr Offset kBad = 1;  // no payload lies there

  using Word [[gnu::may_alias]] = std::uint32_t;  // lies where user data of other types did

  Word& word(Offset at) const { return *reinterpret_cast<Word*>(arena_ + at); }
  Word& header(Offset payload) const { return word(payload - 4); }
  Word& next(Offset payload) const { return word(payload); }
  Word& previous(Offset payload) const { return word(payload + 4); }
  std::uint32_t footer(Offset payload, std::uint32_t size) const {
    return word(payload + size - 8);
  }
  void tag(Offset payload, std::uint32_t size, std::uint32_t live) const {
    header(payload) = size | live;
    word(payload + size - 8) = size | live;
  }
  void* pointer(Offset payload) const { return arena_ + payload; }

  std::uint64_t block_size(std::size_t bytes) const;
  bool within(Offset payload) const {
    return payload - first_ < top_ - first_ &&
           (payload & (static_cast<Offset>(options_.alignment) - 1)) == 0;
  }
  bool sound(Offset payload, std::uint32_t tag) const;
  bool linked(Offset payload) const;
  bool leads(Offset payload, std::uint32_t size) const;
  Offset live_block(void* payload, const char* during);
  void* fail(HeapFault::Kind kind, const void* address, const char* during,
             std::uint64_t bytes = 0) const;
  HeapFault::Kind diagnose(const void* payload) const;

  Offset take(std::uint64_t size, const char* during);
  Offset take_from_list(std::uint32_t size, const char* during);
  Offset grow(std::uint64_t size, const char* during);
  Offset grow_in_place(Offset payload, std::uint32_t size, std::uint64_t wanted);
  void trim(Offset payload, std::uint32_t wanted);
  bool push_joined(Offset payload, std::uint32_t size);
  void push_front(Offset payload, std::uint32_t size);
  void replace(Offset old_block, Offset new_block, std::uint32_t old_size, std::uint32_t size);
  void unlink(Offset payload, std::uint32_t size);
  void forget_largest(std::uint32_t size);
  void count_allocation(Offset payload);
  void add_live(std::uint64_t bytes);
  bool check_blocks(std::uint64_t& free_blocks);
  bool check_list(std::uint64_t free_blocks);

  std::byte* arena_;
  FirstFitOptions options_;
  FaultHandler handler_ = nullptr;
  void* handler_context_ = nullptr;

  Offset first_;     // payload of the first block, if there is one
  Offset top_;       // payload that the next block at the top would have
  Offset list_ = 0;  // front of the free list
  std::uint64_t live_bytes_ = 0, live_blocks_ = 0, peak_bytes_ = 0, high_water_bytes_ = 0;
  std::uint64_t allocations_ = 0, frees_ = 0, failures_ = 0, search_steps_ = 0;
  std::uint64_t list_length_ = 0;
  // While unknown: the size of the largest block taken, which no free block exceeds.
  mutable std::uint32_t largest_free_bytes_ = 0;
  mutable bool largest_is_known_ = true;
};

}  // namespace orrery
