/* Memory that a simulation and a target of the same computer share, beside the two pipes between
 * them: what begins a request or an answer may go through it, which spares the system calls of a
 * pipe. What it carries is the bytes of orrery_wire.h. C99 with the atomics of gcc and clang.
 *
 * Passing
 *   The simulation makes a memfd that cannot shrink, and names its descriptor in ORRERY_MAILBOX. A
 *   target whose standard input and output are the very pipes that it tells of says so in
 *   `attached`, before its HELLO. Any other target never looks.
 *
 * Turns
 *   Of a request, and of an answer, the first bytes alone may go here, if the slot is empty and
 *   large enough; else all of it takes the pipe, as HELLO does.
 *
 * Waiting
 *   The reader lets others run `yields` times, then marks the slot asleep and reads the pipe; the
 *   one who finds it so writes to the pipe. So whoever dies, stops or lies, the other one waits at
 *   the pipe, where waits have an end.
 */
#ifndef ORRERY_MAILBOX_H
#define ORRERY_MAILBOX_H

#include <sched.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>

#define ORRERY_MAILBOX_MAGIC 0x584F424Fu /* "OBOX" */
#define ORRERY_MAILBOX_SLOT_BYTES 16384u

/* A slot's state: bytes that it holds, or one of these. */
#define ORRERY_MAILBOX_EMPTY 0u
#define ORRERY_MAILBOX_ASLEEP 0xFFFFFFFFu

typedef struct orrery_mailbox_slot {
  uint32_t state;
  uint32_t unused[15];
  unsigned char data[ORRERY_MAILBOX_SLOT_BYTES];
} orrery_mailbox_slot;

typedef struct orrery_mailbox {
  uint32_t magic;
  uint32_t attached; /* by the target: 1 */
  uint32_t yields;   /* by the simulation, before each request; 0: straight to the pipe */
  uint32_t unused;
  uint64_t request_pipe, answer_pipe; /* st_ino */
  orrery_mailbox_slot requests, answers;
} orrery_mailbox;

/* 1: it is there. 0: it has to take the pipe. */
static inline int orrery_mailbox_put(orrery_mailbox_slot* slot, const void* data, uint32_t bytes) {
  uint32_t state = __atomic_load_n(&slot->state, __ATOMIC_ACQUIRE);
  if (state != ORRERY_MAILBOX_EMPTY || bytes == 0 || bytes > ORRERY_MAILBOX_SLOT_BYTES) return 0;
  memcpy(slot->data, data, bytes);
  return __atomic_compare_exchange_n(&slot->state, &state, bytes, 0, __ATOMIC_ACQ_REL,
                                     __ATOMIC_ACQUIRE);
}

/* Bytes in the slot, whose state is anything if the other side lies. 0: it comes by the pipe;
 * orrery_mailbox_empty() when it has come. */
static inline uint32_t orrery_mailbox_wait(orrery_mailbox_slot* slot, uint32_t yields) {
  uint32_t state = __atomic_load_n(&slot->state, __ATOMIC_ACQUIRE);
  for (; state == ORRERY_MAILBOX_EMPTY && yields > 0; --yields) {
    sched_yield();
    state = __atomic_load_n(&slot->state, __ATOMIC_ACQUIRE);
  }
  if (state == ORRERY_MAILBOX_EMPTY &&
      __atomic_compare_exchange_n(&slot->state, &state, ORRERY_MAILBOX_ASLEEP, 0, __ATOMIC_ACQ_REL,
                                  __ATOMIC_ACQUIRE)) {
    return 0;
  }
  return state == ORRERY_MAILBOX_ASLEEP ? 0 : state;
}

static inline void orrery_mailbox_empty(orrery_mailbox_slot* slot) {
  __atomic_store_n(&slot->state, ORRERY_MAILBOX_EMPTY, __ATOMIC_RELEASE);
}

/* ---- the target's side */

typedef struct orrery_mailbox_target {
  orrery_mailbox* box; /* NULL: all takes the pipe */
  int answers;         /* the first bytes of an answer, or HELLO, have been written */
  uint32_t left;       /* of a request in the slot, from `next` on */
  const unsigned char* next;
} orrery_mailbox_target;

/* That of ORRERY_MAILBOX if it belongs to these two pipes, else NULL. */
static inline orrery_mailbox* orrery_mailbox_attach(int in, int out) {
  const char* descriptor = getenv("ORRERY_MAILBOX");
  struct stat requests, answers, memory;
  void* mapped;
  orrery_mailbox* box;
  if (descriptor == NULL || fstat(atoi(descriptor), &memory) != 0 ||
      memory.st_size < (off_t)sizeof *box || fstat(in, &requests) != 0 ||
      fstat(out, &answers) != 0) {
    return NULL;
  }
  mapped = mmap(NULL, sizeof *box, PROT_READ | PROT_WRITE, MAP_SHARED, atoi(descriptor), 0);
  if (mapped == MAP_FAILED) return NULL;
  box = (orrery_mailbox*)mapped;
  if (box->magic != ORRERY_MAILBOX_MAGIC || box->request_pipe != (uint64_t)requests.st_ino ||
      box->answer_pipe != (uint64_t)answers.st_ino) {
    munmap(mapped, sizeof *box);
    return NULL;
  }
  __atomic_store_n(&box->attached, 1u, __ATOMIC_RELEASE);
  return box;
}

/* Of a request. 1: all of it has been read; 0: it comes by the pipe; -1: there is less. */
static inline int orrery_mailbox_read(orrery_mailbox_target* t, void* buffer, uint32_t bytes) {
  if (t->box == NULL) return 0;
  if (t->answers) {
    t->answers = 0;
    t->next = t->box->requests.data;
    t->left =
        orrery_mailbox_wait(&t->box->requests, __atomic_load_n(&t->box->yields, __ATOMIC_RELAXED));
    if (t->left > ORRERY_MAILBOX_SLOT_BYTES) return -1;
  }
  if (t->left == 0) return 0;
  if (bytes > t->left) return -1;
  memcpy(buffer, t->next, bytes);
  t->next += bytes;
  t->left -= bytes;
  if (t->left == 0) orrery_mailbox_empty(&t->box->requests);
  return 1;
}

/* After a read from the pipe. */
static inline void orrery_mailbox_has_read(orrery_mailbox_target* t) {
  if (t->box != NULL) orrery_mailbox_empty(&t->box->requests);
}

/* Of an answer. 1: it is written; 0: it has to take the pipe. */
static inline int orrery_mailbox_write(orrery_mailbox_target* t, const void* data, uint32_t bytes) {
  const int is_first = !t->answers;
  t->answers = 1;
  return t->box != NULL && is_first && orrery_mailbox_put(&t->box->answers, data, bytes);
}

#endif
