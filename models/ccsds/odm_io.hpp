/// Reading and writing what orbit data messages have in common. Not installed.
#pragma once

#include <orrery/models/ccsds/kvn.hpp>
#include <orrery/models/ccsds/odm.hpp>

namespace orrery::ccsds {

/// `version_keyword` must open the message: "CCSDS_OPM_VERS".
OdmHeader read_header(KvnLines& lines, std::string_view version_keyword);
void write_header(KvnWriter& out, std::string_view version_keyword, const OdmHeader& header);

/// A frame of CCSDS 502.0-B or of the SANA registry. `with_local`: frames that move with the object
/// (RTN, TNW, ...), which manoeuvres and covariances may be in, count as well.
std::string frame(const KvnLines& lines, const KvnLine& line, bool with_local);

/// Stores the value of a keyword that both messages have in their metadata; false if it is none of
/// them.
bool read_metadata(KvnLines& lines, const KvnLine& line, OdmMetadata& metadata);
/// Up to REF_FRAME_EPOCH and TIME_SYSTEM.
void write_metadata(KvnWriter& out, const OdmMetadata& metadata);

/// Refuses keywords that come twice, and missing ones.
class KeywordsSeen {
 public:
  void add(const KvnLines& lines, const KvnLine& line);
  /// Fails at `line` if one of `keywords` has not come.
  void require(const KvnLines& lines, int line, std::initializer_list<const char*> keywords) const;

 private:
  std::vector<std::string_view> seen_;
};

/// Names of frames and centres: capitals, with one blank where there are blanks, dashes or
/// underscores.
std::string canonical(std::string_view name);
/// ITRF, ITRF2014, ITRF-97, as canonical() gives them.
bool is_itrf(std::string_view canonical_name);

/// Metres; the frame is for the caller to check. @throws std::invalid_argument  naming `function`,
/// for a centre or frame other than the Earth and EME2000.
void require_geocentric_eme2000(const OdmMetadata& metadata, const char* function);

}  // namespace orrery::ccsds
