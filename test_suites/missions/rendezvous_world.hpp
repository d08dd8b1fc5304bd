/// A chaser that flies rpo_kit to a target, and the sensors by which it sees it.
///
/// The sensors here stand for camera and image processing: they make directions and keypoints from
/// the truth, with noise, and render no image. What hides a target from a camera hides it from them
/// too: the Earth's shadow, the Sun behind it, faces turned away.
#pragma once

#include <orrery/models/orbit/shadow.hpp>
#include <orrery/models/orbit/sun_moon.hpp>
#include <orrery/orrery.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rpo_kit/rpo_kit_messages.h"

namespace orrery::rendezvous {

constexpr double kArcsec_rad = 4.84813681109536e-6;
constexpr double kDegree_rad = 1.74532925199433e-2;
using TruthOf = std::function<OrbitState()>;

inline const unsigned char* data_of(Bytes bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}
inline Vec3 normal3(RandomStream& random, double sigma) {
  const double x = random.normal();
  const double y = random.normal();
  const double z = random.normal();
  return sigma * Vec3{x, y, z};
}
/// Without its part along a unit vector.
inline Vec3 across(const Vec3& v, const Vec3& axis) {
  return v - dot(v, axis) * axis;
}

/// In sunlight, and not in front of the Sun.
inline bool may_be_seen(SimTime now, const Vec3& r_target, const Vec3& line_of_sight) {
  const Vec3 sun = sun_position_ECI(now);
  if (illumination(shadow_geometry(r_target, sun)) != Illumination::kSunlight) return false;
  return dot(line_of_sight, unit(sun - r_target)) < std::cos(30 * kDegree_rad);
}

struct DirectionOptions {
  Duration period = 120s, latency = 3s;  // between exposures; of read-out and processing
  double sigma_rad = 20 * kArcsec_rad;   // per axis, far away
  double size_m = 0.1;                   // of the target: 1 sigma of where its light comes from
  double nearest_m = 100;                // resolved below that
};

/// Device "bearing": where the target is among the stars, in ECI. Fault "blinded": no image.
class DirectionSensor final : public Device {
 public:
  DirectionSensor(TruthOf target, const DirectionOptions& options)
      : target_(std::move(target)), options_(options) {}
  std::string_view name() const override { return "bearing"; }
  void start(DeviceContext& io) override {
    io.every(options_.period, [this, &io] { expose(io); });
  }

 private:
  void expose(DeviceContext& io) {
    const Vec3 r_target = target_().r_ECI;
    const Vec3 d = r_target - io.truth().r_ECI;
    const double range_m = norm(d);
    const Vec3 noise = normal3(io.random("noise"), 1);
    if (io.fault("blinded", 0) != 0 || range_m < options_.nearest_m) return;
    if (!may_be_seen(io.now(), r_target, unit(d))) return;
    const double sigma_rad = std::hypot(options_.sigma_rad, options_.size_m / range_m);
    const Vec3 seen = unit(unit(d) + sigma_rad * noise);
    const rpo_kit_bearing b{io.onboard_ns(), {seen.x, seen.y, seen.z}, sigma_rad};
    io.after(options_.latency, [&io, b] {
      std::array<std::byte, RPO_KIT_BEARING_BYTES> message;
      rpo_kit_put_bearing(reinterpret_cast<unsigned char*>(message.data()), &b);
      io.to_flight(message);
    });
  }
  TruthOf target_;
  DirectionOptions options_;
};

/// Burns are executed with errors of their own: the difference from the command, as an impulse of
/// this device a millisecond after the burn.
class BurnErrors final : public Device {
 public:
  BurnErrors(double fraction, double angle_rad) : fraction_(fraction), angle_rad_(angle_rad) {}
  std::string_view name() const override { return "burn_errors"; }
  void start(DeviceContext&) override {}
  void from_flight(DeviceContext& io, Bytes bytes) override {
    if (bytes.size() != ORRERY_THRUSTER_BYTES) return;
    std::int64_t mid_burn_ns = 0;
    double dv[3];
    orrery_get_thruster(data_of(bytes), &mid_burn_ns, dv);
    const Vec3 dv_ECI{dv[0], dv[1], dv[2]};
    const Vec3 along = unit(dv_ECI);
    const double size = fraction_ * norm(dv_ECI) * io.random("size").normal();
    const Vec3 aside = across(normal3(io.random("direction"), angle_rad_ * norm(dv_ECI)), along);
    io.after(io.truth_of_onboard(mid_burn_ns) + 1ms - io.now(),
             [&io, error = size * along + aside] { io.apply_impulse(error); });
  }

