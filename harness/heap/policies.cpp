#include <orrery/harness/heap/address_list.hpp>
#include <orrery/harness/heap/class_lists.hpp>
#include <orrery/harness/heap/first_fit_heap.hpp>
#include <orrery/harness/heap/scatter_list.hpp>
#include <orrery/harness/heap/tagged_heap.hpp>

#include <stdexcept>
#include <string>

namespace orrery {
namespace {

using internal::BlockRules;
using internal::TaggedHeap;

template <class List>
std::unique_ptr<BlockHeap> heap_on(void* arena, const HeapOptions& options,
                                   const BlockRules& rules) {
  return std::make_unique<TaggedHeap<List>>(arena, options, rules);
}

BlockRules papers_rules(const HeapRules& rules) {
  return {.least_bytes = rules.least_block_bytes,
          .least_rest = rules.least_block_bytes,
          .rest_keeps_place = rules.policy == HeapPolicy::kFirstFit && rules.remainder_keeps_place,
          .growth_joins = rules.growth_joins_last_block,
          .realloc_grows_top = rules.realloc_grows_top};
}

// A block is 8 bytes of tags, and three words of payload at least (mattconte/tlsf).
constexpr BlockRules kTlsf = {
    .least_bytes = 32, .least_rest = 32, .growth_joins = true, .realloc_grows_top = true};
// heap_4 splits if more than two headers of 8 bytes remain. It has no realloc: what stands in for
// it allocates, copies and frees.
BlockRules free_rtos_rules(int alignment) {
  return {.least_bytes = 16,
          .least_rest = 16 + static_cast<std::uint32_t>(alignment),
          .growth_joins = true,
          .realloc_in_place = false};
}
constexpr BlockRules kNewlib = {.growth_joins = true, .realloc_grows_top = true};
constexpr BlockRules kScatter = {.realloc_in_place = false};

}  // namespace

std::unique_ptr<BlockHeap> make_heap(void* arena, const HeapOptions& options) {
  switch (options.rules.policy) {
    case HeapPolicy::kFirstFit:
      if (!options.rules.poison && !options.rules.remainder_keeps_place) {
        return std::make_unique<internal::FirstFitHeap>(arena, options,
                                                        papers_rules(options.rules));
      }
      return heap_on<internal::RecencyList>(arena, options, papers_rules(options.rules));
    case HeapPolicy::kBestFit:
      return heap_on<internal::BestFitLists>(arena, options, papers_rules(options.rules));
    case HeapPolicy::kNextFit:
      return heap_on<internal::AddressList>(arena, options, papers_rules(options.rules));
    case HeapPolicy::kTlsf:
      return heap_on<internal::TlsfLists>(arena, options, kTlsf);
    case HeapPolicy::kFreeRtos4:
      return heap_on<internal::AddressList>(arena, options, free_rtos_rules(options.alignment));
    case HeapPolicy::kNewlib:
      return heap_on<internal::NewlibBins>(arena, options, kNewlib);
    case HeapPolicy::kScatter:
      return heap_on<internal::ScatterList>(arena, options, kScatter);
  }
  throw std::invalid_argument(
      "make_heap: policy = " + std::to_string(static_cast<int>(options.rules.policy)) +
      "; HeapPolicy has no such value");
}

}  // namespace orrery
