#include <orrery/models/ccsds/odm_io.hpp>
#include <orrery/models/ccsds/oem.hpp>

#include <algorithm>

namespace orrery {
namespace {

using ccsds::KvnLine;
using ccsds::KvnLines;

constexpr int kHighestDegree = 100;

class OemReader {
 public:
  OemReader(std::string_view text, std::string_view source) : lines_(text, "parse_oem", source) {}

  Oem read() {
    oem_.header = ccsds::read_header(lines_, "CCSDS_OEM_VERS");
    do {
      read_segment();
    } while (lines_.peek() != nullptr);
    OemSegment& last = oem_.segments.back();
    lines_.take_remaining_comments(last.covariances.empty() ? last.comments
                                                            : last.covariance_comments);
    return std::move(oem_);
  }

 private:
  void read_segment() {
    OemSegment segment;
    read_metadata(segment.metadata);
    require_one_time_system(segment.metadata);
    read_states(segment);
    if (lines_.next_is("COVARIANCE_START")) read_covariances(segment);
    oem_.segments.push_back(std::move(segment));
  }

  // ---- metadata

  void read_metadata(OemMetadata& metadata) {
    ccsds::KeywordsSeen seen;
    lines_.take("META_START", metadata.comments);
    while (!lines_.next_is("META_STOP")) {
      const KvnLine line = lines_.take(metadata.comments);
      if (line.value.empty() || line.keyword.empty()) fail_in_metadata(line);
      seen.add(lines_, line);
      if (!ccsds::read_metadata(lines_, line, metadata)) read_oem_keyword(line, metadata);
      if (line.keyword == "TIME_SYSTEM") time_system_line_ = line.number;
    }
    const KvnLine stop = lines_.take(metadata.comments);
    seen.require(lines_, stop.number,
                 {"OBJECT_NAME", "OBJECT_ID", "CENTER_NAME", "REF_FRAME", "TIME_SYSTEM",
                  "START_TIME", "STOP_TIME"});
    require_ordered_times(stop.number, metadata);
  }

  void read_oem_keyword(const KvnLine& line, OemMetadata& metadata) {
    if (line.keyword == "START_TIME") {
      metadata.start_time = lines_.epoch(line);
    } else if (line.keyword == "STOP_TIME") {
      metadata.stop_time = lines_.epoch(line);
    } else if (line.keyword == "USEABLE_START_TIME") {
      metadata.useable_start_time = lines_.epoch(line);
    } else if (line.keyword == "USEABLE_STOP_TIME") {
      metadata.useable_stop_time = lines_.epoch(line);
    } else if (line.keyword == "INTERPOLATION") {
      metadata.interpolation = interpolation(line);
    } else if (line.keyword == "INTERPOLATION_DEGREE") {
      metadata.interpolation_degree = lines_.integer(line, 1, kHighestDegree);
    } else {
      fail_in_metadata(line);
    }
  }

  [[noreturn]] void fail_in_metadata(const KvnLine& line) const {
    lines_.fail(line.number,
                (line.keyword.empty() ? ccsds::quoted(line.value) : std::string(line.keyword)) +
                    " is not a keyword of an OEM's metadata");
  }

  InterpolationMethod interpolation(const KvnLine& line) const {
    std::string method(line.value);
    for (char& c : method) {
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    }
    if (method == "LINEAR") return InterpolationMethod::kLinear;
    if (method == "LAGRANGE") return InterpolationMethod::kLagrange;
    if (method == "HERMITE") return InterpolationMethod::kHermite;
    lines_.fail(line.number, "INTERPOLATION is " + ccsds::quoted(line.value) +
                                 "; accepted: LINEAR, LAGRANGE, HERMITE");
  }

  void require_ordered_times(int line, const OemMetadata& m) const {
    const CcsdsEpoch from = m.useable_start_time.value_or(m.start_time);
    const CcsdsEpoch until = m.useable_stop_time.value_or(m.stop_time);
    if (m.start_time <= from && from <= until && until <= m.stop_time) return;
    lines_.fail(line, "times out of order: START_TIME " + to_text(m.start_time) +
                          ", useable from " + to_text(from) + " until " + to_text(until) +
                          ", STOP_TIME " + to_text(m.stop_time));
  }

  void require_one_time_system(const OemMetadata& metadata) const {
    if (oem_.segments.empty()) return;
    const TimeSystem first = oem_.segments.front().metadata.time_system;
    if (metadata.time_system != first)
      lines_.fail(time_system_line_,
                  "TIME_SYSTEM is " + std::string(name_of(metadata.time_system)) +
                      ", that of the first segment " + std::string(name_of(first)) +
                      "; one message has one time system");
  }

  // ---- data