 private:
  double fraction_, angle_rad_;
};

/// A rigid body without torque; Euler's equations and the quaternion by RK4 of 0.1 s.
struct TumblingBody {
  Quaternion q_BI;
  Vec3 omega_BI_B;
  Vec3 inertia{1.0, 1.4, 1.7};

  void advance(double dt_s) {
    const int steps = static_cast<int>(std::ceil(dt_s / 0.1));
    for (int k = 0; k < steps; ++k) step(dt_s / steps);
  }

 private:
  struct Rates {
    Quaternion q;
    Vec3 w;
  };
  Rates rates(const Quaternion& q, const Vec3& w) const {
    const Quaternion half{0, -0.5 * w.x, -0.5 * w.y, -0.5 * w.z};
    return {half * q,
            {(inertia.y - inertia.z) / inertia.x * w.y * w.z,
             (inertia.z - inertia.x) / inertia.y * w.z * w.x,
             (inertia.x - inertia.y) / inertia.z * w.x * w.y}};
  }
  static Quaternion moved(const Quaternion& q, double h, const Quaternion& d) {
    return {q.w + h * d.w, q.x + h * d.x, q.y + h * d.y, q.z + h * d.z};
  }
  void step(double h) {
    const Rates a = rates(q_BI, omega_BI_B);
    const Rates b = rates(moved(q_BI, h / 2, a.q), omega_BI_B + h / 2 * a.w);
    const Rates c = rates(moved(q_BI, h / 2, b.q), omega_BI_B + h / 2 * b.w);
    const Rates d = rates(moved(q_BI, h, c.q), omega_BI_B + h * c.w);
    for (const auto& [weight, r] : {std::pair{h / 6, a}, {h / 3, b}, {h / 3, c}, {h / 6, d}}) {
      q_BI = moved(q_BI, weight, r.q);
      omega_BI_B = omega_BI_B + weight * r.w;
    }
    const double size =
        std::sqrt(q_BI.w * q_BI.w + q_BI.x * q_BI.x + q_BI.y * q_BI.y + q_BI.z * q_BI.z);
    q_BI = {q_BI.w / size, q_BI.x / size, q_BI.y / size, q_BI.z / size};
  }
};

/// Any attitude, any axis.
inline TumblingBody tumbling_body(RandomStream& random, double rate_radps) {
  const Vec3 axis = unit(normal3(random, 1));
  const double half = random.uniform(0, 3.14159265358979);
  const Vec3 v = std::sin(half) * axis;
  return {{std::cos(half), v.x, v.y, v.z}, rate_radps * unit(normal3(random, 1))};
}
/// Axes of a camera that looks along `z`.
inline Mat3 looking_along(const Vec3& z) {
  const Vec3 x = unit(cross(std::abs(z.z) < 0.8 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, z));
  return {x, cross(z, x), z};
}
/// Of axes, by a small angle.
inline Mat3 small_turn(const Vec3& d) {
  return to_matrix(to_quaternion({{1, d.z, -d.y}, {-d.z, 1, d.x}, {d.y, -d.x, 1}}));
}

/// A body of 0.6 x 0.4 x 0.3 m with two panels, which half a turn about z leaves looking the same.
inline const std::array<Vec3, 12> kKeypoints_B = {{{0.3, 0.2, 0.15},
                                                   {0.3, 0.2, -0.15},
                                                   {0.3, -0.2, 0.15},
                                                   {0.3, -0.2, -0.15},
                                                   {-0.3, 0.2, 0.15},
                                                   {-0.3, 0.2, -0.15},
                                                   {-0.3, -0.2, 0.15},
                                                   {-0.3, -0.2, -0.15},
                                                   {0.1, 0.9, 0},
                                                   {-0.1, 0.9, 0},
                                                   {0.1, -0.9, 0},
                                                   {-0.1, -0.9, 0}}};
constexpr std::size_t kBodyCorners = 8;

struct KeypointOptions {
  Duration period = 20s, latency = 2s;
  double farthest_m = 120;
  double focal_px = 3000, centre_px = 511.5;
  double sigma_px = 0.7;
  double missed = 0.1, wrong = 0.1,
         flipped = 0.125;  // probabilities: two of a keypoint, of an image
  double wrong_px = 40;
  double pointing_rad = 0.01, attitude_rad = 3e-5;  // off the target; of what is known of it
  double rate_radps = 1 * kDegree_rad;              // of the tumbling
};

/// A sensor of the target's attitude, which tumbles in the sensor alone: that of the world points
/// to the zenith.
class TumblingTargetSensor : public Device {
 public:
  /// True attitude and rate, at `t`, not before the last exposure or question.
  const TumblingBody& body(SimTime t) {
    body_.advance(std::chrono::duration<double>(t - body_t_).count());
    body_t_ = t;
    return body_;
  }
  /// Channels "attitude_error_deg" and "attitude_sigma_deg": what flight software made of it.
  void note_attitude(double error_rad, double sigma_rad) {
    if (io_ == nullptr) return;
    io_->record("attitude_error_deg", error_rad / kDegree_rad);
    io_->record("attitude_sigma_deg", sigma_rad / kDegree_rad);
  }
  int images() const { return images_; }

