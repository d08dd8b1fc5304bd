#include <orrery/models/ccsds/odm_io.hpp>
#include <orrery/models/ccsds/opm.hpp>
#include <orrery/models/ccsds/opm_keywords.hpp>

#include <algorithm>

namespace orrery {
namespace {

using ccsds::KvnLine;
using ccsds::KvnLines;

constexpr std::string_view kUserDefined = "USER_DEFINED_";

/// Reads block after block; each takes the keywords that are its own, in their order.
class OpmReader {
 public:
  OpmReader(std::string_view text, std::string_view source) : lines_(text, "parse_opm", source) {}

  Opm read() {
    opm_.header = ccsds::read_header(lines_, "CCSDS_OPM_VERS");
    read_metadata();
    read_state();
    if (lines_.next_is("SEMI_MAJOR_AXIS")) read_keplerian();
    if (next_is_one_of(ccsds::kOpmSpacecraftKeywords)) read_spacecraft();
    if (lines_.next_is("COV_REF_FRAME") || lines_.next_is("CX_X")) read_covariance();
    while (lines_.next_is("MAN_EPOCH_IGNITION")) read_maneuver();
    while (next_is_user_defined()) read_user_defined();
    require_end();
    return std::move(opm_);
  }

 private:
  template <class Keywords>
  bool next_is_one_of(const Keywords& keywords) {
    return std::any_of(std::begin(keywords), std::end(keywords),
                       [this](const auto& keyword) { return lines_.next_is(keyword); });
  }

