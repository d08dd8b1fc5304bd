/* Serves a flight library over orrery_wire.h: on another processor, or in another process. Plain
 * C99, dlopen and sockets; nothing of the simulator. One client at a time, each with the library
 * loaded anew. */
#define _GNU_SOURCE
#define PROGRAM "orrery-flight-target"
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "orrery_flight_library.h"
#include "orrery_mailbox.h"
#include "orrery_wire.h"

static const char kUsage[] =
    "usage: orrery-flight-target LIBRARY.so [HOW] [--once]\n"
    "Serves the flight library to a simulation (--orrery_target=SPACECRAFT=...).\n"
    "HOW  --stdio                  standard input and output; the default\n"
    "     --unix PATH              listens on a Unix socket\n"
    "     --tcp [ADDRESS:]PORT     listens, on 127.0.0.1 unless given, and prints PORT; 0: any\n"
    "     --serial DEVICE:BAUD     a serial line, raw, 8N1\n"
    "--once                        ends after the first client\n"
    "--heap BYTES                  a simulated heap for flight code, where it is linked\n"
    "--no-clock                    no call is timed: an emulator's pace says nothing\n"
    "--instructions PAGE           cost as counted by harness/remote/instruction_count.c\n";

/* harness/heap/target_heap.cpp, where it is linked. */
__attribute__((weak)) void orrery_target_heap_open(uint32_t bytes);
__attribute__((weak)) void orrery_target_heap_enter(void);
__attribute__((weak)) void orrery_target_heap_leave(orrery_wire_cost* cost);

/* Of the counting plugin: instructions between the last two marks. Null: host time is the cost. */
static const volatile uint64_t* instructions;
static uint64_t instructions_of_marks;
static int is_timed = 1;

typedef struct connection {
  FILE* in; /* buffered: a request takes one read() */
  int out;
  uint64_t begin_ns;
  orrery_mailbox_target box;
} connection;

static int32_t read_all(void* context, void* buffer, uint32_t bytes) {
  connection* c = context;
  const int boxed = orrery_mailbox_read(&c->box, buffer, bytes);
  uint32_t at = 0;
  if (boxed != 0) return boxed > 0 ? 0 : -1;
  while ((at += (uint32_t)fread((char*)buffer + at, 1, bytes - at, c->in)) < bytes) {
    if (feof(c->in) || errno != EINTR) return -1;
    clearerr(c->in);
  }
  orrery_mailbox_has_read(&c->box);
  return 0;
}

static int32_t write_all(void* context, const void* data, uint32_t bytes) {
  connection* c = context;
  uint32_t at = orrery_mailbox_write(&c->box, data, bytes) ? bytes : 0;
  while (at < bytes) {
    const ssize_t n = write(c->out, (const char*)data + at, bytes - at);
    if (n == 0 || (n < 0 && errno != EINTR)) return -1;
    if (n > 0) at += (uint32_t)n;
  }
  return 0;
}

/* A system call that does nothing, where the plugin looks at its counter. */
static void mark(size_t which) {
  static const char kNothing[2];
  const int error = errno;
  if (write(-20306, kNothing, which) >= 0) abort();
  errno = error;
}

static void count_instructions(const char* page) {
  const void* mapped = mmap(NULL, 16, PROT_READ, MAP_SHARED, atoi(page), 0);
  if (mapped == MAP_FAILED) fail("nobody counts instructions at descriptor", page);
  instructions = mapped;
  mark(1), mark(2), mark(1), mark(2); /* write() is resolved by then */
  instructions_of_marks = *instructions;
}

static uint64_t host_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static void call_begins(void* context) {
  if (orrery_target_heap_enter != NULL) orrery_target_heap_enter();
  if (is_timed) ((connection*)context)->begin_ns = host_now_ns();
  if (instructions != NULL) mark(1);
}

/* Host time is for reports alone; instructions repeat, so simulated time may depend on them. */
static void call_ended(void* context, orrery_wire_cost* cost) {
  if (instructions != NULL) mark(2);
  if (instructions != NULL) {
    cost->unit = ORRERY_WU_INSTRUCTIONS;
    cost->cost = *instructions - instructions_of_marks;
  } else if (is_timed) {
    cost->unit = ORRERY_WU_NS;
    cost->cost = host_now_ns() - ((connection*)context)->begin_ns;
  }
  if (orrery_target_heap_leave != NULL) orrery_target_heap_leave(cost);
}

/* The library is not closed: a client that goes away leaves one that no destroy has ended. */
static int serve(const char* path, int in, int out) {
  static uint64_t work[1 << 20];
  connection c = {.in = fdopen(in, "r"), .out = out, .box.box = orrery_mailbox_attach(in, out)};
  const orrery_wire_link link = {&c, read_all, write_all, call_begins, call_ended};
  void* library;
  const orrery_flight* flight = open_flight_library(path, &library);
  if (c.in == NULL) fail("cannot read what is connected", strerror(errno));
  return orrery_wire_serve(&link, flight, work, sizeof work) == ORRERY_OK ? 0 : 1;
}

/* What flight code prints must not get between the frames. */
static int serve_stdio(const char* path) {
  const int in = dup(STDIN_FILENO), out = dup(STDOUT_FILENO), none = open("/dev/null", O_RDONLY);
  if (in < 0 || out < 0 || none < 0) fail("standard input or output", strerror(errno));
  dup2(none, STDIN_FILENO);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  return serve(path, in, out);
}

