#include <orrery/harness/remote/remote_flight.hpp>

#include <cstring>
#include <orrery_crc32_sliced.h>
#include <orrery_messages.h>
#include <orrery_wire.h>

namespace orrery {
namespace {

unsigned char* raw(std::byte* at) {
  return reinterpret_cast<unsigned char*>(at);
}
const unsigned char* raw(const std::byte* at) {
  return reinterpret_cast<const unsigned char*>(at);
}
std::uint16_t get_u16(const unsigned char* at) {
  return static_cast<std::uint16_t>(at[0] | at[1] << 8);
}
std::uint64_t get_u64(const unsigned char* at) {
  return orrery_get_u32(at) | std::uint64_t{orrery_get_u32(at + 4)} << 32;
}
void append(ByteBuffer& to, const void* data, std::size_t bytes) {
  const auto* begin = static_cast<const std::byte*>(data);
  to.insert(to.end(), begin, begin + bytes);
}
void append_u16(ByteBuffer& to, std::uint16_t value) {
  to.push_back(static_cast<std::byte>(value & 255));
  to.push_back(static_cast<std::byte>(value >> 8));
}
void append_u32(ByteBuffer& to, std::uint32_t value) {
  append_u16(to, static_cast<std::uint16_t>(value & 0xffff));
  append_u16(to, static_cast<std::uint16_t>(value >> 16));
}
void append_field(ByteBuffer& to, std::uint16_t tag, std::size_t bytes) {
  append_u16(to, tag);
  append_u32(to, static_cast<std::uint32_t>(bytes));
}
void append_text(ByteBuffer& to, std::uint16_t tag, std::string_view text) {
  append_field(to, tag, text.size());
  append(to, text.data(), text.size());
}
void append_number(ByteBuffer& to, std::uint16_t tag, std::uint32_t value) {
  append_field(to, tag, 4);
  append_u32(to, value);
}

std::uint32_t crc32(const unsigned char* data, std::size_t bytes) {
  static const orrery_crc32_tables tables = [] {
    orrery_crc32_tables filled;
    orrery_crc32_fill(&filled);
    return filled;
  }();
  return orrery_crc32_sliced(&tables, data, bytes);
}

[[noreturn]] void breach(const std::string& what) {
  throw TargetLost("sent " + what);
}

// Says of which target it is that is lost.
template <class Exchange>
void naming(const std::string& address, const Exchange& exchange) {
  try {
    exchange();
  } catch (const TargetLost& lost) {
    throw TargetLost(address + " " + lost.what());
  }
}

// Reads a HELLO's payload, whatever it holds.
class Reader {
 public:
  explicit Reader(Bytes data) : data_(data) {}
  std::uint16_t u16() { return get_u16(raw(take(2))); }
  std::uint32_t u32() { return orrery_get_u32(raw(take(4))); }
  std::string text() {
    const std::size_t bytes = u16();
    const std::byte* begin = take(bytes);
    return {reinterpret_cast<const char*>(begin), bytes};
  }
  bool at_end() const { return at_ == data_.size(); }

