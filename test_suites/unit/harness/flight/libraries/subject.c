/* Does as it is told: an input's first byte names one thing to do, the rest is its argument. One
 * letter each, so that a test reads as a list of orders. */
#define _GNU_SOURCE /* memfd_create */
#include <assert.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "orrery_flight.h"
#include "orrery_messages.h"

#define NOINLINE __attribute__((noinline)) /* to be seen on the stack */

enum { DO = 1, BITS = 2, SAY = 7, TIMES = 8 };

static struct {
  const orrery_host* host;
  void* kept[64];
  int kept_count;
  int64_t period_ns; /* of the tick; 0: it asks for none */
  int crashes_in_destroy;
} subject;

static const orrery_port ports[] = {{DO, ORRERY_IN, ORRERY_PACKET, "do", 64},
                                    {BITS, ORRERY_IN, ORRERY_STREAM, "bits", 8},
                                    {SAY, ORRERY_OUT, ORRERY_PACKET, "say", 64},
                                    {TIMES, ORRERY_OUT, ORRERY_PACKET, "times", 64}};

NOINLINE static void say(const void* data, uint32_t bytes) {
  subject.host->output(subject.host->context, SAY, data, bytes);
}

static void say_time(char what, int64_t now_ns) {
  unsigned char message[9];
  message[0] = (unsigned char)what;
  orrery_put_i64(message + 1, now_ns);
  subject.host->output(subject.host->context, TIMES, message, sizeof message);
}

NOINLINE static int overflow(volatile char* above) {
  volatile char frame[4096];
  if (*above == 77) return 0; /* never: compilers refuse what has no way out */
  frame[0] = *above;
  return overflow(frame) + frame[0];
}

static volatile int zero = 0;
static int* volatile nowhere = 0;

NOINLINE __attribute__((no_sanitize("undefined"))) static void fault(char how) {
  char local[64];
  char* volatile block = (char*)malloc(40);
  memset(local, 0xFF, sizeof local); /* no plausible header of a block */
  switch (how) {
    case 's':
      *nowhere = 1;
      break;
    case 'f':
      zero = 7 / zero;
      break;
    case 'i':
      __builtin_trap();
      break;
    case 'b': { /* a page behind the end of its file */
      const int empty = memfd_create("empty", 0);
      *(volatile int*)mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, empty, 0) = 1;
      break;
    }
    case 'o':
      zero = overflow(local);
      break;
    case 'l':
      for (;;) {
        zero = 0;
      }
    case 'a':
      abort();
      break;
    case 'v':
      assert(zero == 1);
      break;
    case 'x':
      exit(3);
      break;
    case 'r':
      raise(SIGSEGV);
      break;
    case 'd':
      free(block);
      free(block);
      break;
    case 'g': {
      void* volatile foreign = local + 16;
      free(foreign);
      break;
    }
    case 'c': {
      volatile char* header = block - 4;
      *header = 0x40;
      free(block);
      break;
    }
    case 'p':
      say(nowhere, 8); /* the host reads what it was pointed to */
      break;
    default:
      break;
  }
}

static int32_t create(void** self, const orrery_host* host, const orrery_boot* boot) {
  unsigned char message[8];
  *self = (void*)host; /* by instance, also where the table below is shared */
  subject.host = host;
  if (boot->config_bytes > 0 && memcmp(boot->config, "refuse", 6) == 0) return ORRERY_FATAL;
  if (boot->config_bytes > 0 && memcmp(boot->config, "say", 3) == 0) {
    orrery_put_u32(message, boot->boot_count);
    orrery_put_u32(message + 4, boot->reset_cause);
    say(message, sizeof message);
    say(boot->spacecraft, (uint32_t)strlen(boot->spacecraft));
    say(boot->process, (uint32_t)strlen(boot->process));
    say(boot->config, boot->config_bytes);
    say_time('b', boot->now_ns);
  }
  return ORRERY_OK;
}

