#include <orrery/harness/kernel/worker_thread.hpp>
#include <orrery/harness/remote/target_link.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <mutex>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <orrery_mailbox.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <termios.h>
#include <thread>
#include <unistd.h>
#include <utility>

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

struct Pipe {
  int read_end = -1, write_end = -1;
};

Pipe make_pipe(const TargetAddress& address) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) cannot_reach(address, system_error(errno));
  return {.read_end = ends[0], .write_end = ends[1]};
}

constexpr int kMailboxThere = 198;  // a descriptor that nobody else takes

// The command, with the pipes as its standard input and output: they cost half of what a socket
// does. The mailbox's descriptor or -1.
pid_t start(const TargetAddress& address, const Pipe& requests, const Pipe& answers, int mailbox) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, requests.read_end, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, answers.write_end, STDOUT_FILENO);
  if (mailbox >= 0) posix_spawn_file_actions_adddup2(&actions, mailbox, kMailboxThere);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::string shell = "sh", option = "-c", command = "exec " + address.where;
  if (mailbox >= 0) {
    command = "export ORRERY_MAILBOX=" + std::to_string(kMailboxThere) + "; " + command;
  }
  std::array<char*, 4> arguments{shell.data(), option.data(), command.data(), nullptr};
  pid_t child = -1;
  const int error =
      posix_spawn(&child, "/bin/sh", &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close(answers.write_end);
  return error == 0 ? child : -error;
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

int reach(const TargetAddress& address, Duration patience) {
  switch (address.kind) {
    case Kind::kUnix:
      return connect_unix(address, patience);
    case Kind::kTcp:
      return connect_tcp(address, patience);
    case Kind::kSerial:
      return open_serial(address);
    case Kind::kExec:
    case Kind::kEmulator:
    case Kind::kHere:
      break;
  }
  throw std::invalid_argument("TargetLink: no target is named");
}

}  // namespace

