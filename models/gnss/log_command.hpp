/// The commands by which a flight computer asks a NovAtel receiver for logs, as bytes.
///
/// Source      OEM7 Commands and Logs Reference Manual (NovAtel OM-20000169): LOG (1), UNLOG (36),
///             UNLOGALL (38), "Abbreviated ASCII", "Binary", "Responses"
/// Checked by  test_suites/unit/models/gnss/log_command_test.cpp
#pragma once

#include <orrery/models/gnss/log_schedule.hpp>
#include <orrery/models/gnss/novatel.hpp>

#include <string>
#include <string_view>

namespace orrery::novatel {

constexpr std::uint16_t kLogId = 1;
constexpr std::uint16_t kUnlogId = 36;
constexpr std::uint16_t kUnlogAllId = 38;

/// Reads a stream of commands, cut anywhere, into a LogSchedule, and answers as the receiver does.
///
///   LOG [port] message [trigger [period [offset [hold]]]]    abbreviated ASCII, any case, ended by
///   CR UNLOG [port] message                                     or LF, at most 255 characters
///   UNLOGALL [port [held]]
///   binary LOG, UNLOG, UNLOGALL                              a 28-byte header, CRC checked
///
/// port     COM1, THISPORT; for UNLOG and UNLOGALL also ALL_PORTS. Default THISPORT: there is one.
/// message  RANGEB, RANGECMPB, BESTXYZB, BESTPOSB, TIMEB, RAWEPHEMB, GPSEPHEMB, IONUTCB, ALMANACB,
///          VERSIONB: logs in binary. Without the B they would be text, which is refused.
/// trigger  ONCE (default), ONTIME, and ONCHANGED for the last five: the rest changes at every
/// epoch. period   [s] multiples of the receiver's epochs, up to 86400; ONTIME only offset   [s]
/// multiples of the receiver's epochs, below the period hold     NOHOLD (default), HOLD: UNLOGALL
/// leaves the log unless its `held` is 1 or TRUE
///
/// All else is refused with the receiver's response (OEM7 manual, "Responses"); last_refusal() adds
/// the value and what is accepted. A frame with a wrong CRC is counted as refused and not answered.
class LogCommandReader {
 public:
  /// `epochs`: the period at which the receiver asks the schedule what is due.
  /// @throws std::invalid_argument  `epochs` not above 0.
  LogCommandReader(LogSchedule& schedule, Duration epochs);

  /// Applies what `bytes` complete and appends the responses to `out`; `header` is that of binary
  /// ones. Allocates only as commands come.
  void take(Bytes bytes, const Header& header, ByteBuffer& out);

  std::uint64_t accepted() const { return accepted_; }
  std::uint64_t refused() const { return refused_; }
  /// "LOG RANGEB ONNEW: trigger ONNEW; accepted: ONTIME, ONCE"
  const std::string& last_refusal() const { return last_refusal_; }

 private:
  struct Outcome;
  using Words = std::vector<std::string_view>;

  std::size_t take_text(ByteBuffer& out);
  std::size_t take_frame(const Header& header, ByteBuffer& out);
  Outcome run_line(std::string_view line);
  Outcome run_frame(std::uint16_t id, Bytes body);
  Outcome log(const LogRequest& request);
  Outcome unlog(std::uint16_t message_id);
  Outcome check_times(LogRequest& request, double period_s, double offset_s) const;
  Outcome log_line(const Words& words);
  Outcome log_arguments(std::uint16_t message_id, std::span<const std::string_view> words);
  Outcome unlog_line(const Words& words);
  Outcome unlog_all_line(const Words& words);
  Outcome log_frame(Bytes body);
  void count(const Outcome& outcome, std::string_view command);

  LogSchedule& schedule_;
  Duration epochs_;
  ByteBuffer held_;  // bytes of a command that is not complete
  std::uint64_t accepted_ = 0;
  std::uint64_t refused_ = 0;
  std::string last_refusal_;
};

}  // namespace orrery::novatel
