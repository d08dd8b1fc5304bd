#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/gnss/log_command.hpp>
#include <orrery/models/gnss/novatel_frame.hpp>
#include <orrery/models/gnss/novatel_messages.hpp>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace orrery::novatel {

namespace {

constexpr std::size_t kLongestLine = 255;
constexpr std::size_t kLongestBody = 64;  // of a command; LOG has 32 bytes
constexpr std::size_t kLogBytes = 32, kUnlogBytes = 8, kUnlogAllBytes = 4;
constexpr double kLongestPeriod_s = 86400;

// "Detailed port identifiers" of the manual.
constexpr std::uint32_t kCom1All = 1, kThisPortAll = 6, kAllPorts = 8, kCom1 = 32, kThisPort = 192;

struct KnownLog {
  std::string_view name;
  std::uint16_t id;
  bool changes;  // now and then, so that ONCHANGED means something
};

constexpr KnownLog kLogs[] = {{"RANGE", kRangeId, false},      {"RANGECMP", kRangeCmpId, false},
                              {"BESTXYZ", kBestXyzId, false},  {"BESTPOS", kBestPosId, false},
                              {"TIME", kTimeId, false},        {"RAWEPHEM", kRawEphemId, true},
                              {"GPSEPHEM", kGpsEphemId, true}, {"IONUTC", kIonUtcId, true},
                              {"ALMANAC", kAlmanacId, true},   {"VERSION", kVersionId, true}};

const KnownLog* find(std::uint16_t id) {
  const auto at = std::ranges::find(kLogs, id, &KnownLog::id);
  return at == std::end(kLogs) ? nullptr : at;
}

// "RANGEB", in upper case.
const KnownLog* find(std::string_view name) {
  if (name.empty() || name.back() != 'B') return nullptr;
  const auto at = std::ranges::find(kLogs, name.substr(0, name.size() - 1), &KnownLog::name);
  return at == std::end(kLogs) ? nullptr : at;
}

constexpr std::string_view kTriggers[] = {"ONNEW",  "ONCHANGED", "ONTIME",
                                          "ONNEXT", "ONCE",      "ONMARK"};

std::optional<std::uint32_t> trigger_number(std::string_view word) {
  const auto at = std::ranges::find(kTriggers, word);
  if (at == std::end(kTriggers)) return {};
  return static_cast<std::uint32_t>(at - std::begin(kTriggers));
}

std::optional<double> number(std::string_view word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return {};
  return value;
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; (at = line.find_first_not_of(" \t", at)) != line.npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

std::string in_capitals(Bytes bytes) {
  std::string text;
  for (const std::byte b : bytes) {
    const char c = static_cast<char>(b);
    text.push_back(c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c);
  }
  return text;
}

std::uint64_t integer_at(Bytes bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) {
    value = value << 8 | std::to_integer<std::uint64_t>(bytes[at + i]);
  }
  return value;
}

std::uint16_t u16_at(Bytes bytes, std::size_t at) {
  return static_cast<std::uint16_t>(integer_at(bytes, at, 2));
}

std::uint32_t u32_at(Bytes bytes, std::size_t at) {
  return static_cast<std::uint32_t>(integer_at(bytes, at, 4));
}

double f64_at(Bytes bytes, std::size_t at) {
  return std::bit_cast<double>(integer_at(bytes, at, 8));
}

void append_text(std::string_view text, ByteBuffer& out) {
  for (const char c : text) out.push_back(static_cast<std::byte>(c));
}

bool is_port(std::string_view word, bool all_allowed) {
  return word == "COM1" || word == "THISPORT" || (all_allowed && word == "ALL_PORTS");
}

bool is_port(std::uint32_t port, bool all_allowed) {
  return port == kCom1 || port == kThisPort || port == kCom1All || port == kThisPortAll ||
         (all_allowed && port == kAllPorts);
}

bool is_end_of_line(std::byte b) {
  return b == std::byte{'\r'} || b == std::byte{'\n'};
}

std::string unknown_log(std::string_view name) {
  std::string text = "log " + std::string(name) + "; accepted:";
  for (const KnownLog& log : kLogs) text += " " + std::string(log.name) + "B";
  return text;
}

std::string unknown_port(std::string_view port) {
  return "port " + std::string(port) +
         "; accepted: COM1, THISPORT, and ALL_PORTS of UNLOG and "
         "UNLOGALL";
}

}  // namespace

