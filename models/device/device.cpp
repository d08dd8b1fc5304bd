#include <orrery/models/device/device.hpp>