 protected:
  explicit TumblingTargetSensor(TruthOf target) : target_(std::move(target)) {}
  /// In start(); what tumbles goes on through a power cycle.
  void tumble(DeviceContext& io, double rate_radps) {
    if (io_ == nullptr) {
      body_ = tumbling_body(io.random("tumbling"), rate_radps);
      body_t_ = io.now();
    }
    io_ = &io;
  }

  TruthOf target_;
  int images_ = 0;

 private:
  TumblingBody body_;
  SimTime body_t_;
  DeviceContext* io_ = nullptr;
};

/// Device "keypoints": corners of the tumbling target that are turned to the chaser, and the
/// panels', in pixels of a camera that is held on the target. Fault "blinded": no image.
class KeypointSensor final : public TumblingTargetSensor {
 public:
  KeypointSensor(TruthOf target, const KeypointOptions& options)
      : TumblingTargetSensor(std::move(target)), options_(options) {}
  std::string_view name() const override { return "keypoints"; }
  void start(DeviceContext& io) override {
    tumble(io, options_.rate_radps);
    io.every(options_.period, [this, &io] { expose(io); });
  }
  int flipped() const { return flipped_; }

 private:
  static bool turned_to(const Vec3& corner_B, const Vec3& chaser_B) {
    const Vec3 d = chaser_B - corner_B;
    return d.x * corner_B.x > 0 || d.y * corner_B.y > 0 || d.z * corner_B.z > 0;
  }
  static std::uint32_t half_turn(std::size_t point) {
    const Vec3 p = kKeypoints_B[point];
    for (std::size_t k = 0; k < kKeypoints_B.size(); ++k) {
      if (norm(kKeypoints_B[k] - Vec3{-p.x, -p.y, p.z}) < 1e-9)
        return static_cast<std::uint32_t>(k);
    }
    return static_cast<std::uint32_t>(point);
  }

  void expose(DeviceContext& io) {
    const OrbitState target = target_();
    const Vec3 d = target.r_ECI - io.truth().r_ECI;
    if (io.fault("blinded", 0) != 0 || norm(d) > options_.farthest_m) return;
    if (!may_be_seen(io.now(), target.r_ECI, unit(d))) return;
    const Mat3 R_CI =
        looking_along(unit(unit(d) + normal3(io.random("pointing"), options_.pointing_rad)));
    const Mat3 known = small_turn(normal3(io.random("attitude"), options_.attitude_rad)) * R_CI;
    const Quaternion q = to_quaternion(known);
    rpo_kit_keypoints k{io.onboard_ns(), {q.w, q.x, q.y, q.z}, options_.attitude_rad, 0, {}};
    RandomStream& random = io.random("keypoints");
    const bool flip = random.bernoulli(options_.flipped);
    const Mat3 R_BI = to_matrix(body(io.now()).q_BI);
    const Vec3 chaser_B = -1 * (R_BI * d);
    for (std::size_t p = 0; p < kKeypoints_B.size(); ++p) {
      const bool missed = random.bernoulli(options_.missed);
      const bool wrong = random.bernoulli(options_.wrong);
      const double du = random.normal();
      const double dv = random.normal();
      if (missed || (p < kBodyCorners && !turned_to(kKeypoints_B[p], chaser_B))) continue;
      const Vec3 r_C = R_CI * (d + transpose(R_BI) * kKeypoints_B[p]);
      const double sigma_px = wrong ? options_.wrong_px : options_.sigma_px;
      k.seen[k.count++] = {flip ? half_turn(p) : static_cast<std::uint32_t>(p),
                           options_.focal_px * r_C.x / r_C.z + options_.centre_px + sigma_px * du,
                           options_.focal_px * r_C.y / r_C.z + options_.centre_px + sigma_px * dv,
                           options_.sigma_px};
    }
    ++images_;
    flipped_ += flip ? 1 : 0;
    io.after(options_.latency, [&io, k = std::make_shared<const rpo_kit_keypoints>(k)] {
      std::array<std::byte, RPO_KIT_KEYPOINTS_BYTES> message;
      const std::uint32_t size =
          rpo_kit_put_keypoints(reinterpret_cast<unsigned char*>(message.data()), k.get());
      io.to_flight(Bytes(message).first(size));
    });
  }

