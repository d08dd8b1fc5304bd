#include <orrery/models/attitude/pointing.hpp>
#include <orrery/models/frames/rtn.hpp>

namespace orrery {

BodyAttitude zenith_pointing(const InertialState& state) {
  const Mat3 R_HI = rtn_axes(state);
  return {{R_HI.row_y, R_HI.row_z, R_HI.row_x}, {0, omega_HI_RTN(state).z, 0}};
}

}  // namespace orrery
