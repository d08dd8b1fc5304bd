/// Orders for the library flight_test_subject (libraries/subject.c).
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace orrery {

inline ByteBuffer order(std::string_view text) {
  ByteBuffer bytes(text.size());
  if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

template <class Integer>
ByteBuffer order(char what, Integer argument) {
  ByteBuffer bytes(1 + sizeof argument);
  bytes[0] = static_cast<std::byte>(what);
  std::memcpy(bytes.data() + 1, &argument, sizeof argument);  // little-endian, as the message is
  return bytes;
}
inline ByteBuffer allocate(std::uint32_t bytes) {
  return order('k', bytes);
}
inline ByteBuffer allocate_briefly(std::uint32_t bytes) {
  return order('b', bytes);
}
inline ByteBuffer request_tick(std::int64_t at_ns) {
  return order('q', at_ns);
}
inline ByteBuffer return_status(std::int32_t status) {
  return order('?', status);
}

inline std::string text_of(Bytes bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

/// The time in a message of the port "times".
inline std::int64_t time_of(Bytes message) {
  std::int64_t value = 0;
  std::memcpy(&value, message.data() + 1, sizeof value);
  return value;
}

}  // namespace orrery