  KeypointOptions options_;
  int flipped_ = 0;
};

/// What the flight software has to know of target and camera.
inline std::string keypoint_config(const KeypointOptions& options = {}) {
  std::string text = "camera_f_px = " + std::to_string(options.focal_px) +
                     "\ncamera_cx_px = " + std::to_string(options.centre_px) +
                     "\ncamera_cy_px = " + std::to_string(options.centre_px) +
                     "\ninertia_y = 1.4\ninertia_z = 1.7\ntumble_noise_rad2ps3 = 1e-12\n";
  for (const Vec3& p : kKeypoints_B) {
    text += "keypoint = " + std::to_string(p.x) + " " + std::to_string(p.y) + " " +
            std::to_string(p.z) + "\n";
  }
  return text;
}

struct RendezvousOptions {
  RelativeElements roe_m = {};                                // of the chaser, at the start
  std::string library = "rpo_kit", config = {};               // the latter of the chaser
  double burn_fraction = 0.02, burn_angle_rad = kDegree_rad;  // 1 sigma of each burn's execution
  bool directions = true, keypoints = true;
  DirectionOptions direction = {};
  KeypointOptions keypoint = {};
  bool cooperative = true;                        // false: no word of the target's GNSS
  std::uint64_t heap_bytes = 1_MB;                // cap of each flight process
  std::map<std::string, std::string> files = {};  // that flight software finds
  std::optional<RunId> run = {};
};

/// `target` is the chief and passive, `chaser` the deputy. Gravity to degree 20: what is at stake
/// is some metres at 30 km.
struct RendezvousWorld : FormationWorld {
  /// What the chaser believed, against truth then.
  struct Belief {
    Duration t;  // since the start
    Vec3 r_m, error_m, sigma_m;
    double range_error_m() const { return norm(r_m + error_m) - norm(r_m); }
    /// 1 sigma of the range, of axes that are not correlated.
    double range_sigma_m() const {
      const Vec3 u = unit(r_m);
      return std::hypot(u.x * sigma_m.x, u.y * sigma_m.y, u.z * sigma_m.z);
    }
  };
  /// The same of the target's attitude.
  struct Attitude {
    Duration t;
    double error_rad, sigma_rad, rate_error_radps;
  };

  explicit RendezvousWorld(const RendezvousOptions& options)
      : FormationWorld(formation(options)), cooperative_(options.cooperative) {
    const TruthOf target = [this] { return spacecraft("target").truth(); };
    const SpacecraftHandle chaser = spacecraft("chaser");
    if (options.directions) chaser.add<DirectionSensor>(target, options.direction);
    if (options.keypoints) {
      keypoints_ = &chaser.add<KeypointSensor>(target, options.keypoint);
      judge_attitude_by([this](SimTime t) { return keypoints_->body(t); },
                        [this](double error_rad, double sigma_rad) {
                          keypoints_->note_attitude(error_rad, sigma_rad);
                        });
    }
    chaser.add<BurnErrors>(options.burn_fraction, options.burn_angle_rad);
    chaser.connect("burn_errors", "thruster");
    const FlightHandle kit = flight("chaser");
    kit.on_output("mode", [this](SimTime, Bytes message) {
      std::int64_t t_ns = 0;
      orrery_get_mode(data_of(message), &t_ns, &mode);
    });
    kit.on_output("telemetry", [this](SimTime, Bytes message) {
      rpo_kit_get_telemetry(data_of(message), static_cast<std::uint32_t>(message.size()),
                            &telemetry);
    });
    kit.on_output("estimate", [this](SimTime, Bytes message) { note_estimate(message); });
    kit.on_output("target", [this](SimTime, Bytes message) { note_attitude(message); });
    every(10s, [this] {
      range_m = norm(r_DC_RTN());
      nearest_m = std::min(nearest_m, range_m);
    });
    if (!cooperative_) crosslink("target", "chaser").black_out(at(0s), days(60));
  }

