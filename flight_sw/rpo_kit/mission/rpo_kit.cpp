#include "rpo_kit/mission/rpo_kit.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "rpo_kit/imaging/earth_velocity.hpp"
#include "rpo_kit/imaging/star_file.hpp"
#include "rpo_kit/rpo_kit_messages.h"
#include "support/orbit/constants.hpp"
#include "support/symmetric.hpp"

namespace rpo_kit {

using namespace flight_support;

namespace {

using LinkRole = formation_keeping::Role;

LinkRole link_role(Role role) {
  return role == Role::kTarget ? LinkRole::kChief : LinkRole::kDeputy;
}
LinkRole peer(Role role) {
  return role == Role::kTarget ? LinkRole::kDeputy : LinkRole::kChief;
}

// Hamilton's product, w first; q and R turn the same components. @return false: no unit quaternion.
bool matrix_of_quaternion(const double q[4], Mat3* R) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  if (!(std::fabs(w * w + x * x + y * y + z * z - 1.0) < 1e-6)) return false;
  *R = Mat3{{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
  return true;
}

// By the largest component (Shepperd 1978), w not negative.
void quaternion_of_matrix(const Mat3& R, double q[4]) {
  const double t = R(0, 0) + R(1, 1) + R(2, 2);
  const double squares[4] = {t, R(0, 0), R(1, 1), R(2, 2)};
  const long at = std::max_element(squares, squares + 4) - squares;
  if (at == 0) {
    q[0] = 1 + t, q[1] = R(2, 1) - R(1, 2), q[2] = R(0, 2) - R(2, 0), q[3] = R(1, 0) - R(0, 1);
  } else {
    const int i = static_cast<int>(at) - 1, j = (i + 1) % 3, k = (i + 2) % 3;
    q[0] = R(k, j) - R(j, k);
    q[1 + i] = 1 + R(i, i) - R(j, j) - R(k, k);
    q[1 + j] = R(i, j) + R(j, i);
    q[1 + k] = R(i, k) + R(k, i);
  }
  const double size =
      std::copysign(std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), q[0]);
  for (int k = 0; k < 4; ++k) q[k] /= size;
}

// Above that, 1-sigma, the track's attitude is no guess for an image.
constexpr double kMostTurn_rad = 0.2;

// A track within that of where the target should be is the target's.
constexpr double kLeastReach_rad = 1e-3, kReachSigmas = 4.0;

// What a second observer says has to be within: of its own directions, of where it may be while its
// message is on its way, of clocks that differ.
constexpr double kMostSecond_rad = 0.1, kMostSecond_m = 1e6, kAhead_s = 1.0;

// @return false: numbers that no camera has.
bool frame_header(const orrery_image& image, FrameHeader* header) {
  const double* f = image.fx_fy_cx_cy;
  const double* k = image.k1_k2_p1_p2_k3;
  for (int i = 0; i < 4; ++i) {
    if (!(std::fabs(f[i]) < 1e7)) return false;
  }
  for (int i = 0; i < 5; ++i) {
    if (!(std::fabs(k[i]) < 1e7)) return false;
  }
  if (!(f[0] >= 1.0 && f[1] >= 1.0) || !(image.exposure_s >= 0.0 && image.exposure_s < 1e4) ||
      !(image.row_period_s >= 0.0 && image.row_period_s < 1.0) || !(image.gain > 0.0) ||
      image.bits < 1 || image.bits > 16) {
    return false;
  }
  const double open_s = image.exposure_s + image.row_period_s * (image.height - 1.0);
  header->t_ns = image.exposure_begin_ns + nanoseconds(0.5 * open_s);
  header->camera = {static_cast<int>(image.width),
                    static_cast<int>(image.height),
                    f[0],
                    f[1],
                    f[2],
                    f[3],
                    k[0],
                    k[1],
                    k[2],
                    k[3],
                    k[4]};
  header->electrons_per_dn = image.gain;
  header->saturation_dn = (1u << image.bits) - 1.0;
  return true;
}

}  // namespace

struct RpoKit::TargetViews {
  explicit TargetViews(const Configuration& c) {
    const InspectionOptions& i = c.inspection;
    wireframe.set({i.points_B, i.points_B + i.points}, {i.faces, i.faces + i.face_count});
    pixels.resize(static_cast<std::size_t>(c.view_width) * static_cast<std::size_t>(c.view_height));
  }
  Wireframe wireframe;
  KeypointFinder finder{wireframe};
  std::vector<std::uint16_t> pixels;
};

RpoKit::~RpoKit() = default;

RpoKit::RpoKit(Outputs& outputs, const Configuration& configuration, const Boot& boot)
    : out_(outputs),
      configuration_(configuration),
      sender_(link_role(configuration.role), boot.boot_count),
      receiver_(peer(configuration.role)),
      navigation_(configuration.navigation),
      inspection_(configuration.inspection),
      approach_(configuration.approach) {
  novatel_framer_init(&framer_, gnss_room_, sizeof gnss_room_);
  if (is_chaser() && *configuration_.star_catalogue != '\0') {
    char message[160];
    std::vector<Star> stars;
    if (load_stars(configuration_.star_catalogue, &stars, message, sizeof message)) {
      const ImagingOptions& imaging = configuration_.imaging;
      frames_ = std::make_unique<FrameProcessor>(imaging, std::move(stars));
      pixels_.resize(static_cast<std::size_t>(imaging.width) *
                     static_cast<std::size_t>(imaging.height));
    } else {
      out_.log(LogLevel::kError, message);
    }
  }
  if (is_chaser() && configuration_.view_width > 0) {
    views_ = std::make_unique<TargetViews>(configuration_);
  }
  out_.out_mode(boot.now_ns, static_cast<std::uint32_t>(mode()));
  if (is_chaser()) {
    out_.request_tick(boot.now_ns + nanoseconds(configuration_.decision_period_s));
  }
}

bool RpoKit::in_gnss(std::int64_t now_ns, const unsigned char* bytes, std::uint32_t count) {
  const std::uint32_t bad_before = framer_.bad_frames;
  for (std::size_t left = count; left > 0;) {
    const std::size_t taken = novatel_framer_write(&framer_, bytes, left);
    bytes += taken;
    left -= taken;
    novatel_frame frame;
    GnssFix fix;
    while (novatel_framer_next(&framer_, &frame) != 0) {
      if (!read_fix(frame, &fix)) continue;
      const bool stale = repeats(last_fix_, fix);
      last_fix_ = fix;
      if (!stale) take_fix(now_ns, fix);
    }
  }
  return framer_.bad_frames == bad_before || reject();
}

EciFix RpoKit::in_eci(const GnssFix& fix) const {
  return {fix.epoch_ns,
          eci_from_ecef(fix.epoch_ns, fix.r_ECEF, fix.v_ECEF, configuration_.earth_time),
          fix.sigma_r_m, fix.sigma_v_mps};
}

// Periods are counted in GPS time, not from boot: so both spacecraft send the same epochs.
void RpoKit::take_fix(std::int64_t, const GnssFix& fix) {
  const std::int64_t slot = fix.epoch_ns / nanoseconds(configuration_.crosslink_period_s);
  if (configuration_.role == Role::kObserver) return;
  if (!is_chaser()) {
    if (slot == last_crosslink_slot_) return;
    last_crosslink_slot_ = slot;
    unsigned char packet[formation_keeping::kCrosslinkBytes];
    sender_.pack(fix, packet);
    out_.out_crosslink(packet, sizeof packet);
    return;
  }
  navigation_.own_fix(in_eci(fix));
}

bool RpoKit::in_crosslink(std::int64_t, const unsigned char* packet, std::uint32_t bytes) {
  using Verdict = formation_keeping::CrosslinkReceiver::Verdict;
  if (receiver_.receive(packet, bytes) != Verdict::kAccepted) return reject();
  if (is_chaser()) navigation_.target_fix(in_eci(receiver_.fix()));
  return true;
}

bool RpoKit::in_command(std::int64_t now_ns, const unsigned char* message, std::uint32_t bytes) {
  unsigned order = 0;
  if (!is_chaser() || rpo_kit_get_command(message, bytes, &order) == 0) return reject();
  decide(now_ns, static_cast<Order>(order));
  return true;
}

bool RpoKit::in_bearing(const Bearing& bearing) {
  const double length = norm(bearing.direction_ECI);
  if (configuration_.role == Role::kTarget || !(std::fabs(length - 1.0) < 1e-6) ||
      !(bearing.sigma_rad > 0.0)) {
    return reject();
  }
  if (!is_chaser()) return send_observation(bearing) || reject();
  navigation_.bearing(bearing);
  return true;
}

// The last fix is of the exposure's time or some seconds off: moved there. Without one that is near
// enough there is nothing to tell.
bool RpoKit::send_observation(const Bearing& bearing) {
  const double apart_s = seconds(bearing.t_ns - last_fix_.epoch_ns);
  if (std::fabs(apart_s) > configuration_.navigation.pairing_s) return false;
  const EciFix fix = in_eci(last_fix_);
  Vec3 r_ECI = fix.state.r_ECI;
  if (apart_s != 0.0) {
    r_ECI = position_ECI(propagate(observer_from_state(fix.t_ns, fix.state), bearing.t_ns).mean);
  }
  const double variance = std::pow(std::hypot(fix.sigma_r_m, fix.sigma_v_mps * apart_s), 2.0);
  rpo_kit_observation o{bearing.t_ns, {}, {variance, 0, 0, variance, 0, variance}, {}, 0.0};
  for (int k = 0; k < 3; ++k) {
    o.r_ECI[k] = r_ECI[k];
    o.direction_ECI[k] = bearing.direction_ECI[k];
  }
  o.sigma_rad = bearing.sigma_rad;
  unsigned char packet[RPO_KIT_OBSERVATION_BYTES];
  rpo_kit_put_observation(packet, &o);
  out_.out_observation(packet, sizeof packet);
  return true;
}

bool RpoKit::in_observation(std::int64_t now_ns, const unsigned char* packet, std::uint32_t bytes) {
  rpo_kit_observation o;
  if (!is_chaser() || !configuration_.second_observer ||
      rpo_kit_get_observation(packet, bytes, &o) == 0) {
    return reject();
  }
  const double* d = o.direction_ECI;
  const double* r = o.r_ECI;
  const double* p = o.covariance_ECI;
  const SecondBearing bearing{o.exposure_ns, vec3(d[0], d[1], d[2]), o.sigma_rad,
                              vec3(r[0], r[1], r[2]),
                              Mat3{{{p[0], p[1], p[2]}, {p[1], p[3], p[4]}, {p[2], p[4], p[5]}}}};
  Mat3 factor;
  const bool sound = std::fabs(norm(bearing.direction_ECI) - 1.0) < 1e-6 && o.sigma_rad > 0.0 &&
                     o.sigma_rad < kMostSecond_rad && is_finite(bearing.covariance_ECI) &&
                     cholesky(bearing.covariance_ECI, &factor) &&
                     o.exposure_ns <= now_ns + nanoseconds(kAhead_s);
  if (!sound) return reject();
  Observer own;
  // Before the first fix of its own orbit it knows no base line.
  if (!navigation_.own_at(now_ns, &own)) return true;
  if (!(norm(bearing.r_ECI - position_ECI(own.mean)) < kMostSecond_m)) return reject();
  navigation_.second_bearing(bearing);
  return true;
}

bool RpoKit::in_pose(const PlaceMeasurement& place) {
  if (!is_chaser() || !is_finite(place.r_TO_ECI) || !is_finite(place.covariance)) return reject();
  navigation_.pose(place);
  return true;
}

bool RpoKit::in_bearing(const unsigned char* message, std::uint32_t bytes) {
  rpo_kit_bearing b;
  if (rpo_kit_get_bearing(message, bytes, &b) == 0) return reject();
  const double* d = b.direction_ECI;
  return in_bearing({b.exposure_ns, vec3(d[0], d[1], d[2]), b.sigma_rad});
}

bool RpoKit::in_keypoints(const unsigned char* message, std::uint32_t bytes) {
  rpo_kit_keypoints k;
  if (!is_chaser() || rpo_kit_get_keypoints(message, bytes, &k) == 0) return reject();
  Sighting sighting;
  sighting.t_ns = k.exposure_ns;
  sighting.attitude_sigma_rad = k.attitude_sigma_rad;
  if (!matrix_of_quaternion(k.q_CI, &sighting.R_CI)) return reject();
  for (std::uint32_t i = 0; i < k.count; ++i) {
    const rpo_kit_keypoint& at = k.seen[i];
    if (!(at.sigma_px > 0.0) || at.point >= static_cast<unsigned>(kMostPoints)) return reject();
    sighting.seen.push_back({static_cast<int>(at.point), {at.u_px, at.v_px}, at.sigma_px});
  }
  Observer own;
  // Before the first fix of its own orbit it knows no RTN.
  if (navigation_.own_at(k.exposure_ns, &own)) take_sighting(sighting, own);
  return true;
}

void RpoKit::take_sighting(const Sighting& sighting, const Observer& own) {
  const int lost = inspection_.lost();
  const Sighted sighted = inspection_.look(sighting, own);
  if (inspection_.lost() != lost) {
    out_.log(LogLevel::kError, "a covariance of the near range has no Cholesky factor");
  }
  if (sighted.place) navigation_.pose(sighted.measurement);
  if (!navigation_.started() && inspection_.settled()) {
    Matrix6 covariance;
    const StateMeasurement state = inspection_.state(own, &covariance);
    navigation_.start_from_track(state, covariance);
  }
  if (inspection_.tracking()) send_target();
}

bool RpoKit::in_view(const unsigned char* message, std::uint32_t bytes) {
  Sighting sighting;
  double q_CI[4];
  orrery_image image;
  FrameHeader header;
  if (views_ == nullptr ||
      rpo_kit_get_view_head(message, bytes, q_CI, &sighting.attitude_sigma_rad) == 0 ||
      orrery_get_image_header(message + RPO_KIT_VIEW_HEAD_BYTES, bytes - RPO_KIT_VIEW_HEAD_BYTES,
                              &image) == 0 ||
      image.width != static_cast<unsigned>(configuration_.view_width) ||
      image.height != static_cast<unsigned>(configuration_.view_height) ||
      image.rows != image.height || image.first_row != 0 || !frame_header(image, &header) ||
      !(std::fabs(image.offset) < 65536.0) || !(sighting.attitude_sigma_rad >= 0.0) ||
      !(sighting.attitude_sigma_rad < 1.0) || !matrix_of_quaternion(q_CI, &sighting.R_CI)) {
    return reject();
  }
  const unsigned char* from = message + RPO_KIT_VIEW_HEAD_BYTES + ORRERY_IMAGE_HEADER_BYTES;
  for (std::size_t k = 0; k < views_->pixels.size(); ++k) {
    views_->pixels[k] = static_cast<std::uint16_t>(orrery_get_u16(from + 2 * k));
  }
  sighting.t_ns = header.t_ns;
  sighting.camera = &header.camera;
  Observer own;
  if (!navigation_.own_at(header.t_ns, &own)) return true;
  ExpectedPose expected;
  bool known = inspection_.expect(sighting.t_ns, sighting.R_CI, own, &expected);
  double reach_px = 0.0;
  if (known) {
    const double range_m = norm(expected.pose.r_BC_C), radius_m = views_->wireframe.radius_m();
    reach_px = header.camera.fx / range_m *
               std::hypot(radius_m * expected.rotation_sigma_rad, expected.across_sigma_m,
                          radius_m / range_m * expected.along_sigma_m);
    known = expected.rotation_sigma_rad < kMostTurn_rad && range_m > 2.0 * radius_m;
  }
  PixelNoise noise;
  noise.electrons_per_dn = header.electrons_per_dn;
  noise.offset_dn = image.offset;
  const ImageView view{views_->pixels.data(), configuration_.view_width,
                       configuration_.view_height};
  const Vec3 to_sun_C = sighting.R_CI * sun_direction_ECI(sighting.t_ns);
  views_->finder.find(header.camera, view, noise, to_sun_C, known ? &expected.pose : nullptr,
                      reach_px, &sighting.seen);
  if (!sighting.seen.empty()) take_sighting(sighting, own);
  return true;
}

bool RpoKit::in_image(const unsigned char* message, std::uint32_t bytes) {
  orrery_image image;
  if (frames_ == nullptr || orrery_get_image_header(message, bytes, &image) == 0) return reject();
  const ImagingOptions& announced = configuration_.imaging;
  if (image.width != static_cast<unsigned>(announced.width) ||
      image.height != static_cast<unsigned>(announced.height) || image.rows == 0 ||
      image.first_row + image.rows > image.height) {
    return reject();
  }
  FrameHeader header;
  if (!frame_header(image, &header)) return reject();
  if (image.first_row == 0) {
    frame_ = image.frame;
    rows_in_ = 0;
    frame_crc_ = 0;
  }
  if (image.frame != frame_ || image.first_row != rows_in_) return reject();
  std::uint16_t* to = pixels_.data() + std::size_t{image.first_row} * image.width;
  const unsigned char* from = message + ORRERY_IMAGE_HEADER_BYTES;
  for (std::size_t k = 0; k < std::size_t{image.rows} * image.width; ++k) {
    to[k] = static_cast<std::uint16_t>(orrery_get_u16(from + 2 * k));
  }
  rows_in_ += image.rows;
  frame_crc_ = 31u * frame_crc_ + orrery_crc32(from, bytes - ORRERY_IMAGE_HEADER_BYTES);
  if (rows_in_ < image.height) return true;
  // A camera that has frozen sends old stars under a new time: noise never repeats itself.
  if (frame_crc_ == last_frame_crc_) return reject();
  last_frame_crc_ = frame_crc_;
  hot_pixels_.mend(pixels_.data(), announced.width, announced.height);
  look_at_frame(header);
  return true;
}

// In ECI, from the estimate; it may be sigmas off, and near the target more than that.
bool RpoKit::expected_target(std::int64_t t_ns, const Observer& own,
                             ExpectedTarget* expected) const {
  RelativeOrbit chaser;
  Matrix6 covariance;
  if (!navigation_.at(t_ns, &chaser, &covariance)) return false;
  const Vec3 r_ECI = position_ECI(own.mean);
  const Vec3 d = target_position_ECI(own.mean, r_ECI, relative_elements(own.mean, chaser.chief));
  const Matrix6 H =
      rtn_from_relative_elements(chaser.chief.u_rad, mean_motion_radps(chaser.chief.a_m));
  const Matrix6 P = H * covariance * transpose(H);
  expected->range_m = norm(d);
  expected->direction_ECI = (1.0 / expected->range_m) * d;
  // Across the line of sight, which is along the track.
  const double across_m = std::sqrt(P(0, 0) + P(2, 2)) + configuration_.imaging.target_size_m;
  expected->reach_rad = kLeastReach_rad + kReachSigmas * across_m / expected->range_m;
  return true;
}

void RpoKit::look_at_frame(const FrameHeader& header) {
  // Before the first fix of its own orbit it knows no RTN.
  Observer own;
  if (!navigation_.own_at(header.t_ns, &own)) return;
  ExpectedTarget expected;
  const bool known = expected_target(header.t_ns, own, &expected);
  FrameReport report;
  const ImageView view{pixels_.data(), configuration_.imaging.width, configuration_.imaging.height};
  if (!frames_->process(header, view, own, known ? &expected : nullptr, &report)) return;
  if (report.target) {
    Bearing bearing = report.bearing;
    bearing.sigma_rad = std::hypot(bearing.sigma_rad, configuration_.imaging.model_rad);
    navigation_.bearing(bearing);
  }
  send_imaging(report);
}

void RpoKit::in_tick(std::int64_t now_ns) {
  if (!is_chaser()) return;
  decide(now_ns, Order::kNone);
  out_.request_tick(now_ns + nanoseconds(configuration_.decision_period_s));
}

Situation RpoKit::situation(std::int64_t now_ns, const RelativeOrbit* now,
                            const Matrix6& covariance) const {
  Situation s;
  s.t_ns = now_ns;
  s.estimate = now != nullptr;
  s.arrived = approach_.phase() == ApproachPhase::kArrived;
  s.aborted = approach_.phase() == ApproachPhase::kAborted;
  if (now == nullptr) return s;
  const Matrix6 H = rtn_from_relative_elements(now->chief.u_rad, mean_motion_radps(now->chief.a_m));
  const Vector<6> x = H * now->a_roe;
  const Vec3 r = vec3(x[0], x[1], x[2]);
  s.range_m = norm(r);
  const Matrix6 P = H * covariance * transpose(H);
  double variance = 0.0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) variance += r[i] * P(i, j) * r[j];
  }
  s.range_sigma_m = std::sqrt(variance) / std::max(s.range_m, 1e-3);
  s.safe_m = uncertain_safe_m(*now, covariance, configuration_.approach.go_sigmas);
  return s;
}