// A read() of a pipe has no time-out. This one writes a byte where it blocks for too long.
class TargetLink::Watch {
 public:
  /// Null where a pipe cannot be opened again (no /proc).
  static std::unique_ptr<Watch> over(int pipe, Duration patience) {
    const std::string path = "/proc/self/fd/" + std::to_string(pipe);
    const int fd = open_to_write(path);
    if (fd < 0) return nullptr;
    close(fd);
    return std::make_unique<Watch>(path, patience);
  }
  Watch(const std::string& path, Duration patience) : patience_(patience) {
    thread_ = worker_thread([this, path] { run(path); });
  }
  ~Watch() {
    if (getpid() != process_) {  // a fork has no other threads
      thread_.detach();
      return;
    }
    {
      const std::lock_guard lock(mutex_);
      ending_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// Of the read() that follows; 0: there is none.
  void set_deadline(std::int64_t host_ns) { deadline_ns_ = host_ns; }
  bool has_expired() const { return expired_; }

 private:
  static int open_to_write(const std::string& path) {
    return open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
  }
  void run(const std::string& path) {
    std::unique_lock lock(mutex_);
    while (!ending_) {
      const std::int64_t now_ns = host_now_ns(), deadline_ns = deadline_ns_;
      if (deadline_ns != 0 && deadline_ns <= now_ns) {
        expired_ = true;
        const int fd = open_to_write(path);
        if (fd >= 0 && ::write(fd, "", 1) <= 0) errno = 0;  // full: no read() blocks
        if (fd >= 0) close(fd);
        return;
      }
      const std::int64_t left_ns = deadline_ns != 0 ? deadline_ns - now_ns : patience_.count();
      wake_.wait_for(lock, std::chrono::nanoseconds(left_ns));
    }
  }

  Duration patience_;
  pid_t process_ = getpid();
  std::atomic<std::int64_t> deadline_ns_{0};
  std::atomic<bool> expired_{false};
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_ = false;
  std::thread thread_;
};

// The simulation's side of orrery_mailbox.h.
class TargetLink::Mailbox {
 public:
  /// Null where there is no memory to share.
  static std::unique_ptr<Mailbox> between(const Pipe& requests, const Pipe& answers) {
    auto made = std::make_unique<Mailbox>();
    struct stat in {
    }, out{};
    made->fd_ = memfd_create("orrery mailbox", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    // Sealed: were it cut short by the other side, looking at it would end this program.
    if (made->fd_ < 0 || ftruncate(made->fd_, sizeof(orrery_mailbox)) != 0 ||
        fcntl(made->fd_, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0 ||
        fstat(requests.read_end, &in) != 0 || fstat(answers.write_end, &out) != 0) {
      return nullptr;
    }
    void* mapped =
        mmap(nullptr, sizeof(orrery_mailbox), PROT_READ | PROT_WRITE, MAP_SHARED, made->fd_, 0);
    if (mapped == MAP_FAILED) return nullptr;
    made->box_ = static_cast<orrery_mailbox*>(mapped);
    made->box_->magic = ORRERY_MAILBOX_MAGIC;
    made->box_->request_pipe = in.st_ino;
    made->box_->answer_pipe = out.st_ino;
    made->box_->answers.state = ORRERY_MAILBOX_ASLEEP;  // HELLO takes the pipe
    return made;
  }
  Mailbox() = default;
  ~Mailbox() {
    passed_on();
    if (box_ != nullptr) munmap(box_, sizeof *box_);
  }
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;

  int descriptor() const { return fd_; }
  void passed_on() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }
  /// What the two have their core for.
  void begin_exchange(bool to_themselves) {
    constexpr std::uint32_t kYields = 8;  // more show that the other side takes longer than a turn
    yields_ = to_themselves ? kYields : 0;
    is_attached_ = __atomic_load_n(&box_->attached, __ATOMIC_ACQUIRE) == 1;
    __atomic_store_n(&box_->yields, yields_, __ATOMIC_RELAXED);
    writes_ = hears_ = true;
  }
  /// False: it has to take the pipe.
  bool put(Bytes data) {
    return std::exchange(writes_, false) && is_attached_ &&
           data.size() <= ORRERY_MAILBOX_SLOT_BYTES &&
           orrery_mailbox_put(&box_->requests, data.data(),
                              static_cast<std::uint32_t>(data.size())) != 0;
  }
  /// 0: it comes by the pipe.
  std::size_t take(std::byte* to, std::size_t bytes) {
    if (!std::exchange(hears_, false) || !is_attached_) return 0;
    const std::size_t there = orrery_mailbox_wait(&box_->answers, yields_);
    sleeps_ = there == 0;
    if (sleeps_) return 0;
    if (there > ORRERY_MAILBOX_SLOT_BYTES || there > bytes) {
      throw TargetLost("sent a mailbox that says it holds " + std::to_string(there) + " bytes");
    }
    std::memcpy(to, box_->answers.data, there);
    orrery_mailbox_empty(&box_->answers);
    return there;
  }
  void has_read_pipe() {
    if (std::exchange(sleeps_, false)) orrery_mailbox_empty(&box_->answers);
  }

 private:
  orrery_mailbox* box_ = nullptr;
  int fd_ = -1;
  std::uint32_t yields_ = 0;
  bool is_attached_ = false;
  bool sleeps_ = true;                   // at the pipe, and says so in the slot; for HELLO already
  bool writes_ = false, hears_ = false;  // the first bytes of a request, of an answer
};

TargetLink::TargetLink(const TargetAddress& address, Duration patience) : TargetLink(-1, patience) {
  if (address.kind != Kind::kExec) {
    listen_to(reach(address, patience));
    return;
  }
  const Pipe requests = make_pipe(address);
  out_ = requests.write_end;
  other_end_ = requests.read_end;
  const Pipe answers = make_pipe(address);
  in_ = answers.read_end;
  fcntl(out_, F_SETFL, fcntl(out_, F_GETFL) | O_NONBLOCK);
  core_ = SharedCore::of_this_thread();
  core_->hold();
  mailbox_ = Mailbox::between(requests, answers);
  const pid_t child =
      start(address, requests, answers, mailbox_ != nullptr ? mailbox_->descriptor() : -1);
  if (mailbox_ != nullptr) mailbox_->passed_on();
  if (child < 0) {
    core_->leave(-1);
    cannot_reach(address, system_error(-child));
  }
  child_ = child;
  core_->join(child_);
  watch_ = Watch::over(in_, patience);
  if (watch_ == nullptr) fcntl(in_, F_SETFL, fcntl(in_, F_GETFL) | O_NONBLOCK);
  begin_exchange();
}

TargetLink::TargetLink(int socket, Duration patience) : patience_(patience), buffer_(64 * 1024) {
  if (patience <= Duration{0}) {
    throw std::invalid_argument("TargetLink: patience = " + to_string(patience) +
                                "; it is above 0");
  }
  if (socket >= 0) listen_to(socket);
}

void TargetLink::listen_to(int fd) {
  in_ = out_ = fd;
  const timeval timeout{.tv_sec = patience_.count() / 1'000'000'000,
                        .tv_usec = patience_.count() % 1'000'000'000 / 1000 + 1};
  is_socket_ = setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout) == 0;
  if (!is_socket_) fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK);
  begin_exchange();
}

TargetLink::~TargetLink() {
  if (core_ != nullptr && child_ >= 0) core_->leave(child_);
  watch_.reset();
  for (const int fd : {in_, other_end_}) {
    if (fd >= 0) close(fd);
  }
  if (out_ >= 0 && out_ != in_) close(out_);
  if (child_ < 0) return;
  kill(-child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
}

void TargetLink::begin_exchange() {
  const std::int64_t now_ns = host_now_ns();
  deadline_ns_ = now_ns + patience_.count();
  may_block_ = true;
  if (core_ != nullptr) core_->take_turn(now_ns);
  if (mailbox_ != nullptr) mailbox_->begin_exchange(core_->has_to_itself(now_ns));
}

// The other end is closed: of a child, how.
std::string TargetLink::how_it_ended() {
  if (child_ < 0) return "closed the link";
  core_->leave(child_);
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

void TargetLink::give_up() const {
  throw TargetLost("did not answer within " + to_string(patience_) + " of host time");
}

void TargetLink::wait_for(short events) {
  may_block_ = false;
  for (;;) {
    const std::int64_t left_ns = deadline_ns_ - host_now_ns();
    if (left_ns <= 0) give_up();
    // Who reads no more shows by having closed what it writes to.
    pollfd wanted[] = {{.fd = events == POLLIN ? in_ : out_, .events = events, .revents = 0},
                       {.fd = in_, .events = 0, .revents = 0}};
    const int ready = poll(wanted, 2, static_cast<int>(left_ns / 1'000'000) + 1);
    if (ready > 0 && wanted[0].revents == 0) throw TargetLost(how_it_ended());
    if (ready > 0) return;
    if (ready < 0 && errno != EINTR)
      throw TargetLost("cannot be waited for: " + system_error(errno));
  }
}

void TargetLink::write(Bytes data) {
  if (mailbox_ != nullptr && mailbox_->put(data)) return;
  while (!data.empty()) {
    // Without a signal where the other end is gone, which pipe and serial line never are.
    const ssize_t sent = is_socket_
                             ? send(out_, data.data(), data.size(), MSG_NOSIGNAL | MSG_DONTWAIT)
                             : ::write(out_, data.data(), data.size());
    if (sent > 0) {
      data = data.subspan(static_cast<std::size_t>(sent));
    } else if (sent < 0 && errno == EAGAIN) {
      wait_for(POLLOUT);
    } else if (sent < 0 && errno != EINTR) {
      throw TargetLost(how_it_ended());
    }
  }
}

// What there is, 1 byte at least.
std::size_t TargetLink::receive(std::byte* to, std::size_t bytes) {
  if (mailbox_ != nullptr) {
    const std::size_t there = mailbox_->take(to, bytes);
    if (there > 0) return there;
  }
  for (;;) {
    ssize_t got = 0;
    if (watch_ != nullptr) {
      if (watch_->has_expired()) give_up();
      watch_->set_deadline(deadline_ns_);
      got = ::read(in_, to, bytes);
      watch_->set_deadline(0);
      if (watch_->has_expired()) give_up();
    } else if (is_socket_) {
      // The socket's time-out is that of a whole exchange, so the first wait alone may take it.
      got = recv(in_, to, bytes, std::exchange(may_block_, false) ? 0 : MSG_DONTWAIT);
    } else {
      got = ::read(in_, to, bytes);
    }
    if (got > 0) {
      if (mailbox_ != nullptr) mailbox_->has_read_pipe();
      return static_cast<std::size_t>(got);
    }
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
