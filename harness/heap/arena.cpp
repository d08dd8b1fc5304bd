#include <orrery/harness/heap/arena.hpp>

#include <bitset>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <string>
#include <sys/mman.h>

namespace orrery {
namespace {

// Slots belong to the address space, so to the program; they are all that simulations share.
struct SlotTable {
  std::mutex mutex;
  std::bitset<Arena::kSlots> used;
};

SlotTable& slot_table() {
  static SlotTable table;
  return table;
}

std::size_t take_lowest_slot() {
  SlotTable& table = slot_table();
  const std::lock_guard lock(table.mutex);
  for (std::size_t i = 0; i < Arena::kSlots; ++i) {
    if (table.used[i]) continue;
    table.used[i] = true;
    return i;
  }
  throw std::length_error("Arena: all " + std::to_string(Arena::kSlots) + " slots are in use");
}

void give_back_slot(std::size_t slot) {
  SlotTable& table = slot_table();
  const std::lock_guard lock(table.mutex);
  table.used[slot] = false;
}

std::string in_hex(const void* address) {
  char text[32];
  std::snprintf(text, sizeof text, "%p", address);
  return text;
}

}  // namespace

Arena::Arena() : slot_(take_lowest_slot()) {
  void* wanted = reinterpret_cast<void*>(kBase + slot_ * kSlot_bytes);
  // PROT_NONE commits nothing; open() then asks for what the heap may use.
  void* got = mmap(wanted, kSlot_bytes, PROT_NONE,
                   MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE, -1, 0);
  if (got != wanted) {
    const std::string reason =
        got == MAP_FAILED ? std::strerror(errno) : "the kernel offers another address";
    if (got != MAP_FAILED) munmap(got, kSlot_bytes);
    give_back_slot(slot_);
    throw std::runtime_error("Arena: 4 GiB of address space at " + in_hex(wanted) +
                             " are not to be had: " + reason);
  }
  base_ = static_cast<std::byte*>(got);
}

Arena::~Arena() {
  munmap(base_, kSlot_bytes);
  give_back_slot(slot_);
}

void Arena::open(std::uint64_t bytes) {
  constexpr std::uint64_t kPage_bytes = 4096;
  if (bytes > kSlot_bytes) {
    throw std::invalid_argument("Arena::open: " + std::to_string(bytes) +
                                " bytes are more than a slot's " + std::to_string(kSlot_bytes));
  }
  bytes = (bytes + kPage_bytes - 1) / kPage_bytes * kPage_bytes;
  if (bytes <= open_bytes_) return;
  if (mprotect(base_, bytes, PROT_READ | PROT_WRITE) != 0) {
    throw std::runtime_error("Arena::open: " + std::to_string(bytes) +
                             " bytes are not to be had: " + std::strerror(errno));
  }
  open_bytes_ = bytes;
}

void Arena::reset() {
  madvise(base_, open_bytes_, MADV_DONTNEED);
}

}  // namespace orrery
