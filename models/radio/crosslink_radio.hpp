/// A radio between spacecraft: passes frames on unchanged, from flight software to every peer.
#pragma once

#include <orrery/models/device/device.hpp>

#include <string>
#include <vector>

namespace orrery {

struct CrosslinkRadioOptions {
  std::vector<std::string> peers;  // names of the spacecraft that each frame is sent to
};

/// Device "crosslink". What flight software writes goes to every peer, in the order of `peers`;
/// what arrives goes to flight software. Loss and delay are the link's (radio_link.hpp).
class CrosslinkRadio final : public Device {
 public:
  using Options = CrosslinkRadioOptions;

  /// @throws std::invalid_argument  an empty name, or the same name twice.
  explicit CrosslinkRadio(Options options);

  std::string_view name() const override { return "crosslink"; }
  void start(DeviceContext& io) override { (void)io; }
  void from_flight(DeviceContext& io, Bytes bytes) override;
  void from_air(DeviceContext& io, std::string_view sender, Bytes frame) override;

 private:
  Options options_;
};

}  // namespace orrery
