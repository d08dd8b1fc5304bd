/// Bytes to and from a target, each wait with an end.
#pragma once

#include <orrery/harness/kernel/bytes.hpp>
#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/remote/shared_core.hpp>
#include <orrery/harness/remote/target_address.hpp>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <sys/types.h>

namespace orrery {

/// The link to a target broke, or the target sent what it may not: nothing more is to be had of it.
class TargetLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Method     A wait costs one system call on each side: read() blocks, and gives up by the
/// socket's
///            timeout or, on the pipes to a command, by a thread that sleeps until the exchange
///            must have ended.
/// Memory     A command that knows how (orrery_mailbox.h) is also asked and answers through memory
///            that both see, while they have their core to themselves: to let the other one run
///            costs less than a pipe then, and with a third it would cost milliseconds.
/// One core   The two take turns: a command runs on the core of the thread that calls it
///            (SharedCore), unless it sets its affinity itself (taskset).
/// Host time is read to give up only; no result of a run depends on it.
class TargetLink {
 public:
  /// Starts the command, or connects, waiting for the target for at most `patience`.
  /// @throws TargetLost
  TargetLink(const TargetAddress& address, Duration patience);
  /// On a connected stream socket, which it closes.
  TargetLink(int socket, Duration patience);
  /// Ends what it started, by SIGKILL to its process group.
  ~TargetLink();
  TargetLink(const TargetLink&) = delete;
  TargetLink& operator=(const TargetLink&) = delete;

  /// All of it. @throws TargetLost  past `patience`, or where the other side is gone
  void write(Bytes data);
  void read(std::byte* to, std::size_t bytes);
  /// From here on read() and write() together take at most `patience`.
  void begin_exchange();

 private:
  class Watch;
  class Mailbox;
  void listen_to(int socket);
  void wait_for(short events);
  std::size_t receive(std::byte* to, std::size_t bytes);
  [[noreturn]] void give_up() const;
  std::string how_it_ended();

  Duration patience_;
  std::int64_t deadline_ns_ = 0;
  int in_ = -1, out_ = -1;  // one and the same, but for a command
  int other_end_ = -1;      // of out_, held open: no SIGPIPE where a command has ended
  bool is_socket_ = false;
  bool may_block_ = false;  // the next wait ends at deadline_ns_ by itself
  pid_t child_ = -1;        // -1: none was started
  std::unique_ptr<Watch> watch_;
  std::unique_ptr<Mailbox> mailbox_;  // of a command
  std::shared_ptr<SharedCore> core_;  // of a command
  ByteBuffer buffer_;
  std::size_t begin_ = 0, end_ = 0;  // unread part of the buffer
};

}  // namespace orrery