 private:
  const std::byte* take(std::size_t bytes) {
    if (bytes > data_.size() - at_) breach("a HELLO that ends too early");
    at_ += bytes;
    return data_.data() + at_ - bytes;
  }
  Bytes data_;
  std::size_t at_ = 0;
};

}  // namespace

RemoteFlight::RemoteFlight(const TargetAddress& address, Duration patience)
    : address_(to_string(address)), link_(address, patience) {
  naming(address_, [this] { read_hello(); });
}

RemoteFlight::RemoteFlight(int socket, std::string name, Duration patience)
    : address_(std::move(name)), link_(socket, patience) {
  naming(address_, [this] { read_hello(); });
}

RemoteFlight::Frame RemoteFlight::read_header() {
  std::byte header[ORRERY_WIRE_HEADER_BYTES];
  link_.read(header, sizeof header);
  const unsigned char* h = raw(header);
  if (orrery_get_u32(h) != ORRERY_WIRE_MAGIC) breach("bytes that begin no frame");
  if (orrery_get_u32(h + 28) != crc32(h, 28)) breach("a header whose CRC is wrong");
  if (get_u16(h + 6) != ORRERY_ABI_VERSION) {
    breach("frames of ABI version " + std::to_string(get_u16(h + 6)) + "; this program speaks " +
           std::to_string(ORRERY_ABI_VERSION));
  }
  if (orrery_get_u32(h + 8) != sequence_) {
    breach("an answer to request " + std::to_string(orrery_get_u32(h + 8)) + " where " +
           std::to_string(sequence_) + " is open");
  }
  return {.type = get_u16(h + 4),
          .bytes = orrery_get_u32(h + 12),
          .time_ns = orrery_get_i64(h + 16),
          .code = static_cast<std::int32_t>(orrery_get_u32(h + 24))};
}

void RemoteFlight::read_payload(const Frame& frame, ByteBuffer& to) {
  if (frame.bytes == 0) return;
  const std::size_t begin = to.size();
  to.resize(begin + frame.bytes);
  link_.read(to.data() + begin, frame.bytes);
  std::byte crc[4];
  link_.read(crc, sizeof crc);
  if (orrery_get_u32(raw(crc)) != crc32(raw(to.data() + begin), frame.bytes)) {
    breach("a payload whose CRC is wrong");
  }
}

void RemoteFlight::read_hello() {
  constexpr std::uint32_t kMostHello_bytes = 1 << 20;
  const Frame frame = read_header();
  if (frame.type != ORRERY_W_HELLO) breach("frame " + std::to_string(frame.type) + " for HELLO");
  if (frame.bytes > kMostHello_bytes)
    breach("a HELLO of " + std::to_string(frame.bytes) + " bytes");
  scratch_.clear();
  read_payload(frame, scratch_);
  Reader reader(scratch_);
  hello_.largest_payload_bytes = reader.u32();
  hello_.name = reader.text();
  hello_.version = reader.text();
  // One by one: how many it claims is no measure of how many there are.
  for (std::uint32_t ports = reader.u32(); ports > 0; --ports) {
    TargetHello::Port port;
    port.id = reader.u32();
    port.direction = reader.u16();
    port.kind = reader.u16();
    port.max_bytes = reader.u32();
    port.name = reader.text();
    hello_.ports.push_back(std::move(port));
  }
  if (!reader.at_end()) breach("a HELLO that goes on behind its ports");
}

const TargetAnswer& RemoteFlight::create(std::int64_t now_ns, const Boot& boot) {
  storage_bytes_ = boot.storage_bytes;
  ByteBuffer fields;
  append_text(fields, ORRERY_WT_SPACECRAFT, boot.spacecraft);
  append_text(fields, ORRERY_WT_PROCESS, boot.process);
  append_number(fields, ORRERY_WT_BOOT_COUNT, boot.boot_count);
  append_text(fields, ORRERY_WT_CONFIG, boot.config);
  append_number(fields, ORRERY_WT_STORAGE, boot.storage_bytes);
  if (boot.slots != nullptr) {
    for (const auto& [slot, content] : *boot.slots) {
      append_field(fields, ORRERY_WT_SLOT, 4 + content.size());
      append_u32(fields, slot);
      append(fields, content.data(), content.size());
    }
  }
  return call(ORRERY_W_CREATE, now_ns, boot.reset_cause, fields);
}

const TargetAnswer& RemoteFlight::input(std::int64_t now_ns, std::uint32_t port, Bytes message) {
  return call(ORRERY_W_INPUT, now_ns, port, message);
}
const TargetAnswer& RemoteFlight::tick(std::int64_t now_ns) {
  return call(ORRERY_W_TICK, now_ns, 0, {});
}
const TargetAnswer& RemoteFlight::destroy(std::int64_t now_ns) {
  return call(ORRERY_W_DESTROY, now_ns, 0, {});
}

const TargetAnswer& RemoteFlight::call(std::uint16_t type, std::int64_t now_ns, std::uint32_t code,
                                       Bytes payload) {
  ++sequence_;
  request_.resize(ORRERY_WIRE_HEADER_BYTES);
  unsigned char* h = raw(request_.data());
  orrery_put_u32(h, ORRERY_WIRE_MAGIC);
  orrery_put_u32(h + 4, type | ORRERY_ABI_VERSION << 16);
  orrery_put_u32(h + 8, sequence_);
  orrery_put_u32(h + 12, static_cast<std::uint32_t>(payload.size()));
  orrery_put_i64(h + 16, now_ns);
  orrery_put_u32(h + 24, code);
  orrery_put_u32(h + 28, crc32(h, 28));
  if (!payload.empty()) {
    append(request_, payload.data(), payload.size());
    append_u32(request_, crc32(raw(payload.data()), payload.size()));
  }
  naming(address_, [&] { exchange(payload); });
  return answer_;
}

// The request, and all that comes up to its DONE.
void RemoteFlight::exchange(Bytes payload) {
  if (payload.size() > hello_.largest_payload_bytes) {
    throw TargetLost("takes requests of " + std::to_string(hello_.largest_payload_bytes) +
                     " bytes; this one has " + std::to_string(payload.size()));
  }
  link_.begin_exchange();
  link_.write(request_);
  answer_.outputs.clear();
  answer_.logs.clear();
  answer_.stores.clear();
  answer_.data.clear();
  for (;;) {
    const Frame frame = read_header();
    if (frame.type == ORRERY_W_DONE) {
      finish(frame);
      return;
    }
    take(frame);
  }
}

const TargetHello::Port* RemoteFlight::output_port(std::uint32_t id) const {
  for (const TargetHello::Port& port : hello_.ports) {
    if (port.direction == ORRERY_OUT && port.id == id) return &port;
  }
  return nullptr;
}

void RemoteFlight::take(const Frame& frame) {
  constexpr std::uint32_t kMostLog_bytes = 1000;
  const std::uint32_t number = static_cast<std::uint32_t>(frame.code);
  std::vector<TargetAnswer::Message>* messages = nullptr;
  std::uint32_t most = 0;
  if (frame.type == ORRERY_W_OUTPUT) {
    const TargetHello::Port* port = output_port(number);
    if (port == nullptr)
      breach("a message on output port " + std::to_string(number) +
             ", which its port table has not");
    messages = &answer_.outputs;
    most = port->max_bytes;
  } else if (frame.type == ORRERY_W_LOG) {
    messages = &answer_.logs;
    most = kMostLog_bytes;
  } else if (frame.type == ORRERY_W_NV_STORE) {
    messages = &answer_.stores;
    most = storage_bytes_;
  } else {
    breach("frame " + std::to_string(frame.type) + " before DONE");
  }
  if (frame.bytes > most) {
    breach(std::to_string(frame.bytes) + " bytes where " + std::to_string(most) +
           " are allowed (frame " + std::to_string(frame.type) + ", number " +
           std::to_string(number) + ")");
  }
  const std::size_t messages_so_far =
      answer_.outputs.size() + answer_.logs.size() + answer_.stores.size();
  if (answer_.data.size() + frame.bytes > kMost_bytes || messages_so_far == kMostMessages) {
    breach("more than " + std::to_string(kMost_bytes) + " bytes or " +
           std::to_string(kMostMessages) + " messages in one call");
  }
  messages->push_back({number, answer_.data.size(), frame.bytes});
  read_payload(frame, answer_.data);
}

void RemoteFlight::finish(const Frame& frame) {
  if (frame.bytes != ORRERY_WIRE_DONE_BYTES) {
    breach("a DONE of " + std::to_string(frame.bytes) + " bytes; it has " +
           std::to_string(ORRERY_WIRE_DONE_BYTES));
  }
  scratch_.clear();
  read_payload(frame, scratch_);
  const unsigned char* p = raw(scratch_.data());
  answer_.status = frame.code;
  answer_.pending_tick_ns = frame.time_ns < 0 ? -1 : frame.time_ns;
  answer_.asked_for_tick = orrery_get_u32(p + 28) != 0;
  answer_.cost_unit = orrery_get_u32(p);
  answer_.cost = get_u64(p + 4);
  answer_.heap_now_bytes = get_u64(p + 12);
  answer_.heap_peak_bytes = get_u64(p + 20);
  answer_.heap_bytes = get_u64(p + 32);
  answer_.heap_largest_free_bytes = get_u64(p + 40);
  if (answer_.cost_unit > ORRERY_WU_INSTRUCTIONS) {
    breach("a cost in unit " + std::to_string(answer_.cost_unit) + "; units are 0 to 2");
  }
}

}  // namespace orrery
