/* Work that a flight library counts itself: one for every edge of its control flow that it takes. A
 * library built with orrery_add_flight_library(... COUNT_WORK) exports orrery_work_counter(); what
 * runs it sets `limit`, and `exceeded` to be called as flight code once `count` has reached it.
 * Counts repeat exactly for one binary; another compiler or flag counts otherwise. */
#ifndef ORRERY_WORK_H
#define ORRERY_WORK_H
#include "orrery_flight.h"
#ifdef __cplusplus
extern "C" {
#endif
typedef struct orrery_work {
  uint64_t count, limit;
  void (*exceeded)(void);
} orrery_work;
ORRERY_EXPORT orrery_work* orrery_work_counter(void);
#ifdef __cplusplus
}
#endif
#endif
