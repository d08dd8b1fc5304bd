#include "formation_gnc/mission/command_plan.hpp"

#include "support/crc32.h"

namespace formation_gnc {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr double kLargest_m = 10e3;
constexpr std::int64_t kLatest_ns = INT64_C(6200) * 604800 * 1000000000;  // in 2098

bool comes_before(const formation_gnc_command& a, const formation_gnc_command& b) {
  return a.t_ns != b.t_ns ? a.t_ns < b.t_ns : a.number < b.number;
}

// Written so that a NaN is not a size.
bool is_size(double metres) {
  return metres >= 0.0 && metres <= kLargest_m;
}

}  // namespace

bool is_valid(const formation_gnc_command& c) {
  if (c.opcode == FORMATION_GNC_REMOVE || c.opcode == FORMATION_GNC_CLEAR) return true;
  if (c.opcode != FORMATION_GNC_UPLOAD || c.mode > FORMATION_GNC_SAFE) return false;
  if (c.t_ns < 0 || c.t_ns > kLatest_ns || c.end_ns < 0 || c.end_ns > kLatest_ns) return false;
  if (!is_size(c.a_m) || !is_size(c.b_m)) return false;
  if (c.mode == FORMATION_GNC_TRANSFER && c.end_ns <= c.t_ns) return false;
  return c.mode != FORMATION_GNC_SCIENCE || c.every >= 1;
}

bool CommandPlan::contains(std::uint32_t number) const {
  for (std::uint32_t k = 0; k < count_; ++k) {
    if (entries_[k].number == number) return true;
  }
  return false;
}

bool CommandPlan::remove(std::uint32_t number) {
  for (std::uint32_t k = 0; k < count_; ++k) {
    if (entries_[k].number != number) continue;
    for (std::uint32_t j = k + 1; j < count_; ++j) entries_[j - 1] = entries_[j];
    --count_;
    return true;
  }
  return false;
}

bool CommandPlan::upload(const formation_gnc_command& entry) {
  if (count_ == kCapacity && !contains(entry.number)) return false;
  remove(entry.number);
  std::uint32_t at = count_;
  for (; at > 0 && comes_before(entry, entries_[at - 1]); --at) entries_[at] = entries_[at - 1];
  entries_[at] = entry;
  ++count_;
  return true;
}

std::uint32_t CommandPlan::store(unsigned char (&to)[kStoredBytes]) const {
  to[0] = kVersion;
  to[1] = static_cast<unsigned char>(count_);
  to[2] = to[3] = 0;
  std::uint32_t bytes = 4;
  for (std::uint32_t k = 0; k < count_; ++k, bytes += FORMATION_GNC_COMMAND_BYTES) {
    formation_gnc_put_command(to + bytes, &entries_[k]);
  }
  orrery_put_u32(to + bytes, flight_crc32_common(to, bytes));
  return bytes + 4;
}

bool CommandPlan::restore(const unsigned char* from, std::uint32_t bytes) {
  if (bytes < 8 || bytes > kStoredBytes) return false;
  if (orrery_get_u32(from + bytes - 4) != flight_crc32_common(from, bytes - 4)) return false;
  const std::uint32_t count = from[1];
  if (from[0] != kVersion || bytes != 8 + count * FORMATION_GNC_COMMAND_BYTES) return false;
  CommandPlan read;
  for (std::uint32_t k = 0; k < count; ++k) {
    formation_gnc_command entry;
    if (!formation_gnc_get_command(from + 4 + k * FORMATION_GNC_COMMAND_BYTES,
                                   FORMATION_GNC_COMMAND_BYTES, &entry) ||
        !is_valid(entry) || !read.upload(entry)) {
      return false;
    }
  }
  *this = read;
  return true;
}

}  // namespace formation_gnc
