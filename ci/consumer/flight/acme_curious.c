/* Must not compile: flight software that includes the simulator. */
#include <orrery/orrery.hpp>
