/// A flight library on another processor, called over orrery_wire.h in lock step.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/remote/target_link.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace orrery {

/// What the target said of its library.
struct TargetHello {
  std::string name, version;
  struct Port {
    std::uint32_t id = 0;
    std::uint16_t direction = 0, kind = 0;
    std::string name;
    std::uint32_t max_bytes = 0;
  };
  std::vector<Port> ports;
  std::uint32_t largest_payload_bytes = 0;  // of a request
};

/// What one call answered; of the last call, until the next.
struct TargetAnswer {
  std::int32_t status = 0;
  std::int64_t pending_tick_ns = -1;  // onboard time; -1: none is pending
  bool asked_for_tick = false;        // by this call, or withdrew it
  struct Message {
    std::uint32_t number = 0;  // port, level or slot
    std::size_t begin = 0, bytes = 0;
  };
  std::vector<Message> outputs, logs, stores;  // each in order
  ByteBuffer data;                             // of all of them
  Bytes of(const Message& m) const { return Bytes(data).subspan(m.begin, m.bytes); }

  std::uint32_t cost_unit = 0;  // ORRERY_WU_: none, ns of the target's clock, instructions
  std::uint64_t cost = 0;
  // 0: not measured. Live now, most live within the call, the heap's size, its largest free block.
  std::uint64_t heap_now_bytes = 0, heap_peak_bytes = 0, heap_bytes = 0,
                heap_largest_free_bytes = 0;
};

/// Method     One request is open at a time; what comes before its DONE is kept and handed over
/// with
///            it, so that when bytes arrive decides nothing.
/// Trust      None: frames are checked (magic, version, CRC, sequence, type, sizes against the port
///            table and kMost_bytes), each exchange ends within `patience`, and the first breach
///            throws TargetLost; the object is of no more use.
/// Source     flight_sw/abi/orrery_wire.h
class RemoteFlight {
 public:
  /// Of all that one call may answer.
  static constexpr std::size_t kMost_bytes = std::size_t{64} << 20;
  static constexpr std::size_t kMostMessages = 1'000'000;

  /// Reaches the target and hears its HELLO.
  /// @throws TargetLost; std::invalid_argument  patience is not above 0.
  RemoteFlight(const TargetAddress& address, Duration patience);
  /// On a connected stream socket, which it closes; messages call it `name`.
  RemoteFlight(int socket, std::string name, Duration patience);

  const TargetHello& hello() const { return hello_; }
  /// Of the last call.
  const TargetAnswer& answer() const { return answer_; }

  struct Boot {
    std::string_view spacecraft, process;
    std::uint32_t boot_count = 0, reset_cause = 0;
    std::string_view config;
    std::uint32_t storage_bytes = 0;  // that all slots together may hold
    const std::vector<std::pair<std::uint32_t, ByteBuffer>>* slots = nullptr;
  };
  // The calls. @throws TargetLost
  const TargetAnswer& create(std::int64_t now_ns, const Boot& boot);
  const TargetAnswer& input(std::int64_t now_ns, std::uint32_t port, Bytes message);
  const TargetAnswer& tick(std::int64_t now_ns);
  const TargetAnswer& destroy(std::int64_t now_ns);

 private:
  struct Frame {
    std::uint16_t type = 0;
    std::uint32_t bytes = 0;
    std::int64_t time_ns = 0;
    std::int32_t code = 0;
  };
  const TargetAnswer& call(std::uint16_t type, std::int64_t now_ns, std::uint32_t code,
                           Bytes payload);
  void exchange(Bytes payload);
  Frame read_header();
  /// Appends to `to` what the frame carries.
  void read_payload(const Frame& frame, ByteBuffer& to);
  void read_hello();
  void take(const Frame& frame);
  void finish(const Frame& frame);
  const TargetHello::Port* output_port(std::uint32_t id) const;

  std::string address_;
  TargetLink link_;
  TargetHello hello_;
  TargetAnswer answer_;
  ByteBuffer request_, scratch_;
  std::uint32_t sequence_ = 0;
  std::uint32_t storage_bytes_ = 0;
};

}  // namespace orrery