  void command(Duration when, unsigned order) {
    std::array<std::byte, RPO_KIT_COMMAND_BYTES> bytes;
    rpo_kit_put_command(reinterpret_cast<unsigned char*>(bytes.data()), order);
    ground().command("chaser", at(when), bytes);
  }
  const KeypointSensor& keypoints() const { return *keypoints_; }
  /// Whose tumbling is true, and who is told what flight software made of it.
  void judge_attitude_by(std::function<TumblingBody(SimTime)> body,
                         std::function<void(double, double)> note) {
    body_ = std::move(body);
    note_ = std::move(note);
  }
  double hours() const {
    return std::chrono::duration<double, std::ratio<3600>>(elapsed()).count();
  }
  void expect_sound() {
    for (const char* name : {"target", "chaser"}) {
      EXPECT_EQ(flight(name).crashes(), 0u) << name;
      EXPECT_EQ(flight(name).rejected(), 0u) << name;
    }
    EXPECT_EQ(thruster("chaser").rejected(), 0);
    EXPECT_EQ(delta_v_mps("target"), 0);
  }

  std::uint32_t mode = RPO_KIT_MODE_STANDBY;
  rpo_kit_telemetry telemetry = {};
  rpo_kit_target target_report = {};
  std::vector<Belief> beliefs;
  std::vector<Attitude> attitudes;
  double range_m = 0, nearest_m = std::numeric_limits<double>::infinity();

 private:
  static FormationOptions formation(const RendezvousOptions& options) {
    FormationOptions formation{
        .chief_name = "target",
        .deputy_name = "chaser",
        .roe_m = options.roe_m,
        .flight = {.library = options.library,
                   .files = options.files,
                   .heap_bytes = options.heap_bytes},
        .chief_config = "role = target\n",
        .deputy_config =
            "role = chaser\nburn_error_fraction = " + std::to_string(options.burn_fraction) +
            "\nburn_error_rad = " + std::to_string(options.burn_angle_rad) + "\n" + options.config,
        .run = options.run};
    formation.world.gravity_degree = 20;
    return formation;
  }
  void note_estimate(Bytes message) {
    std::int64_t t_ns = 0;
    double r[3], v[3], sigma_r[3], sigma_v[3];
    orrery_get_estimate(data_of(message), &t_ns, r, v, sigma_r, sigma_v);
    const Vec3 truth = r_DC_RTN();
    beliefs.push_back(
        {elapsed(), truth, Vec3{r[0], r[1], r[2]} - truth, {sigma_r[0], sigma_r[1], sigma_r[2]}});
  }
  void note_attitude(Bytes message) {
    rpo_kit_get_target(data_of(message), static_cast<std::uint32_t>(message.size()),
                       &target_report);
    const rpo_kit_target& t = target_report;
    // Of the exposure, some seconds ago: the body goes on from the exposure before this question.
    TumblingBody body = body_(now());
    const double back_s = 1e-9 * static_cast<double>(to_ns(now()) - t.t_ns);
    body = backwards(body, back_s);
    const Mat3 D =
        to_matrix({t.q_BI[0], t.q_BI[1], t.q_BI[2], t.q_BI[3]}) * transpose(to_matrix(body.q_BI));
    const double c = (D.row_x.x + D.row_y.y + D.row_z.z - 1) / 2;
    const Vec3 w{t.omega_BI_B[0], t.omega_BI_B[1], t.omega_BI_B[2]};
    attitudes.push_back({elapsed(), std::acos(std::clamp(c, -1.0, 1.0)),
                         std::hypot(t.sigma_rad[0], t.sigma_rad[1], t.sigma_rad[2]),
                         norm(w - body.omega_BI_B)});
    note_(attitudes.back().error_rad, attitudes.back().sigma_rad);
  }
  /// Time turned round: rates change their sign, and the quaternion follows.
  static TumblingBody backwards(TumblingBody body, double dt_s) {
    body.omega_BI_B = -1 * body.omega_BI_B;
    body.advance(dt_s);
    body.omega_BI_B = -1 * body.omega_BI_B;
    return body;
  }

  bool cooperative_;
  KeypointSensor* keypoints_ = nullptr;
  std::function<TumblingBody(SimTime)> body_;
  std::function<void(double, double)> note_;
};

}  // namespace orrery::rendezvous
