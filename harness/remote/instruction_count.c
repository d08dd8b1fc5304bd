/* A plugin of qemu-user that counts the instructions of single calls of flight code.
 *
 * Counting   Each translated block adds its number of instructions to a counter as it begins,
 * inline in the translated code. A block that a fault ends early counts whole. Latching
 * orrery-flight-target marks a call's ends by write(-20306, p, 1) and write(-20306, p, 2), to a
 * descriptor that cannot be: they do nothing. The count is taken there, on the guest's own thread:
 * whoever read the counter from outside would race with the guest's way back to its next read.
 * Handing    The page with the figures is a memfd at the descriptor that the argument `page=N`
 * names. over       Guest and plugin share one process, so the guest maps that descriptor: no file,
 * no name.
 *
 * qemu's plugin interface, version 1; Debian packages no header, so what is used is declared here.
 */
#define _GNU_SOURCE
#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

typedef uint64_t qemu_plugin_id_t;
typedef struct qemu_info_t {
  const char* target_name;
  struct {
    int min, cur;
  } version;
  _Bool system_emulation;
  struct {
    int smp_vcpus, max_vcpus;
  } system;
} qemu_info_t;
struct qemu_plugin_tb;
enum qemu_plugin_op { QEMU_PLUGIN_INLINE_ADD_U64 };

void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id,
                                           void (*translated)(qemu_plugin_id_t,
                                                              struct qemu_plugin_tb*));
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);
void qemu_plugin_register_vcpu_tb_exec_inline(struct qemu_plugin_tb* block, enum qemu_plugin_op op,
                                              void* counter, uint64_t added);
void qemu_plugin_register_vcpu_syscall_cb(qemu_plugin_id_t id,
                                          void (*called)(qemu_plugin_id_t, unsigned cpu,
                                                         int64_t number, uint64_t, uint64_t,
                                                         uint64_t, uint64_t, uint64_t, uint64_t,
                                                         uint64_t, uint64_t));

#define EXPORT __attribute__((visibility("default")))
EXPORT int qemu_plugin_version = 1;
EXPORT int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t* info, int argc, char** argv);

/* What the guest maps; read by orrery_flight_target.c. */
typedef struct page {
  uint64_t instructions; /* between the last pair of marks */
  uint64_t pairs;
} page;

static uint64_t executed, begin;
static int64_t number_of_write;
static volatile page* figures;

static void block_translated(qemu_plugin_id_t id, struct qemu_plugin_tb* block) {
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_inline(block, QEMU_PLUGIN_INLINE_ADD_U64, &executed,
                                           qemu_plugin_tb_n_insns(block));
}

static void syscall_made(qemu_plugin_id_t id, unsigned cpu, int64_t number, uint64_t descriptor,
                         uint64_t data, uint64_t bytes, uint64_t a4, uint64_t a5, uint64_t a6,
                         uint64_t a7, uint64_t a8) {
  (void)id, (void)cpu, (void)data, (void)a4, (void)a5, (void)a6, (void)a7, (void)a8;
  if (number != number_of_write || (int32_t)descriptor != -20306) return;
  if (bytes == 1) begin = executed;
  if (bytes != 2) return;
  figures->instructions = executed - begin;
  figures->pairs++;
}

static int refuse(const char* what, const char* about) {
  fprintf(stderr, "orrery instruction count: %s: %s\n", what, about);
  return -1;
}

static int64_t write_on(const char* processor) {
  static const struct {
    const char* name;
    int64_t number;
  } kNumbers[] = {{"arm", 4}, {"aarch64", 64}, {"x86_64", 1}, {"riscv64", 64}};
  size_t i;
  for (i = 0; i < sizeof kNumbers / sizeof kNumbers[0]; ++i) {
    if (strcmp(kNumbers[i].name, processor) == 0) return kNumbers[i].number;
  }
  return -1;
}

/* The page at a descriptor of the caller's choice. */
static volatile page* share(int descriptor) {
  const int made = memfd_create("orrery instruction count", 0);
  void* mapped;
  if (made < 0 || ftruncate(made, sizeof(page)) != 0 || dup2(made, descriptor) < 0) return NULL;
  if (made != descriptor) close(made);
  mapped = mmap(NULL, sizeof(page), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  return mapped == MAP_FAILED ? NULL : mapped;
}

int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t* info, int argc, char** argv) {
  const char* name = argc == 1 && strncmp(argv[0], "page=", 5) == 0 ? argv[0] + 5 : NULL;
  if (name == NULL) return refuse("it takes page=DESCRIPTOR", argc > 0 ? argv[0] : "nothing");
  if (info->system_emulation) return refuse("it counts in user mode only", info->target_name);
  number_of_write = write_on(info->target_name);
  if (number_of_write < 0)
    return refuse("it knows arm, aarch64, x86_64, riscv64", info->target_name);
  figures = share(atoi(name));
  if (figures == NULL) return refuse("no page at descriptor", name);
  qemu_plugin_register_vcpu_tb_trans_cb(id, block_translated);
  qemu_plugin_register_vcpu_syscall_cb(id, syscall_made);
  return 0;
}
