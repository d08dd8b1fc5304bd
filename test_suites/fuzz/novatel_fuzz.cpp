// The flight software's NovAtel decoder: any stream is survived, a sound frame amid any bytes is
// found, and what the decoder reads from a frame the simulator's encoder writes again, byte for
// byte.
#include <cmath>
#include <cstring>

#include "../unit/models/gnss/novatel_reencode.hpp"
#include "fuzz_check.hpp"

namespace orrery::novatel {
namespace {

constexpr std::size_t kCapacity = 512;

// Takes bytes from the input's front; zeros when it is used up.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : rest_(std::as_bytes(std::span(data, size))) {}

  Bytes bytes(std::size_t count) {
    const Bytes taken = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  std::uint32_t number(std::size_t count) {
    std::uint32_t value = 0;
    for (const std::byte b : bytes(count)) value = value << 8 | std::to_integer<std::uint32_t>(b);
    return value;
  }
  Bytes rest() const { return rest_; }

 private:
  Bytes rest_;
};

Header any_header(Input& in) {
  constexpr std::uint16_t kIds[] = {7, 8, 37, 41, 42, 43, 73, 101, 140, 241, 1, 36};
  Header header;
  header.message_id = kIds[in.number(1) % std::size(kIds)];
  header.message_type = static_cast<std::uint8_t>(in.number(1) & 0x9F);  // binary
  header.port_address = static_cast<std::uint8_t>(in.number(1));
  header.sequence = static_cast<std::uint16_t>(in.number(1));
  header.time_status = TimeStatus{static_cast<std::uint8_t>(in.number(1))};
  header.t = from_ns(static_cast<std::int64_t>(in.number(4)) * 1'000'000'000);
  return header;
}

std::uint32_t u32_at(const novatel_frame& frame, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, frame.body + at, 4);
  return value;
}

bool has_nan(const novatel_frame& frame, std::size_t at) {
  for (std::size_t i = 0; i < 3; ++i) {
    if ((u32_at(frame, at + 4 * i) & 0x7F800000u) == 0x7F800000u) return true;
  }
  return false;
}

bool rangecmp_is_exact(const novatel_frame& frame) {
  for (std::uint32_t i = 0; i < novatel_count(&frame); ++i) {
    const std::size_t at = 4 + 24 * std::size_t{i};
    const std::uint32_t doppler = u32_at(frame, at + 4) & 0x0FFFFFFFu;
    const bool small = doppler < 0x01000000u || doppler > 0x0F000000u;  // fits a float
    if (!small || u32_at(frame, at + 20) >> 16 != 0) return false;      // reserved
  }
  return true;
}

// Texts end at their first zero; what follows it is not kept.
bool version_is_exact(const novatel_frame& frame) {
  constexpr std::size_t kWidths[] = {16, 16, 16, 16, 16, 12, 12};
  const unsigned char* at = frame.body + 4;
  for (std::uint32_t i = 0; i < novatel_count(&frame); ++i) {
    at += 4;
    for (const std::size_t width : kWidths) {
      for (std::size_t k = 1; k < width; ++k) {
        if (at[k - 1] == 0 && at[k] != 0) return false;
      }
      at += width;
    }
  }
  return true;
}

// Does the body hold nothing that the message's structs leave away?
bool is_exact(const novatel_frame& frame) {
  switch (frame.header.message_id) {
    case kBestXyzId:
      return frame.body[108] == 0 && !has_nan(frame, 32) && !has_nan(frame, 76);
    case kRangeCmpId:
      return rangecmp_is_exact(frame);
    case kVersionId:
      return version_is_exact(frame);
    default:
      return true;
  }
}

bool is_array(std::uint16_t id) {
  return id == kRangeId || id == kRangeCmpId || id == kAlmanacId || id == kVersionId;
}

void check_decoding(const novatel_frame& frame) {
  ByteBuffer again;
  if (!reencode(frame, again)) return;
  ByteBuffer third;
  for_each_frame(again, 64, kCapacity, [&](const novatel_frame& f) {
    fuzz_check(reencode(f, third), "what was written is read");
  });
  fuzz_check(third == again, "reading and writing again changes nothing");
  const std::size_t body_bytes = again.size() - kHeaderBytes - kCrcBytes;
  fuzz_check(body_bytes <= frame.header.body_bytes, "no more is written than was sent");
  const bool count_is_true =
      !is_array(frame.header.message_id) || u32_at(frame, 0) == novatel_count(&frame);
  if (!count_is_true || !is_exact(frame)) return;
  fuzz_check(std::memcmp(again.data() + kHeaderBytes, frame.body, body_bytes) == 0,
             "the encoder gives back the bytes that the decoder read");
}

void restore_phases(const novatel_frame& frame) {
  novatel_observation o;
  for (std::uint32_t i = 0; novatel_get_rangecmp(&frame, i, &o) != 0; ++i) {
    fuzz_check(std::isfinite(novatel_restored_phase_cycles(&o, 0.1903)), "a phase is finite");
  }
}

// Any bytes, cut anywhere, in any room.
void any_stream(Input& in) {
  const std::size_t capacity = in.number(1) * 3;  // 0 to 765
  const std::size_t chunk = 1 + in.number(1);
  std::size_t in_frames = 0;
  const novatel_framer framer =
      for_each_frame(in.rest(), chunk, capacity, [&](const novatel_frame& frame) {
        in_frames += kHeaderBytes + frame.header.body_bytes + kCrcBytes;
        if (frame.header.week < 10'000) check_decoding(frame);
      });
  fuzz_check(in_frames + framer.passed_over <= in.rest().size(), "no byte counts twice");
  fuzz_check(framer.end <= framer.capacity && framer.begin <= framer.end, "within the room");
}

// A sound frame behind any bytes is found once enough has come to settle what those were.
void frame_amid_noise(Input& in) {
  const Header header = any_header(in);
  const std::size_t chunk = 1 + in.number(1);
  const Bytes noise = in.bytes(in.number(1));
  const Bytes body = in.rest().first(std::min<std::size_t>(in.rest().size(), 400));
  ByteBuffer stream(noise.begin(), noise.end());
  append_frame(header, body, stream);
  stream.resize(stream.size() + kCapacity);
  bool found = false;
  for_each_frame(stream, chunk, kCapacity, [&](const novatel_frame& frame) {
    check_decoding(frame);
    restore_phases(frame);
    found =
        found ||
        (frame.header.message_id == header.message_id && frame.header.body_bytes == body.size() &&
         std::equal(body.begin(), body.end(), reinterpret_cast<const std::byte*>(frame.body)));
  });
  fuzz_check(found, "the frame is found");
}

}  // namespace
}  // namespace orrery::novatel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery::novatel;
  Input in(data, size);
  if (in.number(1) % 2 == 0) {
    any_stream(in);
  } else {
    frame_amid_noise(in);
  }
  return 0;
}
