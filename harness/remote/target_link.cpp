#include <orrery/harness/remote/target_link.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

namespace orrery {
namespace {

using Kind = TargetAddress::Kind;

std::int64_t host_now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

std::string system_error(int error) {
  return std::strerror(error);
}

[[noreturn]] void cannot_reach(const TargetAddress& address, const std::string& why) {
  throw TargetLost("cannot reach " + to_string(address) + ": " + why);
}

// The command, with the other end of a socket as its standard input and output.
int start(const TargetAddress& address, pid_t& child) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    cannot_reach(address, system_error(errno));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::string shell = "sh", option = "-c", command = "exec " + address.where;
  std::array<char*, 4> arguments{shell.data(), option.data(), command.data(), nullptr};
  const int error =
      posix_spawn(&child, "/bin/sh", &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (error != 0) {
    close(ends[0]);
    cannot_reach(address, system_error(error));
  }
  return ends[0];
}

// -1, and errno, where nobody listens yet.
int connect_once(int family, const sockaddr* to, socklen_t bytes) {
  const int fd = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0 || connect(fd, to, bytes) == 0) return fd;
  const int error = errno;
  close(fd);
  errno = error;
  return -1;
}

// A target may have been started a moment ago.
int connect_patiently(const TargetAddress& address, const sockaddr* to, socklen_t bytes,
                      Duration patience) {
  const std::int64_t deadline = host_now_ns() + patience.count();
  for (;;) {
    const int fd = connect_once(to->sa_family, to, bytes);
    if (fd >= 0) return fd;
    if (host_now_ns() > deadline) cannot_reach(address, system_error(errno));
    const timespec pause{.tv_sec = 0, .tv_nsec = 20'000'000};
    nanosleep(&pause, nullptr);
  }
}

int connect_unix(const TargetAddress& address, Duration patience) {
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  if (address.where.size() >= sizeof to.sun_path) cannot_reach(address, "its path is too long");
  address.where.copy(to.sun_path, address.where.size());
  return connect_patiently(address, reinterpret_cast<const sockaddr*>(&to), sizeof to, patience);
}

int connect_tcp(const TargetAddress& address, Duration patience) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int error =
      getaddrinfo(address.where.c_str(), std::to_string(address.port).c_str(), &hints, &found);
  if (error != 0) cannot_reach(address, gai_strerror(error));
  sockaddr_in to{};
  std::memcpy(&to, found->ai_addr, sizeof to);
  freeaddrinfo(found);
  const int fd =
      connect_patiently(address, reinterpret_cast<const sockaddr*>(&to), sizeof to, patience);
  const int yes = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return fd;
}

speed_t speed_of(const TargetAddress& address) {
  static constexpr struct {
    std::uint32_t baud;
    speed_t speed;
  } kSpeeds[] = {{9600, B9600},     {19200, B19200},   {38400, B38400},
                 {57600, B57600},   {115200, B115200}, {230400, B230400},
                 {460800, B460800}, {921600, B921600}, {1'000'000, B1000000}};
  for (const auto& [baud, speed] : kSpeeds) {
    if (baud == address.port) return speed;
  }
  cannot_reach(
      address,
      "the baud rate is one of 9600 19200 38400 57600 115200 230400 460800 921600 1000000");
}

int open_serial(const TargetAddress& address) {
  const int fd = open(address.where.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios line{};
  if (fd < 0 || tcgetattr(fd, &line) != 0) cannot_reach(address, system_error(errno));
  cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  if (cfsetspeed(&line, speed_of(address)) != 0 || tcsetattr(fd, TCSAFLUSH, &line) != 0) {
    cannot_reach(address, system_error(errno));
  }
  // Nobody is told that somebody has come: a target waits for ENQ, and drops the others, which end
  // what it still serves of before.
  const std::string enquiries(64, '\5');
  if (::write(fd, enquiries.data(), enquiries.size()) != static_cast<ssize_t>(enquiries.size())) {
    cannot_reach(address, system_error(errno));
  }
  return fd;
}

int reach(const TargetAddress& address, Duration patience, pid_t& child) {
  switch (address.kind) {
    case Kind::kExec:
      return start(address, child);
    case Kind::kUnix:
      return connect_unix(address, patience);
    case Kind::kTcp:
      return connect_tcp(address, patience);
    case Kind::kSerial:
      return open_serial(address);
    case Kind::kEmulator:
    case Kind::kHere:
      break;
  }
  throw std::invalid_argument("TargetLink: no target is named");
}

}  // namespace

