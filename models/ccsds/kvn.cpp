#include <orrery/harness/kernel/text.hpp>
#include <orrery/models/ccsds/kvn.hpp>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace orrery::ccsds {

using text::trimmed;

namespace {

constexpr std::string_view kComment = "COMMENT";

bool is_keyword(std::string_view word) {
  return !word.empty() && std::all_of(word.begin(), word.end(), [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  }) && word.front() >= 'A';
}

bool stands_alone(std::string_view keyword) {
  return keyword == "META_START" || keyword == "META_STOP" || keyword == "COVARIANCE_START" ||
         keyword == "COVARIANCE_STOP";
}

bool is_comment(std::string_view line) {
  return line.starts_with(kComment) &&
         (line.size() == kComment.size() || line[kComment.size()] == ' ' ||
          line[kComment.size()] == '\t');
}

}  // namespace

// ---- reading

KvnLine KvnLines::classify(std::string_view line) const {
  const std::size_t equals = line.find('=');
  const std::string_view keyword = trimmed(line.substr(0, equals));
  const std::string_view value =
      equals == std::string_view::npos ? std::string_view() : trimmed(line.substr(equals + 1));
  if (equals == std::string_view::npos && !is_keyword(keyword)) return {lines_.number(), {}, line};
  if (!is_keyword(keyword))
    fail(quoted(keyword) + " is not a keyword; accepted: capitals, digits and underscores");
  if (stands_alone(keyword) && equals != std::string_view::npos)
    fail(std::string(keyword) + " takes no value");
  if (!stands_alone(keyword) && value.empty()) fail(std::string(keyword) + " has no value");
  return {lines_.number(), keyword, value};
}

void KvnLines::look_ahead() {
  while (const std::optional<std::string_view> raw = lines_.next()) {
    const std::string_view line = trimmed(*raw);
    if (line.empty()) continue;
    if (line.starts_with('<')) fail("this is XML; only key-value notation (KVN) is read");
    if (is_comment(line)) {
      comments_.emplace_back(trimmed(line.substr(kComment.size())));
      continue;
    }
    next_ = classify(line);
    return;
  }
}

const KvnLine* KvnLines::peek() {
  if (!next_) look_ahead();
  return next_ ? &*next_ : nullptr;
}

bool KvnLines::next_is(std::string_view keyword) {
  const KvnLine* const line = peek();
  return line != nullptr && line->keyword == keyword;
}

void KvnLines::take_remaining_comments(std::vector<std::string>& comments) {
  comments.insert(comments.end(), comments_.begin(), comments_.end());
  comments_.clear();
}

KvnLine KvnLines::take(std::vector<std::string>& comments) {
  if (peek() == nullptr) fail("cut short: the message ends here");
  take_remaining_comments(comments);
  const KvnLine line = *next_;
  next_.reset();
  return line;
}

KvnLine KvnLines::take(std::string_view keyword, std::vector<std::string>& comments) {
  const KvnLine* const line = peek();
  if (line == nullptr) fail("cut short: " + std::string(keyword) + " is missing");
  if (line->keyword != keyword)
    fail(line->number, (line->keyword.empty() ? quoted(line->value) : std::string(line->keyword)) +
                           " is not expected here; accepted: " + std::string(keyword));
  return take(comments);
}

double KvnLines::number(int line, std::string_view word, std::string_view name) const {
  const std::optional<double> value = text::finite_number(word);
  if (!value) fail(line, std::string(name) + ": " + quoted(word) + " is not a finite number");
  return *value;
}

double KvnLines::real(const KvnLine& line, std::string_view unit) const {
  std::string_view value = line.value;
  const std::size_t bracket = value.find('[');
  if (bracket != std::string_view::npos) {
    const std::string_view printed = value.substr(bracket);
    const std::string expected = "[" + std::string(unit) + "]";
    if (unit.empty())
      fail(line.number, std::string(line.keyword) + " has no unit, but " + quoted(printed));
    if (printed != expected)
      fail(line.number, "unit of " + std::string(line.keyword) + " is " + quoted(printed) +
                            "; accepted: " + expected + ", or none");
    value = trimmed(value.substr(0, bracket));
  }
  return number(line.number, value, line.keyword);
}

double KvnLines::not_negative(const KvnLine& line, std::string_view unit) const {
  const double value = real(line, unit);
  if (value < 0)
    fail(line.number,
         std::string(line.keyword) + " = " + to_text(value) + "; accepted: not negative");
  return value;
}

int KvnLines::integer(const KvnLine& line, int low, int high) const {
  const std::optional<int> value = text::whole_number(line.value);
  if (!value || *value < low || *value > high)
    fail(line.number, std::string(line.keyword) + " is " + quoted(line.value) +
                          "; accepted: " + std::to_string(low) + " to " + std::to_string(high));
  return *value;
}

CcsdsEpoch KvnLines::epoch(int line, std::string_view word, std::string_view name) const {
  const std::optional<CcsdsEpoch> value = read_epoch(word);
  if (!value)
    fail(line, std::string(name) + ": " + quoted(word) +
                   " is not an epoch; accepted: YYYY-MM-DDThh:mm:ss.d or YYYY-DDDThh:mm:ss.d");
  return *value;
}

CcsdsEpoch KvnLines::epoch(const KvnLine& line) const {
  return epoch(line.number, line.value, line.keyword);
}

std::string KvnLines::text(const KvnLine& line) const {
  return std::string(line.value);
}

// ---- writing

void KvnWriter::line(std::string_view text) {
  out_ += text;
  out_ += '\n';
}

void KvnWriter::comments(const std::vector<std::string>& comments) {
  for (const std::string& comment : comments) {
    if (!text::is_text(comment) || trimmed(comment) != comment)
      throw std::invalid_argument(writer_ + ": COMMENT " + quoted(comment) +
                                  "; accepted: printable ASCII without blanks at its ends");
    line(comment.empty() ? std::string(kComment) : std::string(kComment) + " " + comment);
  }
}

void KvnWriter::text(std::string_view keyword, std::string_view value) {
  if (value.empty() || !text::is_text(value) || trimmed(value) != value)
    throw std::invalid_argument(
        writer_ + ": " + std::string(keyword) + " is " + quoted(value) +
        "; accepted: printable ASCII, not empty, without blanks at its ends");
  line(std::string(keyword) + " = " + std::string(value));
}

std::string KvnWriter::number(std::string_view name, double value) const {
  if (!std::isfinite(value))
    throw std::invalid_argument(writer_ + ": " + std::string(name) + " is " + to_text(value) +
                                "; accepted: finite numbers");
  return to_text(value);
}

void KvnWriter::real(std::string_view keyword, double value) {
  text(keyword, number(keyword, value));
}

void KvnWriter::epoch(std::string_view keyword, const CcsdsEpoch& value) {
  text(keyword, to_text(value));
}

void KvnWriter::data(std::string_view epoch, const double* values, std::size_t count) {
  std::string row(epoch);
  for (std::size_t i = 0; i < count; ++i) {
    if (!row.empty()) row += ' ';
    row += number(epoch.empty() ? "covariance" : epoch, values[i]);
  }
  line(row);
}

void KvnWriter::optional_text(std::string_view keyword, const std::optional<std::string>& value) {
  if (value) text(keyword, *value);
}

void KvnWriter::optional_real(std::string_view keyword, const std::optional<double>& value) {
  if (value) real(keyword, *value);
}

void KvnWriter::optional_epoch(std::string_view keyword, const std::optional<CcsdsEpoch>& value) {
  if (value) epoch(keyword, *value);
}

}  // namespace orrery::ccsds
