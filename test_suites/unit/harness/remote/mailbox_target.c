/* A command that echoes through orrery_mailbox.h and its pipes, as orrery-flight-target does, and
 * at the third request misbehaves in one way: `mailbox_target WAY`. A request is u32 bytes, then
 * those; its answer u32 requests that came through memory so far, then the same bytes. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdio.h>
#include <unistd.h>

#include "orrery_mailbox.h"
#include "orrery_messages.h"

static orrery_mailbox_target box;

/* All of it, or the end. */
static void receive(unsigned char* to, uint32_t bytes) {
  const int boxed = orrery_mailbox_read(&box, to, bytes);
  if (boxed < 0) exit(8);
  if (boxed > 0) return;
  while (bytes > 0) {
    const ssize_t n = read(STDIN_FILENO, to, bytes);
    if (n <= 0) exit(9);
    to += n;
    bytes -= (uint32_t)n;
  }
  orrery_mailbox_has_read(&box);
}

static void send_all(const unsigned char* data, uint32_t bytes) {
  if (orrery_mailbox_write(&box, data, bytes)) return;
  while (bytes > 0) {
    const ssize_t n = write(STDOUT_FILENO, data, bytes);
    if (n <= 0) exit(9);
    data += n;
    bytes -= (uint32_t)n;
  }
}

static void misbehave(const char* way) {
  if (strcmp(way, "killed") == 0) raise(SIGKILL);
  if (strcmp(way, "exits") == 0) exit(3);
  if (strcmp(way, "stopped") == 0) raise(SIGSTOP);
  if (strcmp(way, "silent") == 0) sleep(1000);
  /* It is sealed. */
  if (strcmp(way, "cuts") == 0 && ftruncate(atoi(getenv("ORRERY_MAILBOX")), 0) == 0) exit(7);
  if (strcmp(way, "forgets") == 0) box.box->answers.state = ORRERY_MAILBOX_ASLEEP;
}

/* Between two parts of an answer, when the first has been read. */
static void spoil(const char* way) {
  if (strcmp(way, "lies") != 0 && strcmp(way, "scribbles") != 0) return;
  while (__atomic_load_n(&box.box->answers.state, __ATOMIC_ACQUIRE) != ORRERY_MAILBOX_EMPTY)
    sched_yield();
  if (strcmp(way, "lies") == 0) box.box->answers.state = ORRERY_MAILBOX_SLOT_BYTES + 1;
  if (strcmp(way, "scribbles") == 0) memset(box.box, 0xA5, sizeof *box.box);
}

int main(int argc, char** argv) {
  static unsigned char message[1 << 20];
  uint32_t boxed = 0, bytes, count;
  box.box = orrery_mailbox_attach(STDIN_FILENO, STDOUT_FILENO);
  send_all((const unsigned char*)(box.box != NULL ? "m" : "p"), 1); /* memory, or pipes alone */
  for (count = 1;; ++count) {
    receive(message, 4);
    boxed += box.next != NULL && box.left > 0;
    bytes = orrery_get_u32(message);
    if (bytes > sizeof message - 4) exit(6);
    if (bytes > 0) receive(message + 4, bytes);
    if (count == 3 && argc == 2) misbehave(argv[1]);
    orrery_put_u32(message, boxed);
    if (bytes % 2 == 0) {
      send_all(message, 4 + bytes);
    } else { /* in two writes, of which the second takes the pipe */
      send_all(message, 4);
      if (count == 3 && argc == 2) spoil(argv[1]);
      send_all(message + 4, bytes);
    }
  }
}