void RpoKit::decide(std::int64_t now_ns, Order order) {
  navigation_.process(now_ns);
  RelativeOrbit now;
  Matrix6 covariance;
  const bool known = navigation_.at(now_ns, &now, &covariance);
  const Mode before = mode();
  const Mode after = autonomy_.decide(situation(now_ns, known ? &now : nullptr, covariance), order);
  if (after != before) {
    change_mode(after, now);
    out_.out_mode(now_ns, static_cast<std::uint32_t>(after));
  }
  if (known) {
    guide(now, covariance);
    send_estimate(now, covariance);
  }
  const std::int64_t slot = now_ns / nanoseconds(configuration_.telemetry_period_s);
  if (slot == last_telemetry_slot_) return;
  last_telemetry_slot_ = slot;
  send_telemetry(now_ns, known ? &now : nullptr, covariance);
}

void RpoKit::change_mode(Mode mode, const RelativeOrbit& now) {
  char line[96];
  std::snprintf(line, sizeof line, "mode %u: %s", static_cast<unsigned>(mode), autonomy_.reason());
  out_.log(LogLevel::kInfo, line);
  if (mode == Mode::kApproaching) {
    approach_.resume(now);
  } else if (mode == Mode::kHolding || mode == Mode::kSafe) {
    approach_.hold();
  } else if (mode == Mode::kAborting && !approach_.abort(now)) {
    out_.log(LogLevel::kError, "no way to abort");
  }
}

