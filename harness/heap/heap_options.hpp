/// How a simulated heap chooses blocks, what it checks, and what it does at its cap.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>
#include <string>

namespace orrery {

/// Which free block a request gets. All policies share one layout of blocks (block_heap.hpp), so
/// that figures compare; what real allocators of these names do beyond that is not modelled.
enum class HeapPolicy : std::uint8_t {
  kFirstFit,   // the paper's: first of a list, most recently freed in front
  kBestFit,    // the smallest that is large enough, of equals the one freed last
  kNextFit,    // the next by address from where the last search ended, round the heap
  kTlsf,       // two-level segregated fit: head of the next larger of 32 classes per power of two
  kFreeRtos4,  // heap_4 of FreeRTOS: first fit by address; realloc always moves
  kNewlib,     // newlib's malloc (dlmalloc 2.6): sorted bins, last remainder, wilderness at the top
  kScatter,    // any place at all, from a seeded stream; the cap counts live bytes
};
const char* to_string(HeapPolicy policy);  // "first fit"

/// Everything about a heap but its size. The defaults are the paper's, read literally where it is
/// silent.
struct HeapRules {
  HeapPolicy policy = HeapPolicy::kFirstFit;

  // First, best and next fit obey these; the other policies have rules of their own.
  bool remainder_keeps_place = false;    // of a split block in the list; else it goes to the front
  bool growth_joins_last_block = false;  // if that is free; else a new block is made behind it
  bool realloc_grows_top = false;        // of the last block, in place; else it moves
  std::uint32_t least_block_bytes = 16;  // multiple of the alignment, 16 ... 4096; rests below it
                                         // stay with their block
  bool realloc_to_zero_keeps = false;    // a least block; else realloc(p, 0) frees and is null

  // Modes that cost time. None changes which block is chosen.
  bool poison = false;       // free memory is 0xDD; what writes there is found at reuse or check()
  bool fill = false;         // malloc's memory holds bytes drawn from (seed, number of the request)
  bool track_sites = false;  // where blocks were allocated and freed: for reports and leaks

  std::uint64_t seed = 0;  // of kScatter and fill; a world gives its own
};

struct HeapOptions {
  int alignment = 16;                      // of payloads: 16 (x86-64's ABI) or 8 (the paper)
  std::uint64_t limit_bytes = 64'000'000;  // cap on HeapFigures::heap_bytes
  HeapRules rules = {};
};

/// What a heap found to be wrong in what its user did.
struct HeapFault {
  enum class Kind : std::uint8_t {
    kDoubleFree,       // the pointer lies in a free block
    kInteriorPointer,  // in a live block, but not at its start
    kForeignPointer,   // in no block of this heap
    kCorruptBlock,     // header, footer or link of a block was overwritten
    kWriteAfterFree,   // poison of a free block was overwritten
    kExhausted,        // a request would have passed the limit
  };
  Kind kind = Kind::kForeignPointer;
  const void* address = nullptr;  // the pointer handed in, the corrupt block's payload, or the byte
  std::uint64_t bytes = 0;        // of the request, with kExhausted
  const char* during = "";        // "malloc", "free" ...
};
const char* to_string(HeapFault::Kind kind);

}  // namespace orrery
