// Logs of real NovAtel receivers and their ASCII twins (novatel/README.md of the reference data):
// what the flight software's decoder reads is what the twin prints, and the simulator's encoder
// gives back the receiver's bytes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <sstream>
#include <string>

#include "novatel_log_files.hpp"

namespace orrery::novatel {
namespace {

using Tokens = std::vector<std::string>;

const std::map<std::string, int> kLogs = {
    {"GPSEPHEM", 7},   {"VERSION", 37},  {"BESTPOS", 42},     {"RANGE", 43},
    {"PSRPOS", 47},    {"RXSTATUS", 93}, {"BESTVEL", 99},     {"PSRVEL", 100},
    {"RANGECMP", 140}, {"PSRDOP", 174},  {"RXHWLEVELS", 195}, {"BESTXYZ", 241},
    {"PSRXYZ", 243},   {"SATXYZ", 270},  {"BSLNXYZ", 686},    {"BESTUTM", 726}};

// What the twins write in place of a number.
const std::map<std::string, double> kWords = {
    {"FINESTEERING", 180},   {"SATTIME", 200}, {"COM1", 0x20}, {"SOL_COMPUTED", 0},
    {"INSUFFICIENT_OBS", 1}, {"NONE", 0},      {"SINGLE", 16}, {"DOPPLER_VELOCITY", 8},
    {"WGS84", 61},           {"TRUE", 1},      {"FALSE", 0},   {"GPSCARD", 1}};

Tokens split(const std::string& text, char at) {
  Tokens tokens;
  std::istringstream stream(text);
  for (std::string token; std::getline(stream, token, at);) tokens.push_back(token);
  return tokens;
}

// One line "#NAMEA,header;body*crc".
struct AsciiLog {
  std::string name;
  Tokens header, body;
};

std::vector<AsciiLog> ascii_logs(const std::string& text) {
  std::vector<AsciiLog> logs;
  for (const std::string& line : split(text, '\n')) {
    const std::size_t semicolon = line.find(';');
    const std::size_t star = line.find('*');
    if (line.empty() || line[0] != '#' || star == std::string::npos) continue;
    // The twin's CRC is the binary one, over what is between # and *.
    const std::string covered = line.substr(1, star - 1);
    EXPECT_EQ(crc32(std::as_bytes(std::span(covered))),
              std::stoul(line.substr(star + 1), nullptr, 16))
        << line.substr(0, 40);
    Tokens header = split(line.substr(1, semicolon - 1), ',');
    const std::string name = header[0].substr(0, header[0].size() - 1);
    if (name == "SENDA" || name == "SEND") continue;  // an echo of a command, not in the binary
    logs.push_back({name, header, split(line.substr(semicolon + 1, star - semicolon - 1), ',')});
  }
  return logs;
}

// A decoded value beside what the twin prints, taken from the front of its tokens.
class Twin {
 public:
  Twin(const Tokens& tokens, std::string where) : tokens_(tokens), where_(std::move(where)) {}
  ~Twin() { EXPECT_EQ(at_, tokens_.size()) << where_ << ": fields left over"; }

  // Half a unit of the last digit printed, and the rounding of the printed decimal to binary.
  Twin& number(double value) {
    const std::string token = next();
    const auto word = kWords.find(token);
    if (word != kWords.end()) {
      EXPECT_EQ(value, word->second) << where() << token;
      return *this;
    }
    const double printed = std::stod(token);
    EXPECT_NEAR(value, printed, 0.5 * last_digit(token) + 1e-15 * std::abs(printed))
        << where() << token;
    return *this;
  }
  Twin& numbers(std::initializer_list<double> values) {
    for (const double value : values) number(value);
    return *this;
  }
  Twin& hex(std::uint32_t value) {
    const std::string token = next();
    EXPECT_EQ(value, std::stoul(token, nullptr, 16)) << where() << token;
    return *this;
  }
  Twin& text(const std::string& value) {
    EXPECT_EQ('"' + value + '"', next()) << where();
    return *this;
  }

 private:
  std::string next() { return at_ < tokens_.size() ? tokens_[at_++] : (++at_, "0"); }
  std::string where() const { return where_ + ", field " + std::to_string(at_) + ": "; }

