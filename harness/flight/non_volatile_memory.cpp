#include <orrery/harness/flight/non_volatile_memory.hpp>

#include <algorithm>
#include <cerrno>

namespace orrery {
namespace {

void flip(ByteBuffer& bytes, const std::vector<std::uint64_t>& bits) {
  for (const std::uint64_t bit : bits) {
    if (bit / 8 < bytes.size()) bytes[bit / 8] ^= std::byte{1} << (bit % 8);
  }
}

// What a store leaves that ended after `kept` bytes.
void tear(ByteBuffer& bytes, std::uint64_t kept, const ByteBuffer& before) {
  constexpr std::byte kErased{0xff};
  for (std::uint64_t i = kept; i < bytes.size(); ++i) {
    bytes[i] = i < before.size() ? before[i] : kErased;
  }
}

}  // namespace

WriteFault NonVolatileMemory::next_fault(std::uint64_t bytes) {
  ++writes_;
  if (!faults_) return {};
  WriteFault fault = faults_(writes_, bytes);
  if (fault.full || fault.kept_bytes || !fault.flipped_bits.empty()) ++faulty_writes_;
  return fault;
}

const ByteBuffer* NonVolatileMemory::slot(std::uint32_t number) const {
  for (const auto& [n, content] : slots_) {
    if (n == number) return &content;
  }
  return nullptr;
}

bool NonVolatileMemory::store(std::uint32_t number, ByteBuffer content) {
  const WriteFault fault = next_fault(content.size());
  std::uint64_t others = 0;
  for (const auto& [n, other] : slots_) others += n == number ? 0 : other.size();
  if (fault.full || others + content.size() > slot_bytes_) return false;
  const auto place = std::lower_bound(
      slots_.begin(), slots_.end(), number,
      [](const auto& entry, std::uint32_t sought) { return entry.first < sought; });
  const bool exists = place != slots_.end() && place->first == number;
  flip(content, fault.flipped_bits);
  if (fault.kept_bytes) tear(content, *fault.kept_bytes, exists ? place->second : ByteBuffer{});
  if (exists) {
    place->second = std::move(content);
  } else {
    slots_.insert(place, {number, std::move(content)});
  }
  return true;
}

int NonVolatileMemory::write_file(FlightFiles::Node& node, std::uint64_t at, ByteBuffer& bytes,
                                  std::int64_t unix_ns) {
  const WriteFault fault = next_fault(bytes.size());
  if (fault.full) return -ENOSPC;
  flip(bytes, fault.flipped_bits);
  const Bytes all(bytes);
  return files.write(node, at,
                     fault.kept_bytes ? all.first(std::min(*fault.kept_bytes, all.size())) : all,
                     unix_ns);
}

}  // namespace orrery
