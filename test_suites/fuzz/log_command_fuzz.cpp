// LogCommandReader: any bytes are taken, held ones stay few, and cuts of the stream mean nothing.
#include <orrery/models/gnss/log_command.hpp>

#include <algorithm>

#include "fuzz_check.hpp"

namespace orrery::novatel {
namespace {

constexpr Header kHeader{.t = from_ns(2358 * 604'800'000'000'000LL)};

struct Receiver {
  LogSchedule schedule;
  LogCommandReader reader{schedule, 100ms};
  ByteBuffer answers;
};

void check(Bytes stream, std::size_t chunk) {
  Receiver whole, cut;
  whole.reader.take(stream, kHeader, whole.answers);
  for (std::size_t at = 0; at < stream.size(); at += chunk) {
    cut.reader.take(stream.subspan(at, std::min(chunk, stream.size() - at)), kHeader, cut.answers);
  }
  fuzz_check(cut.answers == whole.answers, "cuts of the stream change no answer");
  fuzz_check(cut.reader.accepted() == whole.reader.accepted(), "nor what is accepted");
  fuzz_check(whole.schedule.size() <= LogSchedule::kMaxLogs, "the list has its length");
  fuzz_check(whole.schedule.due(kHeader.t).size() <= LogSchedule::kMaxLogs,
             "and so has what is due");
}

}  // namespace
}  // namespace orrery::novatel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace orrery;
  if (size == 0) return 0;
  const Bytes input = std::as_bytes(std::span(data, size));
  novatel::check(input.subspan(1), 1u + data[0]);
  // The same bytes as the body of a frame, whose CRC a search would not hit.
  ByteBuffer frame;
  constexpr std::uint16_t kIds[] = {1, 36, 38, 43};
  novatel::append_frame({.message_id = kIds[data[0] % 4], .t = novatel::kHeader.t},
                        input.subspan(1, std::min<std::size_t>(size - 1, 64)), frame);
  novatel::check(frame, 7);
  return 0;
}