TargetLink::TargetLink(const TargetAddress& address, Duration patience) : TargetLink(-1, patience) {
  fd_ = reach(address, patience, child_);
  fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
  begin_exchange();
}

TargetLink::TargetLink(int socket, Duration patience)
    : patience_(patience), fd_(socket), buffer_(64 * 1024) {
  if (patience <= Duration{0}) {
    throw std::invalid_argument("TargetLink: patience = " + to_string(patience) +
                                "; it is above 0");
  }
  if (socket < 0) return;
  fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
  begin_exchange();
}

TargetLink::~TargetLink() {
  if (fd_ >= 0) close(fd_);
  if (child_ < 0) return;
  kill(-child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
}

void TargetLink::begin_exchange() {
  deadline_ns_ = host_now_ns() + patience_.count();
}

// The other end is closed: of a child, how.
std::string TargetLink::how_it_ended() {
  if (child_ < 0) return "closed the link";
  int status = 0;
  // It closes its end a moment before it can be waited for.
  for (int i = 0; i < 100; ++i) {
    const pid_t waited = waitpid(child_, &status, WNOHANG);
    if (waited == child_) {
      child_ = -1;
      if (WIFSIGNALED(status)) {
        return "ended by signal " + std::to_string(WTERMSIG(status)) + " (" +
               strsignal(WTERMSIG(status)) + ")";
      }
      return "ended with exit status " + std::to_string(WEXITSTATUS(status));
    }
    const timespec pause{.tv_sec = 0, .tv_nsec = 5'000'000};
    nanosleep(&pause, nullptr);
  }
  return "closed the link";
}

void TargetLink::wait_for(short events) {
  for (;;) {
    const std::int64_t left_ns = deadline_ns_ - host_now_ns();
    if (left_ns <= 0)
      throw TargetLost("did not answer within " + to_string(patience_) + " of host time");
    pollfd wanted{.fd = fd_, .events = events, .revents = 0};
    const int ready = poll(&wanted, 1, static_cast<int>(left_ns / 1'000'000) + 1);
    if (ready > 0) return;
    if (ready < 0 && errno != EINTR)
      throw TargetLost("cannot be waited for: " + system_error(errno));
  }
}

void TargetLink::write(Bytes data) {
  while (!data.empty()) {
    // Without a signal where the other end is gone; a serial line takes no send().
    ssize_t sent = send(fd_, data.data(), data.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == ENOTSOCK) sent = ::write(fd_, data.data(), data.size());
    if (sent > 0) {
      data = data.subspan(static_cast<std::size_t>(sent));
    } else if (sent < 0 && errno == EAGAIN) {
      wait_for(POLLOUT);
    } else if (sent < 0 && errno != EINTR) {
      throw TargetLost(how_it_ended());
    }
  }
}

std::size_t TargetLink::receive(std::byte* to, std::size_t bytes) {
  for (;;) {
    const ssize_t got = ::read(fd_, to, bytes);
    if (got > 0) return static_cast<std::size_t>(got);
    if (got == 0 || (errno != EAGAIN && errno != EINTR)) throw TargetLost(how_it_ended());
    if (errno == EAGAIN) wait_for(POLLIN);
  }
}

void TargetLink::read(std::byte* to, std::size_t bytes) {
  while (bytes > 0) {
    if (begin_ == end_) {
      begin_ = 0;
      end_ = receive(buffer_.data(), buffer_.size());
    }
    const std::size_t taken = std::min(bytes, end_ - begin_);
    std::memcpy(to, buffer_.data() + begin_, taken);
    begin_ += taken;
    to += taken;
    bytes -= taken;
  }
}

}  // namespace orrery
