/// What a flight process was called with and what it answered, as text that orrery-flight-host runs
/// again without the simulator.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace orrery {

/// The lines of flight_sw/host/README.md but the first. Kept in memory: two characters per byte.
class CallRecording {
 public:
  struct Boot {
    std::int64_t now_ns = 0;
    std::uint32_t count = 0, cause = 0;
    std::string_view spacecraft = {}, process = {}, config = {};
  };
  /// By the call that is recorded next. Null: there was no such slot.
  void slot_loaded(std::uint32_t slot, const ByteBuffer* content);
  void boot(const Boot& boot);
  void input(std::int64_t now_ns, std::uint32_t port, Bytes data);
  void tick(std::int64_t now_ns);
  void destroy();
  void output(std::uint32_t port, Bytes data);
  void tick_request(std::int64_t at_ns);
  void status(std::int32_t status);
  void crash();

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace orrery
