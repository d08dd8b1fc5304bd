/// The package as a class: inputs are member functions, outputs a virtual interface (Bell &
/// D'Amico, figure 9). Usable as it is, without the flight ABI; flight_library.cpp puts it behind
/// that.
///
/// Target      navigates and tells its GNSS solution; never manoeuvres.
/// Chaser      finds the target by what sees it, and approaches on command.
/// Observer    tells where it sees the target, and from where; never manoeuvres.
/// Times       GPS; the onboard clock is taken to show it, as a GNSS receiver steers it.
/// Memory      this object, the lists of measurements and what planning takes while it runs.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "formation_keeping/crosslink_protocol.hpp"
#include "rpo_kit/mission/configuration.hpp"
#include "rpo_kit/near_range/keypoint_finder.hpp"
#include "support/novatel/novatel.h"

namespace rpo_kit {

enum class LogLevel : std::int32_t { kDebug = 0, kInfo = 1, kWarning = 2, kError = 3 };

/// Chaser less target in the target's RTN, as the `estimate` port says it.
struct RelativeOutput {
  std::int64_t t_ns = 0;
  double r_DC_RTN[3] = {}, v_DC_RTN[3] = {};
  double sigma_r_m[3] = {}, sigma_v_mps[3] = {};
};

class Outputs {
 public:
  virtual ~Outputs() = default;
  virtual void out_crosslink(const unsigned char* packet, std::uint32_t bytes) = 0;
  /// @return false: the thruster did not take it.
  virtual bool out_maneuver(std::int64_t mid_burn_ns, const double dv_ECI[3]) = 0;
  virtual void out_mode(std::int64_t t_ns, std::uint32_t mode) = 0;
  virtual void out_estimate(const RelativeOutput& estimate) = 0;
  virtual void out_target(const unsigned char* message, std::uint32_t bytes) = 0;
  virtual void out_observation(const unsigned char* packet, std::uint32_t bytes) {
    (void)packet, (void)bytes;
  }
  virtual void out_imaging(const unsigned char* message, std::uint32_t bytes) = 0;
  virtual void out_telemetry(const unsigned char* packet, std::uint32_t bytes) = 0;
  /// Replaces the one before.
  virtual void request_tick(std::int64_t at_ns) = 0;
  virtual void log(LogLevel level, const char* line) = 0;
};

struct Boot {
  std::int64_t now_ns = 0;
  std::uint32_t boot_count = 0;
};

class RpoKit {
 public:
  /// @param outputs  Outlives this object; is called from the constructor on.
  RpoKit(Outputs& outputs, const Configuration& configuration, const Boot& boot);
  ~RpoKit();
  RpoKit(const RpoKit&) = delete;
  RpoKit& operator=(const RpoKit&) = delete;

  // Each false if the input was not usable; nothing else happens then.
  bool in_gnss(std::int64_t now_ns, const unsigned char* bytes, std::uint32_t count);
  bool in_crosslink(std::int64_t now_ns, const unsigned char* packet, std::uint32_t bytes);
  bool in_command(std::int64_t now_ns, const unsigned char* message, std::uint32_t bytes);
  /// From image processing: a direction to the target, a place of it.
  bool in_bearing(const Bearing& bearing);
  bool in_bearing(const unsigned char* message, std::uint32_t bytes);
  /// Of a second observer, over a crosslink. Not usable: damaged, from the future, no place near
  /// the own one, or none is configured. Too late, doubled or outside the gate it is left out
  /// later.
  bool in_observation(std::int64_t now_ns, const unsigned char* packet, std::uint32_t bytes);
  bool in_pose(const PlaceMeasurement& place);
  bool in_keypoints(const unsigned char* message, std::uint32_t bytes);
  /// A frame of the camera, or bands of its rows one after the other. Not usable: damaged, of
  /// another size than announced, a band without the one before it, the same pixels once more.
  bool in_image(const unsigned char* message, std::uint32_t bytes);
  /// An image of the target, with the camera's attitude: its keypoints are found in it.
  bool in_view(const unsigned char* message, std::uint32_t bytes);
  void in_tick(std::int64_t now_ns);

  Mode mode() const { return autonomy_.mode(); }
  const RelativeNavigation& navigation() const { return navigation_; }
  const Inspection& inspection() const { return inspection_; }
  const Approach& approach() const { return approach_; }

 private:
  bool is_chaser() const { return configuration_.role == Role::kChaser; }
  bool reject() {
    ++rejected_;
    return false;
  }
  void take_fix(std::int64_t now_ns, const flight_support::GnssFix& fix);
  EciFix in_eci(const flight_support::GnssFix& fix) const;
  void decide(std::int64_t now_ns, Order order);
  Situation situation(std::int64_t now_ns, const flight_support::RelativeOrbit* now,
                      const flight_support::Matrix6& covariance) const;
  void change_mode(Mode mode, const flight_support::RelativeOrbit& now);
  void guide(const flight_support::RelativeOrbit& now, const flight_support::Matrix6& covariance);
  void command_burn(const flight_support::RelativeOrbit& now, const flight_support::Burn& burn);
  void send_estimate(const flight_support::RelativeOrbit& now,
                     const flight_support::Matrix6& covariance);
  void take_sighting(const Sighting& sighting, const Observer& own);
  void look_at_frame(const FrameHeader& header);
  bool expected_target(std::int64_t t_ns, const Observer& own, ExpectedTarget* expected) const;
  bool send_observation(const Bearing& bearing);
  void send_imaging(const FrameReport& report);
  void send_target();
  void send_telemetry(std::int64_t now_ns, const flight_support::RelativeOrbit* now,
                      const flight_support::Matrix6& covariance);

  Outputs& out_;
  Configuration configuration_;
  unsigned char gnss_room_[flight_support::kGnssRoomBytes];
  novatel_framer framer_;
  flight_support::GnssFix last_fix_;
  formation_keeping::CrosslinkSender sender_;
  formation_keeping::CrosslinkReceiver receiver_;
  RelativeNavigation navigation_;
  Inspection inspection_;
  Approach approach_;
  Autonomy autonomy_;
  std::unique_ptr<FrameProcessor> frames_;  // null: no camera
  /// Images of the target; null: none are looked at.
  struct TargetViews;
  std::unique_ptr<TargetViews> views_;
  HotPixels hot_pixels_;
  std::vector<std::uint16_t> pixels_;  // of the frame that is coming in
  std::uint32_t frame_ = 0, frame_crc_ = 0, last_frame_crc_ = 0;
  unsigned rows_in_ = 0;
  std::int64_t last_crosslink_slot_ = -1, last_telemetry_slot_ = -1;
  double delta_v_mps_ = 0.0;
  std::uint32_t burns_ = 0, rejected_ = 0;
};

}  // namespace rpo_kit
