/// What a simulated heap can say about itself.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>

#include <cstdint>

namespace orrery {

/// State of one heap. All sizes are of whole blocks, header and footer (8 bytes together) included,
/// so that live + free = heap exactly.
struct HeapFigures {
  std::uint64_t limit_bytes = 0;  // the cap on heap_bytes
  int alignment = 16;             // of payloads; every figure depends on it

  std::uint64_t resting_bytes = 0;         // live now
  std::uint64_t payload_bytes = 0;         // live now, less 8 bytes per block
  std::uint64_t live_blocks = 0;           //
  std::uint64_t transient_peak_bytes = 0;  // most live at once since the last mark()
  std::uint64_t high_water_bytes = 0;      // most live at once, ever
  std::uint64_t heap_bytes = 0;            // from the first block to the top; never shrinks
  std::uint64_t largest_free_bytes = 0;    // largest block on the free list
  std::uint64_t free_list_length = 0;      //

  std::uint64_t allocations = 0;   // that succeeded, growing moves of realloc included
  std::uint64_t frees = 0;         // likewise
  std::uint64_t failures = 0;      // refused at the cap
  std::uint64_t search_steps = 0;  // free blocks looked at by all allocations
};

/// True where flight software allocates from simulated heaps: the program links orrery::allocator
/// and no sanitizer owns malloc.
bool heap_simulation_available();
/// True where a sanitizer owns malloc but tells of what it allocates: figures are then of requested
/// bytes, without tags and holes, and passing a cap is always a crash. Where neither is true every
/// figure stays 0 and caps have no effect.
bool heap_accounting_available();

}  // namespace orrery
