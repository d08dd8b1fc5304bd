#include <orrery/models/ccsds/odm_frames.hpp>
#include <orrery/models/ccsds/odm_io.hpp>

#include <erfa.h>

#include <stdexcept>

namespace orrery {
namespace {

// R_IG, G the GCRF: eraBp00's bias matrix turns GCRS components into J2000.0 mean ones.
Mat3 frame_bias() {
  double bias[3][3], precession[3][3], both[3][3];
  eraBp00(2451545.0, 0, bias, precession, both);
  const auto row = [&](int i) { return Vec3{bias[i][0], bias[i][1], bias[i][2]}; };
  return {row(0), row(1), row(2)};
}

}  // namespace

bool is_itrf(const OdmMetadata& metadata) {
  return ccsds::is_itrf(ccsds::canonical(metadata.ref_frame));
}

InertialState to_inertial(const OdmMetadata& metadata, const Vec3& r_km, const Vec3& v_kmps,
                          const Surroundings& around) {
  const Vec3 r = 1e3 * r_km, v = 1e3 * v_kmps;
  if (ccsds::canonical(metadata.center_name) == "EARTH") {
    const std::string frame = ccsds::canonical(metadata.ref_frame);
    if (is_geocentric_eme2000(metadata)) return {r, v};
    if (frame == "GCRF" || frame == "ICRF") return {frame_bias() * r, frame_bias() * v};
    if (is_itrf(metadata))
      return to_inertial(EarthFixedState{r, v}, around.R_EI, around.omega_EI_ECEF);
  }
  throw std::invalid_argument("to_inertial: the state of " + metadata.object_name +
                              " is in REF_FRAME " + metadata.ref_frame + " about " +
                              metadata.center_name +
                              "; accepted: EME2000, GCRF, ICRF and ITRF about EARTH");
}

}  // namespace orrery