/// What a command comes to: the receiver's response, and for us the reason of a refusal.
struct LogCommandReader::Outcome {
  std::uint32_t id = 1;
  std::string response = "OK";
  std::string why{};

  bool ok() const { return id == 1; }

  static Outcome missing_log(std::string why) { return {2, "Requested log does not exist", why}; }
  static Outcome no_room(std::string why) { return {3, "Not enough resources in system", why}; }
  static Outcome invalid_id(std::string why) { return {6, "Invalid Message ID", why}; }
  static Outcome invalid_field(std::string_view field, std::string why) {
    return {7, "Invalid Message. Field = " + std::string(field), why};
  }
  static Outcome missing_field(std::string why) { return {9, "Message missing field", why}; }
  static Outcome out_of_range(int field, std::string why) {
    return {11, "parameter " + std::to_string(field) + " is out of range", why};
  }
  static Outcome trigger(std::string_view trigger, std::string why) {
    return {14, "Trigger " + std::string(trigger) + " not valid for this log", why};
  }
};

LogCommandReader::LogCommandReader(LogSchedule& schedule, Duration epochs)
    : schedule_(schedule), epochs_(epochs) {
  if (epochs <= 0ns) {
    throw std::invalid_argument("LogCommandReader: epochs = " + to_string(epochs) +
                                "; accepted: above 0");
  }
}

void LogCommandReader::take(Bytes bytes, const Header& header, ByteBuffer& out) {
  held_.insert(held_.end(), bytes.begin(), bytes.end());
  while (!held_.empty()) {
    const std::size_t used = held_[0] == std::byte{0xAA} ? take_frame(header, out) : take_text(out);
    if (used == 0) return;
    held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(used));
  }
}

void LogCommandReader::count(const Outcome& outcome, std::string_view command) {
  if (outcome.ok()) {
    ++accepted_;
    return;
  }
  ++refused_;
  last_refusal_ = std::string(command) + ": " + outcome.why;
}

// Up to the end of a line, which is answered; or up to a frame's first byte, which ends noise.
std::size_t LogCommandReader::take_text(ByteBuffer& out) {
  const auto end = std::ranges::find_if(
      held_, [](std::byte b) { return is_end_of_line(b) || b == std::byte{0xAA}; });
  const auto length = static_cast<std::size_t>(end - held_.begin());
  if (end == held_.end() && length <= kLongestLine) return 0;
  if (end != held_.end() && *end == std::byte{0xAA}) return length;
  Outcome outcome;
  std::string line = in_capitals(Bytes(held_).first(std::min(length, kLongestLine)));
  if (length > kLongestLine) {
    outcome = Outcome::invalid_id("a line of more than 255 characters");
    line.resize(16);
  } else if (line.find_first_not_of(" \t") == line.npos) {
    return length + 1;
  } else {
    outcome = run_line(line);
  }
  count(outcome, line);
  append_text(outcome.ok() ? "\r\n<OK\r\n[COM1]" : "\r\n<ERROR:" + outcome.response + "\r\n[COM1]",
              out);
  return end == held_.end() ? length : length + 1;
}

// A whole frame, or the one byte that cannot start one; 0 while that is open.
std::size_t LogCommandReader::take_frame(const Header& header, ByteBuffer& out) {
  constexpr std::byte kStart[] = {std::byte{0xAA}, std::byte{0x44}, std::byte{0x12},
                                  std::byte{kHeaderBytes}};
  const std::size_t known = std::min(held_.size(), std::size(kStart));
  if (!std::equal(kStart, kStart + known, held_.begin())) return 1;
  if (held_.size() < 10) return 0;
  const std::size_t body_bytes = u16_at(held_, 8);
  if (body_bytes > kLongestBody) return 1;
  const std::size_t crc_at = kHeaderBytes + body_bytes;
  if (held_.size() < crc_at + kCrcBytes) return 0;
  const std::uint16_t id = u16_at(held_, 4);
  const std::string command = "binary message " + std::to_string(id);
  if (crc32(Bytes(held_).first(crc_at)) != u32_at(held_, crc_at)) {
    count({8, "Invalid Checksum", "wrong CRC"}, command);
    return 1;
  }
  const Outcome outcome = run_frame(id, Bytes(held_).subspan(kHeaderBytes, body_bytes));
  count(outcome, command);
  Header response = header;
  response.message_type |= 0x80;
  Frame frame(response, id, 4 + outcome.response.size(), out);
  Writer w = frame.body();
  w.u32(outcome.id);
  w.text(outcome.response, outcome.response.size());
  frame.close();
  return crc_at + kCrcBytes;
}