void RpoKit::guide(const RelativeOrbit& now, const Matrix6& covariance) {
  const bool moving =
      mode() == Mode::kApproaching || mode() == Mode::kInspecting || mode() == Mode::kAborting;
  if (!moving) return;
  Burn burn;
  while (approach_.decide(now, covariance, configuration_.burn_lead_s, &burn)) {
    command_burn(now, burn);
  }
}

// The burn is in the chaser's RTN at its instant.
void RpoKit::command_burn(const RelativeOrbit& now, const Burn& burn) {
  Observer own;
  if (!navigation_.own_at(burn.t_ns, &own)) return;
  const StateEci state = state_from_osculating(osculating_from_mean(own.mean));
  const Vec3 dv_ECI = transpose(eci_to_rtn(state)) * burn.dv_RTN;
  const double dv[3] = {dv_ECI[0], dv_ECI[1], dv_ECI[2]};
  // What the thruster did not take will not happen, and must not be in the filter.
  if (!out_.out_maneuver(burn.t_ns, dv)) {
    out_.log(LogLevel::kError, "the thruster refused a burn");
    return;
  }
  navigation_.burn(burn.t_ns, dv_ECI);
  inspection_.burn(burn.t_ns, burn.dv_RTN,
                   burn_covariance(burn.dv_RTN, configuration_.navigation.burn_fraction,
                                   configuration_.navigation.burn_direction_rad));
  delta_v_mps_ += norm(burn.dv_RTN);
  ++burns_;
  char line[128];
  std::snprintf(line, sizeof line, "burn %u in %.0f s: RTN %.2f %.2f %.2f mm/s, a*dl %.0f m",
                burns_, seconds(burn.t_ns - now.t_ns), 1e3 * burn.dv_RTN[0], 1e3 * burn.dv_RTN[1],
                1e3 * burn.dv_RTN[2], now.a_roe[kDl]);
  out_.log(LogLevel::kInfo, line);
}

