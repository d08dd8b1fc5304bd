#include <orrery/harness/record/number_format.hpp>
#include <orrery/harness/record/oem_writer.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace orrery {

namespace {

constexpr double kMetresPerKm = 1e3;
// With these a number has at most 5 + 10 or 2 + 13 digits.
constexpr int kPositionDecimals = 10, kVelocityDecimals = 13;
constexpr double kLargestPosition_m = 99'999e3, kLargestVelocity_mps = 99e3;

// Values of an OEM are printable ASCII on one line.
void check_text(const char* keyword, const std::string& value) {
  const auto printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (value.empty() || !std::all_of(value.begin(), value.end(), printable)) {
    throw std::invalid_argument("OemWriter: " + std::string(keyword) + " = \"" + value +
                                "\"; accepted: printable ASCII, not empty");
  }
}

// Written so that NaN fails.
void check_components(const char* quantity, const OemWriter::Components& values, double largest,
                      const char* range, SimTime t) {
  for (const double value : values) {
    if (std::fabs(value) <= largest) continue;
    std::string message = "OemWriter::state: component of ";
    message += quantity;
    message += " = ";
    append_number(message, value);
    throw std::invalid_argument(message + " at " + to_string(t) + "; accepted: up to " + range);
  }
}

void append_components(std::string& line, const OemWriter::Components& values, int decimals) {
  for (const double value : values) {
    line += ' ';
    append_fixed(line, value / kMetresPerKm, decimals);
  }
}

}  // namespace

OemWriter::OemWriter(const std::filesystem::path& path, const OemObject& object,
                     SimTime created_UTC)
    : file_(path), object_(object) {
  if (object_.id.empty()) object_.id = object_.name;
  check_text("OBJECT_NAME", object_.name);
  check_text("OBJECT_ID", object_.id);
  file_.write(
      "CCSDS_OEM_VERS = 2.0\n"
      "COMMENT Simulated. CREATION_DATE is the start of the run, so that equal runs give equal\n"
      "COMMENT files.\n");
  file_.write("CREATION_DATE = " + to_calendar(created_UTC) + "\nORIGINATOR = ORRERY\n");
}

void OemWriter::state(SimTime t, const Components& r_ECI, const Components& v_ECI) {
  check(t, r_ECI, v_ECI);
  if (!in_segment_) begin_segment(after_break_ ? after_break_->t : t);
  if (after_break_ && after_break_->t < t) write(*after_break_);
  after_break_.reset();
  write({t, r_ECI, v_ECI});
}

void OemWriter::break_segment(SimTime t, const Components& r_ECI, const Components& v_before_ECI,
                              const Components& v_after_ECI) {
  const bool is_open = in_segment_ ? *last_ < t : after_break_ && after_break_->t < t;
  if (is_open) state(t, r_ECI, v_before_ECI);
  check(t, r_ECI, v_after_ECI, true);
  in_segment_ = false;
  after_break_ = {t, r_ECI, v_after_ECI};
}

void OemWriter::write(const State& state) {
  line_ = to_calendar(state.t);
  append_components(line_, state.r_ECI, kPositionDecimals);
  append_components(line_, state.v_ECI, kVelocityDecimals);
  line_ += '\n';
  file_.write(line_);
  last_ = state.t;
}

void OemWriter::close() {
  if (!last_) {
    throw std::logic_error("OemWriter: " + file_.path().string() +
                           " has no state to be closed with");
  }
  end_segment();
  file_.close();
}

void OemWriter::begin_segment(SimTime t) {
  if (last_) end_segment();
  file_.write("\nMETA_START\nOBJECT_NAME = " + object_.name + "\nOBJECT_ID = " + object_.id +
              "\nCENTER_NAME = EARTH\nREF_FRAME = EME2000\nTIME_SYSTEM = GPS\nSTART_TIME = " +
              to_calendar(t) + "\nSTOP_TIME = ");
  stop_time_position_ = file_.size();
  file_.write(to_calendar(t) + "\nMETA_STOP\n");
  in_segment_ = true;
}

// Calendar times are all of one length, so the true end fits where a provisional one was written.
void OemWriter::end_segment() {
  file_.overwrite(stop_time_position_, to_calendar(*last_));
}

void OemWriter::check(SimTime t, const Components& r_ECI, const Components& v_ECI,
                      bool is_break) const {
  check_components("r_ECI", r_ECI, kLargestPosition_m, "99999 km", t);
  check_components("v_ECI", v_ECI, kLargestVelocity_mps, "99 km/s", t);
  const std::optional<SimTime> last = after_break_ ? after_break_->t : last_;
  const bool may_share = is_break || !in_segment_;
  if (last && (may_share ? t < *last : t <= *last)) {
    throw std::invalid_argument("OemWriter::state: t = " + to_string(t) +
                                " does not follow the last state, " + to_string(*last));
  }
}

}  // namespace orrery