LogCommandReader::Outcome LogCommandReader::run_line(std::string_view line) {
  const Words words = split(line);
  if (words[0] == "LOG") return log_line(words);
  if (words[0] == "UNLOG") return unlog_line(words);
  if (words[0] == "UNLOGALL") return unlog_all_line(words);
  return Outcome::invalid_id("command " + std::string(words[0]) +
                             "; accepted: LOG, UNLOG, UNLOGALL");
}

LogCommandReader::Outcome LogCommandReader::log_line(const Words& words) {
  // A first word that is no log may be a port only if another word follows.
  std::size_t at = 1;
  if (words.size() > 2 && find(words[1]) == nullptr) {
    if (!is_port(words[1], false)) {
      return Outcome::invalid_field(
          words[1], find(words[2]) != nullptr ? unknown_port(words[1]) : unknown_log(words[1]));
    }
    at = 2;
  }
  if (words.size() <= at) return Outcome::missing_field("no log is named");
  const KnownLog* const known = find(words[at]);
  if (known == nullptr) return Outcome::invalid_field(words[at], unknown_log(words[at]));
  return log_arguments(known->id, std::span(words).subspan(at + 1));
}

// What follows the message: trigger, period, offset, hold; each may be left out with those behind
// it.
LogCommandReader::Outcome LogCommandReader::log_arguments(std::uint16_t message_id,
                                                          std::span<const std::string_view> words) {
  LogRequest request{.message_id = message_id};
  double times_s[2] = {0, 0};  // period, offset
  if (words.size() > 4) return Outcome::invalid_field(words[4], "a word too many");
  if (!words.empty()) {
    const std::optional<std::uint32_t> trigger = trigger_number(words[0]);
    if (!trigger) {
      return Outcome::invalid_field(
          words[0], "trigger " + std::string(words[0]) + "; accepted: ONTIME, ONCHANGED, ONCE");
    }
    request.trigger = LogTrigger{*trigger};
  }
  for (std::size_t k = 1; k < std::min<std::size_t>(words.size(), 3); ++k) {
    const std::optional<double> value = number(words[k]);
    if (!value) {
      return Outcome::invalid_field(words[k],
                                    (k == 1 ? "period " : "offset ") + std::string(words[k]));
    }
    times_s[k - 1] = *value;
  }
  if (words.size() == 4) {
    if (words[3] != "HOLD" && words[3] != "NOHOLD") {
      return Outcome::invalid_field(words[3], std::string(words[3]) + "; accepted: HOLD, NOHOLD");
    }
    request.hold = words[3] == "HOLD";
  }
  const Outcome times = check_times(request, times_s[0], times_s[1]);
  return times.ok() ? log(request) : times;
}

LogCommandReader::Outcome LogCommandReader::unlog_line(const Words& words) {
  const std::size_t at = words.size() > 2 ? 2 : 1;
  if (words.size() <= at) return Outcome::missing_field("no log is named");
  if (words.size() > 3) return Outcome::invalid_field(words[3], "a word too many");
  if (at == 2 && !is_port(words[1], true)) {
    return Outcome::invalid_field(words[1], unknown_port(words[1]));
  }
  const KnownLog* const known = find(words[at]);
  if (known == nullptr) return Outcome::invalid_field(words[at], unknown_log(words[at]));
  return unlog(known->id);
}

LogCommandReader::Outcome LogCommandReader::unlog_all_line(const Words& words) {
  if (words.size() > 3) return Outcome::invalid_field(words[3], "a word too many");
  if (words.size() > 1 && !is_port(words[1], true)) {
    return Outcome::invalid_field(words[1], unknown_port(words[1]));
  }
  bool held = false;
  if (words.size() > 2) {
    held = words[2] == "1" || words[2] == "TRUE";
    if (!held && words[2] != "0" && words[2] != "FALSE") {
      return Outcome::invalid_field(words[2],
                                    std::string(words[2]) + "; accepted: 0, 1, FALSE, TRUE");
    }
  }
  schedule_.unlog_all(held);
  return {};
}

