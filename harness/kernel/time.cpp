#include <orrery/harness/kernel/time.hpp>

namespace orrery {}
