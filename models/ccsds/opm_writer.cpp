#include <orrery/models/ccsds/odm_io.hpp>
#include <orrery/models/ccsds/opm.hpp>
#include <orrery/models/ccsds/opm_keywords.hpp>

namespace orrery {
namespace {

using ccsds::KvnWriter;

void write(KvnWriter& out, const OpmStateVector& state) {
  out.comments(state.comments);
  out.epoch("EPOCH", state.epoch);
  out.real("X", state.r_km.x);
  out.real("Y", state.r_km.y);
  out.real("Z", state.r_km.z);
  out.real("X_DOT", state.v_kmps.x);
  out.real("Y_DOT", state.v_kmps.y);
  out.real("Z_DOT", state.v_kmps.z);
}

void write(KvnWriter& out, const OpmKeplerianElements& k) {
  out.comments(k.comments);
  out.real("SEMI_MAJOR_AXIS", k.a_km);
  out.real("ECCENTRICITY", k.e);
  out.real("INCLINATION", k.i_deg);
  out.real("RA_OF_ASC_NODE", k.raan_deg);
  out.real("ARG_OF_PERICENTER", k.argument_of_pericentre_deg);
  out.real(k.anomaly_is_true ? "TRUE_ANOMALY" : "MEAN_ANOMALY", k.anomaly_deg);
  out.real("GM", k.gm_km3ps2);
}

void write(KvnWriter& out, const OpmSpacecraft& s) {
  out.comments(s.comments);
  out.optional_real("MASS", s.mass_kg);
  out.optional_real("SOLAR_RAD_AREA", s.solar_radiation_area_m2);
  out.optional_real("SOLAR_RAD_COEFF", s.solar_radiation_coefficient);
  out.optional_real("DRAG_AREA", s.drag_area_m2);
  out.optional_real("DRAG_COEFF", s.drag_coefficient);
}

void write(KvnWriter& out, const OpmCovariance& c) {
  out.comments(c.comments);
  out.optional_text("COV_REF_FRAME", c.ref_frame);
  for (std::size_t i = 0; i < c.lower_triangle.size(); ++i)
    out.real(ccsds::kOpmCovarianceKeywords[i].keyword, c.lower_triangle[i]);
}

void write(KvnWriter& out, const OpmManeuver& m) {
  out.comments(m.comments);
  out.epoch("MAN_EPOCH_IGNITION", m.ignition);
  out.optional_real("MAN_DURATION", m.duration_s);
  out.optional_real("MAN_DELTA_MASS", m.delta_mass_kg);
  out.text("MAN_REF_FRAME", m.ref_frame);
  out.real("MAN_DV_1", m.dv_kmps.x);
  out.real("MAN_DV_2", m.dv_kmps.y);
  out.real("MAN_DV_3", m.dv_kmps.z);
}

}  // namespace

std::string write_opm(const Opm& opm) {
  KvnWriter out("write_opm");
  ccsds::write_header(out, "CCSDS_OPM_VERS", opm.header);
  ccsds::write_metadata(out, opm.metadata);
  write(out, opm.state);
  if (opm.keplerian) write(out, *opm.keplerian);
  if (opm.spacecraft) write(out, *opm.spacecraft);
  if (opm.covariance) write(out, *opm.covariance);
  for (const OpmManeuver& maneuver : opm.maneuvers) write(out, maneuver);
  for (const auto& [name, value] : opm.user_defined) out.text("USER_DEFINED_" + name, value);
  std::string text = out.take();
  // Names of frames, signs, keywords: what is written can be read, or is refused here.
  parse_opm(text, "write_opm");
  return text;
}

}  // namespace orrery
