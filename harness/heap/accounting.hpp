/// Heaps under a sanitizer that owns malloc: counted, not simulated.
#pragma once

#include <orrery/harness/heap/block_heap.hpp>

#include <memory>

namespace orrery {

class SimulatedHeap;

/// A heap that has no blocks of its own: what the sanitizer allocates while it is current is
/// charged to it. Figures are of requested bytes; heap_bytes is the most that was live at once,
/// holes do not exist. The sanitizer's hooks come after the fact and cannot make malloc return
/// null: passing the limit is HeapFault::kExhausted, for a handler that does not return.
std::unique_ptr<BlockHeap> make_accounting_heap(const HeapOptions& options);

namespace internal {

/// Installs the hooks, once. @pre heap_accounting_available()
void install_accounting();
/// Blocks of that heap are nobody's from here on.
void forget_accounts(const SimulatedHeap* heap);

}  // namespace internal
}  // namespace orrery
