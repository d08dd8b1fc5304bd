#include <orrery/harness/flight/call_recording.hpp>

namespace orrery {
namespace {

std::string hex(Bytes data) {
  constexpr char kDigits[] = "0123456789abcdef";
  if (data.empty()) return "-";
  std::string text;
  text.reserve(2 * data.size());
  for (const std::byte byte : data) {
    text += kDigits[std::to_integer<unsigned>(byte) >> 4];
    text += kDigits[std::to_integer<unsigned>(byte) & 15];
  }
  return text;
}

}  // namespace

void CallRecording::slot_loaded(std::uint32_t slot, const ByteBuffer* content) {
  text_ +=
      "slot " + std::to_string(slot) + " " + (content == nullptr ? "none" : hex(*content)) + "\n";
}
void CallRecording::boot(const Boot& boot) {
  text_ += "boot " + std::to_string(boot.now_ns) + " " + std::to_string(boot.count) + " " +
           std::to_string(boot.cause) + " ";
  text_ += boot.spacecraft;
  text_ += "/";
  text_ += boot.process;
  text_ += " " + hex(std::as_bytes(std::span(boot.config))) + "\n";
}
void CallRecording::input(std::int64_t now_ns, std::uint32_t port, Bytes data) {
  text_ += "in " + std::to_string(now_ns) + " " + std::to_string(port) + " " + hex(data) + "\n";
}
void CallRecording::tick(std::int64_t now_ns) {
  text_ += "tick " + std::to_string(now_ns) + "\n";
}
void CallRecording::destroy() {
  text_ += "destroy\n";
}
void CallRecording::output(std::uint32_t port, Bytes data) {
  text_ += "> out " + std::to_string(port) + " " + hex(data) + "\n";
}
void CallRecording::tick_request(std::int64_t at_ns) {
  text_ += "> tick " + std::to_string(at_ns) + "\n";
}
void CallRecording::status(std::int32_t status) {
  text_ += "> status " + std::to_string(status) + "\n";
}
void CallRecording::crash() {
  text_ += "> crash\n";
}

}  // namespace orrery