void RpoKit::send_estimate(const RelativeOrbit& now, const Matrix6& covariance) {
  const StateEci target = state_from_osculating(osculating_from_mean(now.chief));
  const OrbitElements chaser = apply_relative_elements(now.chief, now.a_roe);
  const RelativeStateRtn relative =
      relative_state_rtn(target, state_from_osculating(osculating_from_mean(chaser)));
  const Matrix6 H = rtn_from_relative_elements(now.chief.u_rad, mean_motion_radps(now.chief.a_m));
  const Matrix6 P = H * covariance * transpose(H);
  // A scale that images have in common does not average out. Who has the target's GNSS is rid of
  // it.
  const bool by_scale = navigation_.used(Source::kGnss) == 0 && navigation_.used(Source::kPose) > 0;
  const double scale = by_scale ? configuration_.inspection.filter.scale_error : 0.0;
  RelativeOutput e;
  e.t_ns = now.t_ns;
  for (int k = 0; k < 3; ++k) {
    e.r_DC_RTN[k] = relative.r_DC_RTN[k];
    e.v_DC_RTN[k] = relative.v_DC_RTN[k];
    e.sigma_r_m[k] = std::hypot(std::sqrt(P(k, k)), scale * relative.r_DC_RTN[k]);
    e.sigma_v_mps[k] = std::hypot(std::sqrt(P(k + 3, k + 3)), scale * relative.v_DC_RTN[k]);
  }
  out_.out_estimate(e);
}

