// The simulator's side of the wire: whatever a target sends, the call returns an answer within its
// bounds or throws TargetLost.
//
// The input's first byte says whether HELLO is sound. Then come frames: type, code, how it is
// damaged, length, payload.

#include <orrery/harness/remote/remote_flight.hpp>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <orrery_messages.h>
#include <orrery_wire.h>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

#include "fuzz_check.hpp"
#include "wire_bytes.hpp"

namespace orrery {
namespace {

void append_frame(Buffer& to, unsigned type, std::uint32_t sequence, std::uint32_t code,
                  unsigned damage, const std::uint8_t* payload, std::uint32_t bytes) {
  const std::size_t begin = to.size();
  append_u32(to, ORRERY_WIRE_MAGIC);
  append_u32(to, type | (damage == 1 ? 2u : ORRERY_ABI_VERSION) << 16);
  append_u32(to, sequence + (damage == 2 ? 1 : 0));
  append_u32(to, damage == 3 ? bytes * 77777u : bytes);
  append_u32(to, damage);
  append_u32(to, damage == 4 ? 0xFFFFFFFFu : 0);
  append_u32(to, code);
  append_u32(to, crc32(to.data() + begin, 28) + (damage == 5 ? 1 : 0));
  if (bytes == 0) return;
  to.insert(to.end(), payload, payload + bytes);
  append_u32(to, crc32(payload, bytes) + (damage == 6 ? 1 : 0));
}

// 4096 bytes, "f", "1", one output port 2 of 100 bytes.
constexpr std::uint8_t kHello[] = {0, 16, 0, 0, 1, 0, 'f', 1,   0, '1', 1, 0, 0, 0,  2,
                                   0, 0,  0, 1, 0, 0, 0,   100, 0, 0,   0, 1, 0, 'o'};

Buffer answers_of(const std::uint8_t* data, std::size_t size) {
  Buffer answers;
  std::uint32_t sequence = 0;
  if (size > 0 && *data++ % 4 != 0) {
    append_frame(answers, ORRERY_W_HELLO, 0, 0, 0, kHello, sizeof kHello);
    sequence = 1;
  }
  size -= size > 0 ? 1 : 0;
  while (size >= 4) {
    const auto length = static_cast<std::uint32_t>(std::min<std::size_t>(size - 4, data[3]));
    const unsigned type = ORRERY_W_HELLO + data[0] % 6;
    append_frame(answers, type, sequence, data[1], data[2] % 32, data + 4, length);
    if (type == ORRERY_W_DONE || type == ORRERY_W_HELLO) ++sequence;
    data += 4 + length;
    size -= 4 + length;
  }
  answers.insert(answers.end(), data, data + size);
  return answers;
}

void check(const TargetAnswer& answer) {
  for (const auto* messages : {&answer.outputs, &answer.logs, &answer.stores}) {
    for (const TargetAnswer::Message& m : *messages) {
      fuzz_check(m.begin + m.bytes <= answer.data.size(), "messages lie within the data");
    }
  }
  for (const TargetAnswer::Message& m : answer.outputs) {
    fuzz_check(m.bytes <= 100 || m.number != 2, "outputs keep to their port's size");
  }
  fuzz_check(answer.pending_tick_ns >= -1, "a tick is pending or not");
}

void fly(int socket) {
  using namespace std::chrono_literals;
  constexpr std::byte kMessage[3] = {};
  try {
    RemoteFlight target(socket, "fuzzed", 1s);
    check(target.create(0, {.spacecraft = "a", .process = "b", .storage_bytes = 50}));
    check(target.tick(1));
    check(target.input(2, 1, kMessage));
    check(target.destroy(3));
  } catch (const TargetLost& lost) {
    fuzz_check(std::strlen(lost.what()) > 10, "it says why");
  }
}

}  // namespace
}  // namespace orrery

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Buffer answers = orrery::answers_of(data, size);
  int ends[2];
  if (answers.size() > 60'000 || socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) return 0;
  orrery::fuzz_check(
      write(ends[1], answers.data(), answers.size()) == static_cast<ssize_t>(answers.size()),
      "the socket holds the answers");
  shutdown(ends[1], SHUT_WR);
  orrery::fly(ends[0]);
  close(ends[1]);
  return 0;
}
