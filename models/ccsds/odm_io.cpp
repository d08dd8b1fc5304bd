#include <orrery/models/ccsds/odm_io.hpp>

#include <algorithm>
#include <stdexcept>

namespace orrery {
namespace ccsds {

std::string canonical(std::string_view name) {
  std::string text;
  for (const char c : name) {
    const bool gap = c == ' ' || c == '\t' || c == '-' || c == '_';
    if (gap && (text.empty() || text.back() == ' ')) continue;
    text += gap ? ' ' : (c >= 'a' && c <= 'z') ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return text;
}

namespace {

template <class Names>
bool contains(const Names& names, std::string_view name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

bool is_centre(std::string_view name) {
  constexpr std::string_view kOthers[] = {"SUN",   "MOON",  "EARTH MOON BARYCENTER",
                                          "EMB",   "SSB",   "SOLAR SYSTEM BARYCENTER",
                                          "CERES", "VESTA", "PHOBOS",
                                          "DEIMOS"};
  constexpr std::string_view kPlanets[] = {"MERCURY", "VENUS",  "EARTH",   "MARS", "JUPITER",
                                           "SATURN",  "URANUS", "NEPTUNE", "PLUTO"};
  constexpr std::string_view kBarycentre = " BARYCENTER";
  std::string centre = canonical(name);
  if (contains(kOthers, centre)) return true;
  if (centre.ends_with(kBarycentre)) centre.resize(centre.size() - kBarycentre.size());
  return contains(kPlanets, centre);
}

bool all_digits(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

bool is_orbit_frame(std::string_view name) {
  constexpr std::string_view kFrames[] = {
      "EME2000", "J2000",     "GCRF",        "GRC",         "ICRF",        "MCI",
      "TDR",     "TEME",      "TEMEOFDATE",  "TEMEOFEPOCH", "TOD",         "TOD EARTH",
      "MOD",     "MOD EARTH", "TOE EARTH",   "MOE EARTH",   "CIRS",        "GTOD",
      "EFG",     "WGS84",     "FIXED EARTH", "FIXED CB",    "ALIGN EARTH", "ALIGN CB",
      "TOD CB",  "MOD CB",    "TOE CB",      "MOE CB",      "B1950",       "UVW GO INERTIAL"};
  const std::string frame = canonical(name);
  return contains(kFrames, frame) || is_itrf(frame);
}

bool is_local_frame(std::string_view name) {
  constexpr std::string_view kFrames[] = {"RSW", "RTN", "TNW", "QSW", "LVLH", "NTW",
                                          "NSW", "VNC", "PQW", "SEZ", "EQW"};
  std::string frame = canonical(name);
  for (const std::string_view suffix : {" INERTIAL", " ROTATING"}) {
    if (frame.ends_with(suffix)) frame.resize(frame.size() - suffix.size());
  }
  return contains(kFrames, frame);
}

std::string centre(const KvnLines& lines, const KvnLine& line) {
  if (!is_centre(line.value))
    lines.fail(line.number, "CENTER_NAME " + quoted(line.value) +
                                " is unknown; accepted: a planet, the Sun, the Moon, a barycenter");
  return lines.text(line);
}

std::string object_id(const KvnLines& lines, const KvnLine& line) {
  if (line.value.find_first_of(" \t") != std::string_view::npos)
    lines.fail(line.number, "OBJECT_ID " + quoted(line.value) +
                                " is not a designator; accepted: like 1998-067A, without blanks");
  return lines.text(line);
}

TimeSystem time_system(const KvnLines& lines, const KvnLine& line) {
  const std::optional<TimeSystem> system = time_system_named(line.value);
  if (!system)
    lines.fail(line.number,
               "TIME_SYSTEM " + quoted(line.value) +
                   " is unknown; accepted: UTC TAI GPS TT TDB TCB TCG UT1 GMST MET MRT "
                   "SCLK");
  return *system;
}

}  // namespace

bool is_itrf(std::string_view canonical_name) {
  if (!canonical_name.starts_with("ITRF")) return false;
  std::string_view year = canonical_name.substr(4);
  if (year.starts_with(' ')) year.remove_prefix(1);
  return (year.empty() || year.size() == 2 || year.size() == 4) && all_digits(year);
}

OdmHeader read_header(KvnLines& lines, std::string_view version_keyword) {
  OdmHeader header;
  const KvnLine* const first = lines.peek();
  if (first == nullptr) lines.fail("cut short: the message is empty");
  if (first->keyword != version_keyword)
    lines.fail(first->number, "the message begins with " +
                                  quoted(first->keyword.empty() ? first->value : first->keyword) +
                                  "; accepted: " + std::string(version_keyword));
  const KvnLine version = lines.take(header.comments);
  if (version.value != "1.0" && version.value != "2.0" && version.value != "3.0")
    lines.fail(version.number, "version " + quoted(version.value) + "; accepted: 1.0, 2.0, 3.0");
  header.version = version.value;
  if (lines.next_is("CLASSIFICATION"))
    header.classification = lines.text(lines.take(header.comments));
  header.creation_date = lines.epoch(lines.take("CREATION_DATE", header.comments));
  header.originator = lines.text(lines.take("ORIGINATOR", header.comments));
  if (lines.next_is("MESSAGE_ID")) header.message_id = lines.text(lines.take(header.comments));
  return header;
}

void write_header(KvnWriter& out, std::string_view version_keyword, const OdmHeader& header) {
  out.text(version_keyword, header.version);
  out.comments(header.comments);
  out.optional_text("CLASSIFICATION", header.classification);
  out.epoch("CREATION_DATE", header.creation_date);
  out.text("ORIGINATOR", header.originator);
  out.optional_text("MESSAGE_ID", header.message_id);
}

std::string frame(const KvnLines& lines, const KvnLine& line, bool with_local) {
  if (!is_orbit_frame(line.value) && !(with_local && is_local_frame(line.value)))
    lines.fail(line.number,
               std::string(line.keyword) + " " + quoted(line.value) +
                   " is unknown; accepted: EME2000, GCRF, ICRF, ITRF2014, TEME, TOD, ..." +
                   (with_local ? ", RTN, TNW, ..." : ""));
  return lines.text(line);
}

bool read_metadata(KvnLines& lines, const KvnLine& line, OdmMetadata& metadata) {
  if (line.keyword == "OBJECT_NAME") {
    metadata.object_name = lines.text(line);
  } else if (line.keyword == "OBJECT_ID") {
    metadata.object_id = object_id(lines, line);
  } else if (line.keyword == "CENTER_NAME") {
    metadata.center_name = centre(lines, line);
  } else if (line.keyword == "REF_FRAME") {
    metadata.ref_frame = frame(lines, line, false);
  } else if (line.keyword == "REF_FRAME_EPOCH") {
    metadata.ref_frame_epoch = lines.epoch(line);
  } else if (line.keyword == "TIME_SYSTEM") {
    metadata.time_system = time_system(lines, line);
  } else {
    return false;
  }
  return true;
}

void write_metadata(KvnWriter& out, const OdmMetadata& metadata) {
  out.comments(metadata.comments);
  out.text("OBJECT_NAME", metadata.object_name);
  out.text("OBJECT_ID", metadata.object_id);
  out.text("CENTER_NAME", metadata.center_name);
  out.text("REF_FRAME", metadata.ref_frame);
  out.optional_epoch("REF_FRAME_EPOCH", metadata.ref_frame_epoch);
  out.text("TIME_SYSTEM", name_of(metadata.time_system));
}

void KeywordsSeen::add(const KvnLines& lines, const KvnLine& line) {
  if (contains(seen_, line.keyword))
    lines.fail(line.number, std::string(line.keyword) + " is given twice");
  seen_.push_back(line.keyword);
}

void KeywordsSeen::require(const KvnLines& lines, int line,
                           std::initializer_list<const char*> keywords) const {
  for (const char* keyword : keywords) {
    if (!contains(seen_, keyword))
      lines.fail(line, "the metadata end without " + std::string(keyword));
  }
}

void require_geocentric_eme2000(const OdmMetadata& metadata, const char* function) {
  if (is_geocentric_eme2000(metadata)) return;
  throw std::invalid_argument(std::string(function) + ": the state of " + metadata.object_name +
                              " is in REF_FRAME " + metadata.ref_frame + " about " +
                              metadata.center_name + "; accepted: EME2000 about EARTH");
}

}  // namespace ccsds

bool is_geocentric_eme2000(const OdmMetadata& metadata) {
  const std::string frame = ccsds::canonical(metadata.ref_frame);
  return ccsds::canonical(metadata.center_name) == "EARTH" &&
         (frame == "EME2000" || frame == "J2000");
}

}  // namespace orrery