  // 1 in the last place of "-8.595e-01": 1e-4; of "12": 0, for it is exact.
  static double last_digit(const std::string& token) {
    const std::size_t point = token.find('.');
    if (point == std::string::npos) return 0;
    const std::size_t e = std::min(token.find('e'), token.size());
    const int exponent = e < token.size() ? std::stoi(token.substr(e + 1)) : 0;
    return std::pow(10.0, exponent - static_cast<int>(e - point - 1));
  }

  const Tokens& tokens_;
  std::string where_;
  std::size_t at_ = 0;
};

void compare_header(const novatel_header& h, const Tokens& tokens) {
  const Tokens fields(tokens.begin() + 1, tokens.end());
  Twin(fields, tokens[0] + " header")
      .numbers({double(h.port_address), double(h.sequence), 0.5 * h.idle_time_half_percent,
                double(h.time_status), double(h.week), 1e-3 * h.ms})
      .hex(h.receiver_status)
      .hex(h.reserved)
      .numbers({double(h.software_build)});
}

std::string station(const char (&id)[4]) {
  return {id, strnlen(id, 4)};
}

void compare(const novatel_bestpos& m, Twin twin) {
  twin.numbers({double(m.status), double(m.type), m.latitude_deg, m.longitude_deg, m.height_msl_m,
                m.undulation_m, double(m.datum), m.sigma_latitude_m, m.sigma_longitude_m,
                m.sigma_height_m})
      .text(station(m.station_id))
      .numbers({m.differential_age_s, m.solution_age_s, double(m.satellites_tracked),
                double(m.satellites_used), double(m.satellites_used_L1),
                double(m.satellites_used_multi_frequency), double(m.reserved)})
      .hex(m.extended_solution_status)
      .hex(m.galileo_beidou_mask)
      .hex(m.gps_glonass_mask);
}

void compare(const novatel_bestxyz& m, Twin twin) {
  twin.numbers({double(m.position_status), double(m.position_type), m.r_ECEF[0], m.r_ECEF[1],
                m.r_ECEF[2], m.sigma_r_ECEF[0], m.sigma_r_ECEF[1], m.sigma_r_ECEF[2],
                double(m.velocity_status), double(m.velocity_type), m.v_ECEF[0], m.v_ECEF[1],
                m.v_ECEF[2], m.sigma_v_ECEF[0], m.sigma_v_ECEF[1], m.sigma_v_ECEF[2]})
      .text(station(m.station_id))
      .numbers({m.velocity_latency_s, m.differential_age_s, m.solution_age_s,
                double(m.satellites_tracked), double(m.satellites_used),
                double(m.satellites_used_L1), double(m.satellites_used_multi_frequency),
                double(m.reserved)})
      .hex(m.extended_solution_status)
      .hex(m.galileo_beidou_mask)
      .hex(m.gps_glonass_mask);
}

void compare(const novatel_gpsephem& m, Twin twin) {
  twin.numbers({double(m.prn),
                m.tow_s,
                double(m.health),
                double(m.iode1),
                double(m.iode2),
                double(m.week),
                double(m.z_week),
                m.toe_s,
                m.semi_major_axis_m,
                m.delta_n_radps,
                m.mean_anomaly_rad,
                m.eccentricity,
                m.argument_of_perigee_rad,
                m.cuc_rad,
                m.cus_rad,
                m.crc_m,
                m.crs_m,
                m.cic_rad,
                m.cis_rad,
                m.i0_rad,
                m.i_rate_radps,
                m.raan0_rad,
                m.raan_rate_radps,
                double(m.iodc),
                m.toc_s,
                m.tgd_s,
                m.af0_s,
                m.af1_sps,
                m.af2_sps2,
                double(m.anti_spoofing),
                m.corrected_mean_motion_radps,
                m.ura_variance_m2});
}

void compare_range(const novatel_frame& frame, Twin& twin) {
  twin.number(novatel_count(&frame));
  for (std::uint32_t i = 0; i < novatel_count(&frame); ++i) {
    novatel_observation o;
    ASSERT_TRUE(novatel_get_range(&frame, i, &o));
    twin.numbers({double(o.prn), double(o.glonass_frequency), o.pseudorange_m,
                  o.pseudorange_sigma_m, -o.carrier_phase_cycles, o.carrier_phase_sigma_cycles,
                  o.doppler_Hz, o.cn0_dBHz, o.lock_time_s})
        .hex(o.tracking_status);
  }
}

void compare_version(const novatel_frame& frame, Twin& twin) {
  twin.number(novatel_count(&frame));
  for (std::uint32_t i = 0; i < novatel_count(&frame); ++i) {
    novatel_version_component c;
    ASSERT_TRUE(novatel_get_version(&frame, i, &c));
    twin.number(c.type)
        .text(c.model)
        .text(c.serial_number)
        .text(c.hardware)
        .text(c.software)
        .text(c.boot)
        .text(c.date)
        .text(c.time);
  }
}

// The twin prints each entry as the bytes it is; their meaning is checked against RANGE below.
void compare_rangecmp(const novatel_frame& frame, const Tokens& tokens) {
  ASSERT_EQ(tokens.size(), novatel_count(&frame) + 1);
  ASSERT_EQ(frame.header.body_bytes, 4 + 24 * novatel_count(&frame));
  std::string hex;
  for (unsigned k = 4; k < frame.header.body_bytes; ++k) {
    const char digits[] = "0123456789abcdef";
    hex += digits[frame.body[k] >> 4];
    hex += digits[frame.body[k] & 15];
  }
  std::string printed;
  for (std::size_t i = 1; i < tokens.size(); ++i) printed += tokens[i];
  EXPECT_EQ(hex, printed);
}

template <class Decoded>
void compare_one(const novatel_frame& frame, int (*get)(const novatel_frame*, Decoded*),
                 const AsciiLog& twin) {
  Decoded decoded;
  ASSERT_TRUE(get(&frame, &decoded)) << twin.name;
  compare(decoded, Twin(twin.body, twin.name));
}

void compare_body(const novatel_frame& frame, const AsciiLog& twin) {
  switch (frame.header.message_id) {
    case kBestPosId:
      return compare_one(frame, novatel_get_bestpos, twin);
    case kBestXyzId:
      return compare_one(frame, novatel_get_bestxyz, twin);
    case kGpsEphemId:
      return compare_one(frame, novatel_get_gpsephem, twin);
    case kRangeCmpId:
      return compare_rangecmp(frame, twin.body);
    default:
      break;
  }
  Twin fields(twin.body, twin.name);
  if (frame.header.message_id == kRangeId) compare_range(frame, fields);
  if (frame.header.message_id == kVersionId) compare_version(frame, fields);
}

bool is_decoded(int id) {
  return id == kBestPosId || id == kBestXyzId || id == kGpsEphemId || id == kRangeCmpId ||
         id == kRangeId || id == kVersionId || id == kTimeId;
}

class NovatelLogsTest : public NovatelLogs, public testing::WithParamInterface<const char*> {};

TEST_P(NovatelLogsTest, EveryFieldIsWhatTheAsciiTwinPrints) {
  const std::vector<AsciiLog> twins = ascii_logs(text(std::string(GetParam()) + ".ASC"));
  std::size_t seen = 0, decoded = 0;
  for_each_frame(binary(std::string(GetParam()) + ".GPS"), 100, 8192,
                 [&](const novatel_frame& frame) {
                   ASSERT_LT(seen, twins.size());
                   const AsciiLog& twin = twins[seen++];
                   ASSERT_EQ(frame.header.message_id, kLogs.at(twin.name));
                   compare_header(frame.header, twin.header);
                   if (!is_decoded(frame.header.message_id)) return;
                   ++decoded;
                   compare_body(frame, twin);
                 });
  EXPECT_EQ(seen, twins.size());
  EXPECT_GT(decoded, 1u);
}

TEST_P(NovatelLogsTest, ReencodedLogsAreTheReceiversBytes) {
  const ByteBuffer log = binary(std::string(GetParam()) + ".GPS");
  for_each_frame(log, 33, 8192, [&](const novatel_frame& frame) {
    if (!is_decoded(frame.header.message_id)) return;
    ByteBuffer again;
    ASSERT_TRUE(reencode(frame, again));
    const auto* start = reinterpret_cast<const std::byte*>(frame.body) - kHeaderBytes;
    EXPECT_EQ(again, ByteBuffer(start, start + kHeaderBytes + frame.header.body_bytes + kCrcBytes))
        << frame.header.message_id;
  });
}

INSTANTIATE_TEST_SUITE_P(Pairs, NovatelLogsTest,
                         testing::Values("OneEach", "OnceEachAgain", "MorePropak",
                                         "PropakWithGlonass"),
                         [](const auto& log) { return std::string(log.param); });

}  // namespace
}  // namespace orrery::novatel
