/// Trajectories as CZML, for CesiumJS and other viewers of globes.
#pragma once

#include <orrery/harness/kernel/time.hpp>
#include <orrery/harness/record/output_file.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace orrery {

/// Writes states as they come; of each object a few hundred are kept in memory.
///
/// Format  CZML 1.0: a document with a clock, then packets of positions with velocities, to be
///         interpolated by Hermite polynomials of degree 5. Times are UTC, as CZML has no other
///         scale; metres with three decimals.
/// Frame   INERTIAL, which CZML defines as ICRF; what is written is EME2000, 23 mas or 0.8 m away
///         in low orbit, the same for all objects. It is for looking at: across an impulse a viewer
///         interpolates, so use the OEM to compute with.
class CzmlWriter {
 public:
  using Components = std::array<double, 3>;  // x, y, z

  /// @param gps_minus_utc  At the epoch: 18 s since 2017.
  /// @throws std::runtime_error  the file cannot be written.
  CzmlWriter(const std::filesystem::path& path, const std::string& name, SimTime epoch,
             Duration gps_minus_utc);

  /// @throws std::invalid_argument  a component that is not finite.
  void state(const std::string& object, SimTime t, const Components& r_ECI,
             const Components& v_ECI);
  /// As OutputFile's.
  void flush() { file_.flush(); }
  void continue_in(std::filesystem::path path) { file_.continue_in(std::move(path)); }
  /// @param end  Of the run: where the viewer's clock stops.
  void close(SimTime end);

 private:
  struct Object {
    std::string name;
    std::string samples;  // not written yet
    std::size_t count = 0;
    bool begun = false;
  };
  Object& object_of(const std::string& name);
  void write_samples(Object& object);
  std::string utc(SimTime t) const;

  OutputFile file_;
  SimTime epoch_;
  Duration gps_minus_utc_;
  std::uint64_t end_position_ = 0;  // of the clock's end in the file
  std::vector<Object> objects_;
};

}  // namespace orrery
