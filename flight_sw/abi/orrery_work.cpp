// Compiled into every library that is built with COUNT_WORK, uncounted itself. C++11.
#include "orrery_work.h"

#if defined(__clang__)
#define ORRERY_UNCOUNTED __attribute__((no_sanitize("coverage")))
#else
#define ORRERY_UNCOUNTED __attribute__((no_sanitize_coverage))
#endif

static orrery_work work = {0, UINT64_MAX, nullptr};

ORRERY_UNCOUNTED orrery_work* orrery_work_counter(void) {
  return &work;
}

// What -fsanitize-coverage=trace-pc calls at every edge.
extern "C" __attribute__((visibility("hidden"))) void __sanitizer_cov_trace_pc(void);
extern "C" ORRERY_UNCOUNTED void __sanitizer_cov_trace_pc(void) {
  if (++work.count >= work.limit && work.exceeded != nullptr) work.exceeded();
}