  void read_metadata() {
    OdmMetadata& metadata = opm_.metadata;
    ccsds::KeywordsSeen seen;
    while (const KvnLine* const next = lines_.peek()) {
      const KvnLine line = *next;
      if (!ccsds::read_metadata(lines_, line, metadata)) break;
      seen.add(lines_, line);
      lines_.take(metadata.comments);
    }
    const KvnLine* const next = lines_.peek();
    if (next != nullptr && next->keyword != "EPOCH") lines_.take("EPOCH", metadata.comments);
    if (next == nullptr) lines_.fail("cut short: EPOCH and the state are missing");
    seen.require(lines_, next->number,
                 {"OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "REF_FRAME", "TIME_SYSTEM"});
  }

  double take_real(std::string_view keyword, std::string_view unit,
                   std::vector<std::string>& comments) {
    return lines_.real(lines_.take(keyword, comments), unit);
  }

  // Order of evaluation matters: one statement for each.
  Vec3 take_vector(const std::array<std::string_view, 3>& keywords, std::string_view unit,
                   std::vector<std::string>& comments) {
    Vec3 v;
    v.x = take_real(keywords[0], unit, comments);
    v.y = take_real(keywords[1], unit, comments);
    v.z = take_real(keywords[2], unit, comments);
    return v;
  }

  void read_state() {
    OpmStateVector& state = opm_.state;
    state.epoch = lines_.epoch(lines_.take("EPOCH", state.comments));
    state.r_km = take_vector({"X", "Y", "Z"}, "km", state.comments);
    state.v_kmps = take_vector({"X_DOT", "Y_DOT", "Z_DOT"}, "km/s", state.comments);
  }

  void read_keplerian() {
    OpmKeplerianElements k;
    k.a_km = take_real("SEMI_MAJOR_AXIS", "km", k.comments);
    k.e = lines_.not_negative(lines_.take("ECCENTRICITY", k.comments), "");
    k.i_deg = take_real("INCLINATION", "deg", k.comments);
    k.raan_deg = take_real("RA_OF_ASC_NODE", "deg", k.comments);
    k.argument_of_pericentre_deg = take_real("ARG_OF_PERICENTER", "deg", k.comments);
    k.anomaly_is_true = !lines_.next_is("MEAN_ANOMALY");
    k.anomaly_deg =
        take_real(k.anomaly_is_true ? "TRUE_ANOMALY" : "MEAN_ANOMALY", "deg", k.comments);
    k.gm_km3ps2 = lines_.not_negative(lines_.take("GM", k.comments), "km**3/s**2");
    opm_.keplerian = std::move(k);
  }

  void read_spacecraft() {
    OpmSpacecraft s;
    const auto optional_real = [&](std::string_view keyword, std::string_view unit,
                                   std::optional<double>& value) {
      if (lines_.next_is(keyword)) value = lines_.not_negative(lines_.take(s.comments), unit);
    };
    optional_real("MASS", "kg", s.mass_kg);
    optional_real("SOLAR_RAD_AREA", "m**2", s.solar_radiation_area_m2);
    optional_real("SOLAR_RAD_COEFF", "", s.solar_radiation_coefficient);
    optional_real("DRAG_AREA", "m**2", s.drag_area_m2);
    optional_real("DRAG_COEFF", "", s.drag_coefficient);
    opm_.spacecraft = std::move(s);
  }

  void read_covariance() {
    OpmCovariance c;
    if (lines_.next_is("COV_REF_FRAME"))
      c.ref_frame = ccsds::frame(lines_, lines_.take(c.comments), true);
    for (std::size_t i = 0; i < c.lower_triangle.size(); ++i) {
      const ccsds::CovarianceKeyword& term = ccsds::kOpmCovarianceKeywords[i];
      c.lower_triangle[i] = take_real(term.keyword, term.unit, c.comments);
    }
    opm_.covariance = std::move(c);
  }

  void read_maneuver() {
    OpmManeuver m;
    m.ignition = lines_.epoch(lines_.take("MAN_EPOCH_IGNITION", m.comments));
    if (lines_.next_is("MAN_DURATION"))
      m.duration_s = lines_.not_negative(lines_.take(m.comments), "s");
    if (lines_.next_is("MAN_DELTA_MASS"))
      m.delta_mass_kg = lines_.real(lines_.take(m.comments), "kg");
    m.ref_frame = ccsds::frame(lines_, lines_.take("MAN_REF_FRAME", m.comments), true);
    m.dv_kmps = take_vector({"MAN_DV_1", "MAN_DV_2", "MAN_DV_3"}, "km/s", m.comments);
    opm_.maneuvers.push_back(std::move(m));
  }

  bool next_is_user_defined() {
    const KvnLine* const next = lines_.peek();
    return next != nullptr && next->keyword.starts_with(kUserDefined) &&
           next->keyword.size() > kUserDefined.size();
  }

  void read_user_defined() {
    const KvnLine line = lines_.take(last_comments());
    opm_.user_defined.emplace_back(line.keyword.substr(kUserDefined.size()), lines_.text(line));
  }

  void require_end() {
    lines_.take_remaining_comments(last_comments());
    const KvnLine* const next = lines_.peek();
    if (next == nullptr) return;
    const std::string what =
        next->keyword.empty() ? ccsds::quoted(next->value) : std::string(next->keyword);
    lines_.fail(next->number,
                what +
                    " is not a keyword of an OPM, or not in its place: state, Keplerian elements, "
                    "spacecraft, covariance, maneuvers, user-defined");
  }

  // Comments below the last block stay with it.
  std::vector<std::string>& last_comments() {
    if (!opm_.maneuvers.empty()) return opm_.maneuvers.back().comments;
    if (opm_.covariance) return opm_.covariance->comments;
    if (opm_.spacecraft) return opm_.spacecraft->comments;
    if (opm_.keplerian) return opm_.keplerian->comments;
    return opm_.state.comments;
  }

  KvnLines lines_;
  Opm opm_;
};

}  // namespace

Opm parse_opm(std::string_view text, std::string_view source_name) {
  return OpmReader(text, source_name).read();
}

Opm load_opm(const std::string& path) {
  return parse_opm(text::read_file(path, "load_opm"), path);
}

OrbitState state_of(const Opm& opm) {
  ccsds::require_geocentric_eme2000(opm.metadata, "state_of");
  OrbitState state;
  state.t = to_sim_time(opm.state.epoch, opm.metadata.time_system);
  state.r_ECI = 1e3 * opm.state.r_km;
  state.v_ECI = 1e3 * opm.state.v_kmps;
  if (opm.spacecraft) state.mass_kg = opm.spacecraft->mass_kg.value_or(0);
  return state;
}

}  // namespace orrery