static int32_t input(void* self, int64_t now_ns, uint32_t port, const void* data, uint32_t bytes) {
  const unsigned char* order = (const unsigned char*)data;
  subject.host = (const orrery_host*)self;
  if (port == BITS) {
    say(data, bytes);
    return ORRERY_OK;
  }
  if (bytes == 0) return ORRERY_REJECTED;
  if ((size_t)data % 8 != 0) return ORRERY_FATAL;
  switch (order[0]) {
    case 'e': /* echo */
      say(order + 1, bytes - 1);
      break;
    case 'n': /* now */
      say_time('n', now_ns);
      break;
    case 'q': /* request a tick */
      subject.host->request_tick(subject.host->context, orrery_get_i64(order + 1));
      break;
    case 'Q': /* request one, then another */
      subject.host->request_tick(subject.host->context, now_ns + 1000);
      subject.host->request_tick(subject.host->context, orrery_get_i64(order + 1));
      break;
    case 'P': /* tick for ever */
      subject.period_ns = orrery_get_i64(order + 1);
      subject.host->request_tick(subject.host->context, now_ns + subject.period_ns);
      break;
    case 'k': /* keep that many bytes */
      subject.kept[subject.kept_count++] = malloc(orrery_get_u32(order + 1));
      if (subject.kept[subject.kept_count - 1] == NULL) {
        subject.kept_count--;
        say("null", 4);
      }
      break;
    case 'b': /* use that many bytes briefly */
    {
      char* volatile block = (char*)malloc(orrery_get_u32(order + 1));
      free(block);
      break;
    }
    case 'z': /* give back the newest */
      free(subject.kept[--subject.kept_count]);
      break;
    case 'D':
      subject.crashes_in_destroy = 1;
      break;
    case 'l': /* log */
      subject.host->log(subject.host->context, ORRERY_WARNING, (const char*)order + 1);
      break;
    case 'w': /* store */
      return subject.host->nv_store(subject.host->context, order[1], order + 2, bytes - 2);
    case 'y': /* load, and say it */
    {
      unsigned char buffer[16];
      int32_t n = subject.host->nv_load(subject.host->context, order[1], buffer, sizeof buffer);
      if (n < 0) return n;
      say(buffer, (uint32_t)n);
      break;
    }
    case 'u': /* say through a port that does not exist, and too much; both statuses come back */
    {
      unsigned char statuses[2];
      char much[65] = {0};
      statuses[0] = (unsigned char)subject.host->output(subject.host->context, 99, much, 1);
      statuses[1] = (unsigned char)subject.host->output(subject.host->context, SAY, much, 65);
      say(statuses, 2);
      break;
    }
    case '!': /* say and log something, ask for a tick, then crash */
      say("last words", 10);
      subject.host->log(subject.host->context, ORRERY_ERROR, "going down");
      subject.host->request_tick(subject.host->context, now_ns + 1000);
      fault((char)order[1]);
      break;
    case '?': /* return this status */
      return (int32_t)orrery_get_u32(order + 1);
    default:
      return ORRERY_REJECTED;
  }
  return ORRERY_OK;
}

static int32_t tick(void* self, int64_t now_ns) {
  subject.host = (const orrery_host*)self;
  say_time('t', now_ns);
  if (subject.period_ns != 0) {
    subject.host->request_tick(subject.host->context, now_ns + subject.period_ns);
  }
  return ORRERY_OK;
}

static void destroy(void* self) {
  subject.host = (const orrery_host*)self;
  subject.host->log(subject.host->context, ORRERY_INFO, "destroyed");
  say("out of turn", 11);
  if (subject.crashes_in_destroy) fault('s');
  while (subject.kept_count > 0) free(subject.kept[--subject.kept_count]);
}

static const orrery_flight flight = {sizeof(orrery_flight),
                                     ORRERY_ABI_VERSION,
                                     "subject",
                                     "1.0",
                                     ports,
                                     sizeof ports / sizeof ports[0],
                                     create,
                                     input,
                                     tick,
                                     destroy};

const orrery_flight* orrery_flight_entry(void) {
  return &flight;
}
