/* Opens a flight library: what the programs of this folder have in common. C99 and dlopen. PROGRAM
 * is the name that begins their messages. */
#ifndef ORRERY_FLIGHT_LIBRARY_H
#define ORRERY_FLIGHT_LIBRARY_H

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

#include "orrery_flight.h"

static void fail(const char* what, const char* about) {
  fprintf(stderr, PROGRAM ": %s: %s\n", what, about);
  exit(2);
}

/* `library` is for dlclose. Whatever is wrong ends the program. */
static const orrery_flight* open_flight_library(const char* path, void** library) {
  const orrery_flight* (*entry)(void);
  const orrery_flight* flight;
  *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (*library == NULL) fail("no flight library", dlerror());
  *(void**)&entry = dlsym(*library, "orrery_flight_entry");
  if (entry == NULL) fail("no orrery_flight_entry in", path);
  flight = entry();
  if (flight->abi_version != ORRERY_ABI_VERSION) fail("another version of the ABI in", path);
  return flight;
}

#endif
