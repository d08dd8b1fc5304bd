// Must not compile: a flight source that includes the simulator.
#include <orrery/orrery.hpp>

#include "orrery_flight.hpp"
