/// How far a long run has come: one line on a terminal that changes, and nothing elsewhere.
#pragma once

#include <orrery/harness/kernel/simulator_only.hpp>
#include <orrery/harness/kernel/time.hpp>

#include <string>

namespace orrery {

/// "   3:12:00 of 50:00:00 simulated   12 340 x real time   14 s left   delivery to deputy ..." on
/// standard error, if that is a terminal and --orrery_progress=0 was not given: from half a second
/// after the construction on, five times a second. It goes with this object. Looks at the host's
/// clock, and tells the run nothing of it.
class ProgressLine {
 public:
  ProgressLine(SimTime epoch, SimTime begin, SimTime end);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool wanted() const { return wanted_; }
  /// Cheap enough to ask after each event.
  bool due() { return wanted_ && ++asked_ % 64 == 0 && time_has_come(); }
  void show(SimTime now, const std::string& last_event);

  /// Clears the line, if there is one, so that something else can be printed.
  static void hide();

 private:
  bool time_has_come();

  SimTime epoch_, begin_, end_;
  bool wanted_;
  unsigned asked_ = 0;
  double started_s_ = 0, next_s_ = 0;  // host time
};

/// The line's text, without the last event: for a run that began at `begin`, `spent_s` ago.
std::string progress_text(SimTime epoch, SimTime begin, SimTime now, SimTime end, double spent_s);

}  // namespace orrery