/* Its library starts as it was linked, and a crash ends that process alone. */
static int serve_in_child(const char* path, int fd, int listener) {
  int status = 0;
  const pid_t child = fork();
  if (child < 0) fail("fork", strerror(errno));
  if (child == 0) {
    if (listener >= 0) close(listener);
    exit(serve(path, fd, fd));
  }
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFSIGNALED(status)) {
    fprintf(stderr, PROGRAM ": flight code ended by signal %d (%s)\n", WTERMSIG(status),
            strsignal(WTERMSIG(status)));
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

/* Nobody connects to a line: who is there sends ENQ, and more of them, which are dropped. */
static int serve_serial(const char* path, char* device, int once) {
  struct termios line;
  char* baud = strrchr(device, ':');
  unsigned char heard;
  int fd, status;
  if (baud == NULL) fail("--serial takes DEVICE:BAUD, not", device);
  *baud++ = '\0';
  fd = open(device, O_RDWR | O_NOCTTY);
  if (fd < 0 || tcgetattr(fd, &line) != 0) fail(device, strerror(errno));
  cfmakeraw(&line);
  line.c_cflag |= CLOCAL | CREAD;
  /* glibc takes the number, not its code alone */
  if (cfsetspeed(&line, (speed_t)strtoul(baud, NULL, 10)) != 0) fail("not a baud rate", baud);
  if (tcsetattr(fd, TCSANOW, &line) != 0) fail(device, strerror(errno));
  do {
    for (heard = 0; heard != 5;) {
      const ssize_t n = read(fd, &heard, 1);
      if (n == 0 || (n < 0 && errno != EINTR)) fail(device, "cannot be read");
    }
    usleep(200000);
    tcflush(fd, TCIFLUSH);
    status = serve_in_child(path, fd, -1);
  } while (!once);
  return status;
}

static int listen_at(int family, struct sockaddr* address, socklen_t bytes) {
  const int fd = socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0), yes = 1;
  if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      bind(fd, address, bytes) != 0 || listen(fd, 1) != 0) {
    fail("cannot listen", strerror(errno));
  }
  return fd;
}

static int listen_unix(const char* path) {
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  if (strlen(path) >= sizeof address.sun_path) fail("the path of a Unix socket is too long", path);
  strcpy(address.sun_path, path);
  unlink(path);
  return listen_at(AF_UNIX, (struct sockaddr*)&address, sizeof address);
}

static int listen_tcp(char* where) {
  struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
  socklen_t bytes = sizeof address;
  char *colon = strrchr(where, ':'), *end = NULL;
  const char* digits = colon == NULL ? where : colon + 1;
  const long port = strtol(digits, &end, 10);
  int fd;
  if (*digits == '\0' || *end != '\0' || port < 0 || port > 65535) {
    fail("--tcp takes [ADDRESS:]PORT with a port of 0 to 65535, not", where);
  }
  if (colon != NULL) *colon = '\0';
  if (colon != NULL && inet_pton(AF_INET, where, &address.sin_addr) != 1) {
    fail("not an IPv4 address", where);
  }
  address.sin_port = htons((uint16_t)port);
  fd = listen_at(AF_INET, (struct sockaddr*)&address, bytes);
  getsockname(fd, (struct sockaddr*)&address, &bytes);
  fprintf(stderr, PROGRAM ": listens on port %d\n", ntohs(address.sin_port));
  return fd;
}

static int serve_listener(const char* path, int listener, int once) {
  int status = 0;
  do {
    const int yes = 1, fd = accept4(listener, NULL, NULL, SOCK_CLOEXEC);
    if (fd < 0 && errno == EINTR) continue;
    if (fd < 0) fail("accept", strerror(errno));
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes); /* fails on a Unix socket */
    status = serve_in_child(path, fd, listener);
    close(fd);
  } while (!once);
  return status;
}

int main(int argc, char** argv) {
  const char *path = NULL, *how = "--stdio";
  char* where = NULL;
  int once = 0, wrong = 0, i;
  for (i = 1; i < argc; ++i) {
    const char* option = argv[i];
    if (strcmp(option, "--once") == 0) {
      once = 1;
    } else if (strcmp(option, "--no-clock") == 0) {
      is_timed = 0;
    } else if (strcmp(option, "--stdio") == 0) {
      how = option;
    } else if (option[0] != '-') {
      wrong |= path != NULL;
      path = option;
    } else if (i + 1 == argc) {
      wrong = 1;
    } else if (strcmp(option, "--instructions") == 0) {
      count_instructions(argv[++i]);
    } else if (strcmp(option, "--heap") == 0) {
      if (orrery_target_heap_open == NULL) fail("no simulated heap is linked, so no", option);
      orrery_target_heap_open((uint32_t)strtoul(argv[++i], NULL, 10));
    } else {
      how = option;
      where = argv[++i];
    }
  }
  signal(SIGPIPE, SIG_IGN);
  if (path != NULL && !wrong) {
    if (strcmp(how, "--stdio") == 0) return serve_stdio(path);
    if (strcmp(how, "--serial") == 0) return serve_serial(path, where, once);
    if (strcmp(how, "--unix") == 0) return serve_listener(path, listen_unix(where), once);
    if (strcmp(how, "--tcp") == 0) return serve_listener(path, listen_tcp(where), once);
  }
  fputs(kUsage, stderr);
  return 2;
}