void RpoKit::send_imaging(const FrameReport& report) {
  rpo_kit_imaging r;
  std::memset(&r, 0, sizeof r);
  r.exposure_ns = report.t_ns;
  r.sources = static_cast<std::uint32_t>(report.sources);
  r.identified = static_cast<std::uint32_t>(report.identified);
  if (report.lost_in_space) r.found |= RPO_KIT_FOUND_LOST;
  if (report.attitude_known) {
    r.found |= RPO_KIT_FOUND_ATTITUDE;
    quaternion_of_matrix(report.attitude.R_CI, r.q_CI);
    for (int k = 0; k < 3; ++k) {
      r.attitude_sigma_rad[k] = std::sqrt(report.attitude.covariance_C(k, k));
    }
  }
  if (report.target) {
    r.found |= RPO_KIT_FOUND_TARGET;
    for (int k = 0; k < 3; ++k) r.direction_ECI[k] = report.bearing.direction_ECI[k];
    r.sigma_rad = report.bearing.sigma_rad;
    r.u_px = report.pixel.u;
    r.v_px = report.pixel.v;
  }
  unsigned char message[RPO_KIT_IMAGING_BYTES];
  rpo_kit_put_imaging(message, &r);
  out_.out_imaging(message, sizeof message);
}

void RpoKit::send_target() {
  const PoseFilter& filter = inspection_.filter();
  rpo_kit_target t;
  t.t_ns = filter.t_ns();
  quaternion_of_matrix(filter.R_BI(), t.q_BI);
  for (int k = 0; k < 3; ++k) {
    t.omega_BI_B[k] = filter.omega_BI_B()[k];
    t.sigma_rad[k] = std::sqrt(filter.covariance()(kNearRotation + k, kNearRotation + k));
  }
  t.poses = static_cast<std::uint32_t>(inspection_.poses());
  t.flips = static_cast<std::uint32_t>(filter.flips());
  t.rejected = static_cast<std::uint32_t>(filter.rejected());
  t.lost = static_cast<std::uint32_t>(inspection_.lost());
  unsigned char message[RPO_KIT_TARGET_BYTES];
  rpo_kit_put_target(message, &t);
  out_.out_target(message, sizeof message);
}

