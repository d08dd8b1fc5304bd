#include <orrery/harness/heap/heap_figures.hpp>
#include <orrery/harness/heap/interposition.hpp>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <elf.h>
#include <iostream>
#include <link.h>
#include <locale>
#include <mutex>
#include <sstream>
#include <stdio_ext.h>
#include <sys/auxv.h>
#include <unistd.h>

// Defined by orrery::allocator; a program without it has none.
extern "C" [[gnu::weak]] bool orrery_allocator_simulates();
extern "C" [[gnu::weak]] const char* orrery_allocator_hook_not_taken(std::size_t index);
extern "C" [[gnu::weak]] bool orrery_services_are_virtual();
extern "C" [[gnu::weak]] const char* orrery_service_hook_not_taken(std::size_t index);
extern "C" [[gnu::weak]] const char* orrery_file_hook_not_taken(std::size_t index);
extern "C" [[gnu::weak]] const char* orrery_descriptor_hook_not_taken(std::size_t index);
extern "C" [[gnu::weak]] const char* orrery_transfer_hook_not_taken(std::size_t index);
extern "C" [[gnu::weak]] const char* orrery_attribute_hook_not_taken(std::size_t index);

namespace orrery {
namespace internal {

constinit std::uintptr_t loader_begin = 0;
constinit std::uintptr_t loader_bytes = 0;
constinit const ProcessHooks* process_hooks = nullptr;
constinit const ServiceHooks* service_hooks = nullptr;
constinit FileViewFunction* file_view = nullptr;

}  // namespace internal

namespace {

int find_loader(dl_phdr_info* object, std::size_t, void*) {
  if (object->dlpi_addr != getauxval(AT_BASE)) return 0;
  std::uintptr_t end = 0;
  for (int i = 0; i < object->dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = object->dlpi_phdr[i];
    if (segment.p_type == PT_LOAD) end = std::max(end, segment.p_vaddr + segment.p_memsz);
  }
  internal::loader_begin = object->dlpi_addr;
  internal::loader_bytes = end;
  return 1;
}

// stdout's buffer is allocated when it is first written to, by whoever does so.
void give_stdout_its_buffer() {
  static char buffer[BUFSIZ];
  if (__fbufsize(stdout) != 0) return;
  std::setvbuf(stdout, buffer, isatty(STDOUT_FILENO) != 0 ? _IOLBF : _IOFBF, sizeof buffer);
}

void touch_iostreams() {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << 1.5 << 7;
  double value = 0;
  std::istringstream("2.5") >> value;
}

void throw_and_catch() {
  try {
    throw std::ios_base::failure("warm-up");
  } catch (const std::exception&) {
  }
}

}  // namespace

bool heap_simulation_available() {
  return orrery_allocator_simulates != nullptr && orrery_allocator_simulates();
}

bool services_are_virtual() {
  return orrery_services_are_virtual != nullptr && orrery_services_are_virtual();
}

bool files_are_virtual() {
  return orrery_file_hook_not_taken != nullptr;
}

void warm_up_libraries() {
  static std::once_flag once;
  std::call_once(once, [] {
    dl_iterate_phdr(find_loader, nullptr);
    give_stdout_its_buffer();
    tzset();
    touch_iostreams();
    throw_and_catch();
  });
}

std::string verify_interposition() {
  std::string names;
  const auto ask = [&names](const char* (*not_taken)(std::size_t)) {
    for (std::size_t i = 0; const char* name = not_taken(i); ++i) {
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
  };
  if (heap_simulation_available()) ask(orrery_allocator_hook_not_taken);
  if (services_are_virtual()) ask(orrery_service_hook_not_taken);
  if (files_are_virtual()) {
    ask(orrery_file_hook_not_taken);
    ask(orrery_descriptor_hook_not_taken);
    ask(orrery_transfer_hook_not_taken);
    ask(orrery_attribute_hook_not_taken);
  }
  if (names.empty()) return "";
  return "these functions of the simulated heap are not reached by shared libraries: " + names +
         "; link the test program with orrery::allocator, whose --dynamic-list exports them";
}

}  // namespace orrery
