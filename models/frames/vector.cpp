#include <orrery/models/frames/vector.hpp>
