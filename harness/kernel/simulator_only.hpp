/// Included by every header of the simulator, first: flight software must not see any of them.
#pragma once

#ifdef ORRERY_FLIGHT_BUILD
#error \
    "flight software sees orrery_flight.h, orrery_flight.hpp and orrery_messages.h only; this is a header of the simulator"
#endif