void RpoKit::send_telemetry(std::int64_t now_ns, const RelativeOrbit* now,
                            const Matrix6& covariance) {
  rpo_kit_telemetry t;
  std::memset(&t, 0, sizeof t);
  t.t_ns = now_ns;
  t.mode = static_cast<std::uint32_t>(mode());
  t.waypoint = static_cast<std::uint32_t>(approach_.waypoint());
  for (int k = 0; k < 6 && now != nullptr; ++k) {
    t.a_roe_m[k] = now->a_roe[k];
    t.sigma_m[k] = std::sqrt(covariance(k, k));
  }
  t.delta_v_mps = delta_v_mps_;
  t.burns = burns_;
  t.used_second = static_cast<std::uint32_t>(navigation_.used(Source::kSecond));
  for (int k = 0; k < 3; ++k) {
    t.used[k] = static_cast<std::uint32_t>(navigation_.used(static_cast<Source>(k)));
  }
  t.outliers = static_cast<std::uint32_t>(navigation_.outliers());
  t.restarts = static_cast<std::uint32_t>(navigation_.restarts());
  t.rejected = rejected_;
  unsigned char packet[RPO_KIT_TELEMETRY_BYTES];
  rpo_kit_put_telemetry(packet, &t);
  out_.out_telemetry(packet, sizeof packet);
}

}  // namespace rpo_kit