LogCommandReader::Outcome LogCommandReader::run_frame(std::uint16_t id, Bytes body) {
  const auto too_short = [&](std::size_t bytes) {
    return Outcome::missing_field("body of " + std::to_string(body.size()) +
                                  " bytes; accepted: at least " + std::to_string(bytes));
  };
  if (id == kLogId) return body.size() < kLogBytes ? too_short(kLogBytes) : log_frame(body);
  if (id != kUnlogId && id != kUnlogAllId) {
    return Outcome::invalid_id("accepted: 1 (LOG), 36 (UNLOG), 38 (UNLOGALL)");
  }
  const std::size_t least = id == kUnlogId ? kUnlogBytes : kUnlogAllBytes;
  if (body.size() < least) return too_short(least);
  if (!is_port(u32_at(body, 0), true)) {
    return Outcome::invalid_field("1", unknown_port(std::to_string(u32_at(body, 0))));
  }
  if (id == kUnlogId) return unlog(u16_at(body, 4));
  schedule_.unlog_all(body.size() >= 8 && u32_at(body, 4) != 0);
  return {};
}

// Port, message, message type, a reserved byte, trigger, period, offset, hold.
LogCommandReader::Outcome LogCommandReader::log_frame(Bytes body) {
  if (!is_port(u32_at(body, 0), false)) {
    return Outcome::invalid_field("1", unknown_port(std::to_string(u32_at(body, 0))));
  }
  if ((std::to_integer<unsigned>(body[6]) & 0xE0u) != 0) {
    return Outcome::invalid_field("3", "a format other than binary");
  }
  LogRequest request{.message_id = u16_at(body, 4),
                     .trigger = LogTrigger{u32_at(body, 8)},
                     .hold = u32_at(body, 28) != 0};
  const Outcome times = check_times(request, f64_at(body, 12), f64_at(body, 20));
  return times.ok() ? log(request) : times;
}

// Seconds that are not whole epochs of the receiver would be asked for in vain.
LogCommandReader::Outcome LogCommandReader::check_times(LogRequest& request, double period_s,
                                                        double offset_s) const {
  if (request.trigger != LogTrigger::kOnTime) return {};
  const std::string accepted = "accepted: multiples of " + to_string(epochs_);
  const bool in_range = period_s > 0 && period_s <= kLongestPeriod_s;  // NaN fails
  request.period = in_range ? from_seconds(period_s) : 0ns;
  if (request.period <= 0ns || request.period % epochs_ != 0ns) {
    return Outcome::out_of_range(
        4, "period " + to_text(period_s) + " s; " + accepted + " up to 86400 s");
  }
  const bool offset_in_range = offset_s >= 0 && offset_s < period_s;
  request.offset = offset_in_range ? from_seconds(offset_s) : -1ns;
  if (request.offset < 0ns || request.offset >= request.period || request.offset % epochs_ != 0ns) {
    return Outcome::out_of_range(
        5, "offset " + to_text(offset_s) + " s; " + accepted + " below the period");
  }
  return {};
}

LogCommandReader::Outcome LogCommandReader::log(const LogRequest& request) {
  const KnownLog* const known = find(request.message_id);
  if (known == nullptr) {
    return Outcome::missing_log(unknown_log(std::to_string(request.message_id)));
  }
  const bool valid = request.trigger == LogTrigger::kOnTime ||
                     request.trigger == LogTrigger::kOnce ||
                     (known->changes && request.trigger == LogTrigger::kOnChanged);
  if (!valid) {
    const auto n = static_cast<std::uint32_t>(request.trigger);
    const std::string name =
        n < std::size(kTriggers) ? std::string(kTriggers[n]) : std::to_string(n);
    return Outcome::trigger(name, "trigger " + name + "; accepted: ONTIME, ONCE" +
                                      (known->changes ? ", ONCHANGED" : ""));
  }
  if (!schedule_.log(request)) return Outcome::no_room("30 logs are active");
  return {};
}

LogCommandReader::Outcome LogCommandReader::unlog(std::uint16_t message_id) {
  if (schedule_.unlog(message_id)) return {};
  return Outcome::missing_log("log " + std::to_string(message_id) + " is not active");
}

}  // namespace orrery::novatel
