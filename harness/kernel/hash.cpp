#include <orrery/harness/kernel/hash.hpp>

#include <cstring>

namespace orrery {

static_assert(std::endian::native == std::endian::little,
              "hash_bytes reads words as they lie in memory: swap them on this machine");

std::uint64_t hash_bytes(std::uint64_t h, Bytes bytes) {
  h = hash_word(h, bytes.size());
  while (bytes.size() >= 8) {
    std::uint64_t word;
    std::memcpy(&word, bytes.data(), 8);
    h = hash_word(h, word);
    bytes = bytes.subspan(8);
  }
  if (bytes.empty()) return h;
  std::uint64_t word = 0;
  std::memcpy(&word, bytes.data(), bytes.size());
  return hash_word(h, word);
}

std::uint64_t hash_text(std::uint64_t h, std::string_view text) {
  return hash_bytes(h, std::as_bytes(std::span(text)));
}

}  // namespace orrery
