#include <orrery/models/ccsds/odm_io.hpp>
#include <orrery/models/ccsds/oem.hpp>

namespace orrery {
namespace {

using ccsds::KvnWriter;

std::string_view name_of(InterpolationMethod method) {
  switch (method) {
    case InterpolationMethod::kLinear:
      return "LINEAR";
    case InterpolationMethod::kLagrange:
      return "LAGRANGE";
    default:
      return "HERMITE";
  }
}

void write(KvnWriter& out, const OemMetadata& metadata) {
  out.line("META_START");
  ccsds::write_metadata(out, metadata);
  out.epoch("START_TIME", metadata.start_time);
  out.optional_epoch("USEABLE_START_TIME", metadata.useable_start_time);
  out.optional_epoch("USEABLE_STOP_TIME", metadata.useable_stop_time);
  out.epoch("STOP_TIME", metadata.stop_time);
  if (metadata.interpolation) out.text("INTERPOLATION", name_of(*metadata.interpolation));
  if (metadata.interpolation_degree)
    out.text("INTERPOLATION_DEGREE", std::to_string(*metadata.interpolation_degree));
  out.line("META_STOP");
}

void write(KvnWriter& out, const OemState& s) {
  const Vec3 a_kmps2 = s.a_kmps2.value_or(Vec3{});
  const std::array<double, 9> numbers = {s.r_km.x,   s.r_km.y,  s.r_km.z,  s.v_kmps.x, s.v_kmps.y,
                                         s.v_kmps.z, a_kmps2.x, a_kmps2.y, a_kmps2.z};
  out.data(to_text(s.epoch), numbers.data(), s.a_kmps2 ? 9 : 6);
}

void write(KvnWriter& out, const OemCovariance& covariance) {
  out.epoch("EPOCH", covariance.epoch);
  out.optional_text("COV_REF_FRAME", covariance.ref_frame);
  const double* row = covariance.lower_triangle.data();
  for (std::size_t columns = 1; columns <= 6; row += columns, ++columns) out.data("", row, columns);
}

void write(KvnWriter& out, const OemSegment& segment) {
  out.line("");
  write(out, segment.metadata);
  out.comments(segment.comments);
  for (const OemState& state : segment.states) write(out, state);
  if (segment.covariances.empty()) return;
  out.line("COVARIANCE_START");
  out.comments(segment.covariance_comments);
  for (const OemCovariance& covariance : segment.covariances) write(out, covariance);
  out.line("COVARIANCE_STOP");
}

}  // namespace

std::string write_oem(const Oem& oem) {
  KvnWriter out("write_oem");
  ccsds::write_header(out, "CCSDS_OEM_VERS", oem.header);
  for (const OemSegment& segment : oem.segments) write(out, segment);
  std::string text = out.take();
  // Order of epochs, names of frames: what is written can be read, or is refused here.
  parse_oem(text, "write_oem");
  return text;
}

}  // namespace orrery