  void read_states(OemSegment& segment) {
    while (const KvnLine* const next = lines_.peek()) {
      if (next->keyword == "META_START" || next->keyword == "COVARIANCE_START") break;
      if (!next->keyword.empty())
        lines_.fail(next->number, std::string(next->keyword) + " within ephemeris data");
      add_state(lines_.take(segment.comments), segment);
    }
    if (segment.states.empty()) lines_.fail("a segment without ephemeris data");
  }

  void add_state(const KvnLine& line, OemSegment& segment) {
    const std::vector<std::string_view> word = ccsds::words_of(line.value);
    if (word.size() != 7 && word.size() != 10)
      lines_.fail(line.number, std::to_string(word.size()) +
                                   " columns; accepted: 7, epoch x y z x_dot y_dot z_dot, or 10, "
                                   "with the acceleration");
    OemState state;
    state.epoch = lines_.epoch(line.number, word[0], "epoch");
    state.r_km = vector(line, word, 1);
    state.v_kmps = vector(line, word, 4);
    if (word.size() == 10) state.a_kmps2 = vector(line, word, 7);
    require_in_order(line.number, state, segment);
    // A line repeated exactly says nothing new.
    if (segment.states.empty() || !(state == segment.states.back()))
      segment.states.push_back(state);
  }

  Vec3 vector(const KvnLine& line, const std::vector<std::string_view>& word,
              std::size_t first) const {
    constexpr std::array<const char*, 10> kColumns = {
        "epoch", "x", "y", "z", "x_dot", "y_dot", "z_dot", "x_ddot", "y_ddot", "z_ddot"};
    const auto number = [&](std::size_t i) {
      return lines_.number(line.number, word[i], kColumns[i]);
    };
    return {number(first), number(first + 1), number(first + 2)};
  }

  void require_in_order(int line, const OemState& state, const OemSegment& segment) const {
    const OemMetadata& m = segment.metadata;
    if (state.epoch < m.start_time || state.epoch > m.stop_time)
      lines_.fail(line, "epoch " + to_text(state.epoch) + " is outside START_TIME " +
                            to_text(m.start_time) + " to STOP_TIME " + to_text(m.stop_time));
    if (segment.states.empty()) return;
    const OemState& last = segment.states.back();
    if (state.epoch > last.epoch || state == last) return;
    lines_.fail(line, "epoch " + to_text(state.epoch) +
                          " does not follow that of the line before, " + to_text(last.epoch));
  }

  // ---- covariances

  void read_covariances(OemSegment& segment) {
    std::vector<std::string>& comments = segment.covariance_comments;
    lines_.take("COVARIANCE_START", comments);
    do {
      OemCovariance covariance;
      covariance.epoch = lines_.epoch(lines_.take("EPOCH", comments));
      if (lines_.next_is("COV_REF_FRAME"))
        covariance.ref_frame = ccsds::frame(lines_, lines_.take(comments), true);
      read_triangle(covariance.lower_triangle, comments);
      segment.covariances.push_back(std::move(covariance));
      require_covariance_end();
    } while (!lines_.next_is("COVARIANCE_STOP"));
    lines_.take(comments);
    if (lines_.peek() != nullptr && !lines_.next_is("META_START"))
      lines_.take("META_START", comments);
  }

  void read_triangle(OdmCovariance& triangle, std::vector<std::string>& comments) {
    std::size_t next = 0;
    for (std::size_t row = 1; row <= 6; ++row) {
      const KvnLine line = lines_.take(comments);
      const std::string name = "row " + std::to_string(row) + " of the covariance";
      if (!line.keyword.empty())
        lines_.fail(line.number, std::string(line.keyword) + " where " + name + " should be");
      const std::vector<std::string_view> word = ccsds::words_of(line.value);
      if (word.size() != row)
        lines_.fail(line.number, name + " has " + std::to_string(word.size()) +
                                     " columns; accepted: " + std::to_string(row));
      for (const std::string_view w : word) triangle[next++] = lines_.number(line.number, w, name);
    }
  }

  void require_covariance_end() {
    const KvnLine* const next = lines_.peek();
    if (next == nullptr) lines_.fail("cut short: COVARIANCE_STOP is missing");
    if (next->keyword == "EPOCH" || next->keyword == "COVARIANCE_STOP") return;
    lines_.fail(next->number,
                (next->keyword.empty() ? "a seventh row" : std::string(next->keyword)) +
                    " within a covariance; accepted: EPOCH, COVARIANCE_STOP");
  }

  KvnLines lines_;
  Oem oem_;
  int time_system_line_ = 0;
};

}  // namespace

Oem parse_oem(std::string_view text, std::string_view source_name) {
  return OemReader(text, source_name).read();
}

Oem load_oem(const std::string& path) {
  return parse_oem(text::read_file(path, "load_oem"), path);
}

}  // namespace orrery
