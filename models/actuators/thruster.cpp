#include <orrery/models/actuators/thruster.hpp>

namespace orrery {

void Thruster::reject(DeviceContext& io, const std::string& why) {
  ++rejected_;
  io.log(DeviceContext::kWarning, "thruster: command rejected: " + why);
}

}  // namespace orrery
