// The target's side of the wire: whatever comes over the link, it is served or refused, no memory
// but work[] is touched, and every answer is a sequence of sound frames that ends with DONE.
//
// The input is a list of requests. One byte says which call, one how the frame is damaged, two its
// length; what follows is the payload.

#include <algorithm>
#include <cstring>
#include <memory>
#include <orrery_wire.h>
#include <vector>

#include "fuzz_check.hpp"
#include "wire_bytes.hpp"

namespace {

using orrery::fuzz_check;

struct Wire {
  Buffer requests;
  std::size_t at = 0;
  Buffer answers;
};

// A library that stores, loads and echoes what it is told, and returns its size.
const orrery_host* the_host = nullptr;

std::int32_t exercise(const void* data, std::uint32_t bytes) {
  unsigned char buffer[64];
  const auto* text = static_cast<const unsigned char*>(data);
  if (bytes == 0) return ORRERY_REJECTED;
  const std::uint32_t slot = text[0] % 5;
  the_host->nv_store(the_host->context, slot, data, bytes);
  const std::int32_t loaded = the_host->nv_load(the_host->context, slot, buffer, sizeof buffer);
  fuzz_check(loaded <= static_cast<std::int32_t>(sizeof buffer), "no more is loaded than fits");
  the_host->output(the_host->context, text[0], data, bytes);
  the_host->request_tick(the_host->context, text[0] - 10);
  the_host->log(the_host->context, text[0], "line");
  return static_cast<std::int32_t>(bytes);
}

std::int32_t create(void** self, const orrery_host* host, const orrery_boot* boot) {
  the_host = host;
  *self = nullptr;
  fuzz_check(std::strlen(boot->spacecraft) < 1'000'000, "texts end");
  fuzz_check(std::strlen(boot->process) < 1'000'000, "texts end");
  return exercise(boot->config, boot->config_bytes);
}
std::int32_t input(void*, std::int64_t, std::uint32_t, const void* data, std::uint32_t bytes) {
  fuzz_check(reinterpret_cast<std::uintptr_t>(data) % 8 == 0, "inputs are aligned");
  return exercise(data, bytes);
}
std::int32_t tick(void*, std::int64_t) {
  return exercise("tick", 4);
}
void destroy(void*) {
  exercise("last", 4);
}

const orrery_port kPorts[] = {{1, ORRERY_IN, ORRERY_PACKET, "in", 100},
                              {2, ORRERY_OUT, ORRERY_PACKET, "out", 100}};
const orrery_flight kFlight = {sizeof(orrery_flight),
                               ORRERY_ABI_VERSION,
                               "fuzzed",
                               "1",
                               kPorts,
                               2,
                               create,
                               input,
                               tick,
                               destroy};

std::int32_t read(void* context, void* buffer, std::uint32_t bytes) {
  Wire& wire = *static_cast<Wire*>(context);
  if (bytes > wire.requests.size() - wire.at) return -1;
  std::memcpy(buffer, wire.requests.data() + wire.at, bytes);
  wire.at += bytes;
  return 0;
}
std::int32_t write(void* context, const void* data, std::uint32_t bytes) {
  Wire& wire = *static_cast<Wire*>(context);
  const auto* begin = static_cast<const unsigned char*>(data);
  wire.answers.insert(wire.answers.end(), begin, begin + bytes);
  return 0;
}

void append_request(Buffer& to, std::uint32_t sequence, unsigned type, unsigned damage,
                    const std::uint8_t* payload, std::uint32_t bytes) {
  const std::size_t begin = to.size();
  append_u32(to, ORRERY_WIRE_MAGIC);
  append_u32(to, type | ORRERY_ABI_VERSION << 16);
  append_u32(to, sequence + (damage == 1 ? 1 : 0));
  append_u32(to, damage == 2 ? bytes * 77777u : bytes);
  append_u32(to, damage);
  append_u32(to, damage == 3 ? 0xFFFFFFFFu : 0);
  append_u32(to, type == ORRERY_W_INPUT ? 1 : 0);
  append_u32(to, crc32(to.data() + begin, 28) + (damage == 4 ? 1 : 0));
  if (bytes == 0) return;
  to.insert(to.end(), payload, payload + bytes);
  append_u32(to, crc32(payload, bytes) + (damage == 5 ? 1 : 0));
}

Buffer requests_of(const std::uint8_t* data, std::size_t size) {
  Buffer requests;
  for (std::uint32_t sequence = 1; size >= 4; ++sequence) {
    const auto length =
        static_cast<std::uint32_t>(std::min<std::size_t>(size - 4, data[2] | (data[3] & 15u) << 8));
    append_request(requests, sequence, data[0] % 6, data[1] % 64, data + 4, length);
    data += 4 + length;
    size -= 4 + length;
  }
  requests.insert(requests.end(), data, data + size);
  return requests;
}

void check_answers(const Buffer& answers) {
  std::size_t at = 0;
  unsigned last = 0;
  while (at < answers.size()) {
    fuzz_check(answers.size() - at >= 32, "whole headers");
    const unsigned char* header = answers.data() + at;
    const std::uint32_t bytes = orrery_get_u32(header + 12);
    last = header[4];
    fuzz_check(orrery_get_u32(header) == ORRERY_WIRE_MAGIC, "frames begin as frames do");
    fuzz_check(orrery_get_u32(header + 28) == crc32(header, 28), "headers hold");
    fuzz_check(last >= ORRERY_W_HELLO && last <= ORRERY_W_DONE, "answers are answers");
    at += 32;
    if (bytes == 0) continue;
    fuzz_check(answers.size() - at >= bytes + 4u, "whole payloads");
    fuzz_check(orrery_get_u32(answers.data() + at + bytes) == crc32(answers.data() + at, bytes),
               "payloads hold");
    at += bytes + 4u;
  }
  fuzz_check(last == ORRERY_W_DONE || last == ORRERY_W_HELLO, "each call ends with DONE");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint32_t kWork_bytes = ORRERY_WIRE_WORK_BYTES + 4096;
  const std::unique_ptr<unsigned char[]> work(new unsigned char[kWork_bytes]);  // to its last byte
  Wire wire{.requests = requests_of(data, size)};
  const orrery_wire_link link = {&wire, read, write, nullptr, nullptr};
  const std::int32_t status = orrery_wire_serve(&link, &kFlight, work.get(), kWork_bytes);
  fuzz_check(status == ORRERY_OK || status == ORRERY_REJECTED, "it ends as the header says");
  check_answers(wire.answers);
  return 0;
}
