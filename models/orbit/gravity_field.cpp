#include <orrery/models/data/embedded_tables.hpp>
#include <orrery/models/orbit/gravity_field.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace orrery {
namespace {

using text::quoted;
using text::whole_number;

constexpr int kHighestDegree = 360;  // scale factors of HarmonicGravity stay far inside double
constexpr std::string_view kBlanks = " \t\r";
// Beyond what any body has: the Sun's mu is 1.3e20 m^3/s^2, its radius 7e8 m.
constexpr double kLargestMu_m3ps2 = 1e22, kLargestRadius_m = 1e10;
constexpr double kLargestCoefficient = 1;

std::size_t triangle_index(int n, int m) {
  return static_cast<std::size_t>(n) * (static_cast<std::size_t>(n) + 1) / 2 +
         static_cast<std::size_t>(m);
}

std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

// Fortran writes 1.0D-10.
std::optional<double> real_in(std::string_view word) {
  const std::size_t exponent = word.find_first_of("Dd");
  std::string c_style;
  if (exponent != std::string_view::npos) {
    c_style = word;
    c_style[exponent] = 'E';
    word = c_style;
  }
  return text::finite_number(word);
}

std::string in_short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

bool is_text(std::string_view line) {
  return std::none_of(line.begin(), line.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < ' ' && c != '\t' && c != '\r') || byte == 0x7f;
  });
}

}  // namespace

/// Reads a field line by line; knows where it is, for the messages.
class GravityFieldReader {
 public:
  GravityFieldReader(std::string_view text, std::string_view source, std::optional<int> degree)
      : text_(text), source_(source), wanted_degree_(degree) {}

  GravityField read() {
    read_header();
    read_coefficients();
    require_complete();
    return std::move(field_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument("GravityField: " + source_ + ", line " +
                                std::to_string(line_number_) + ": " + what);
  }

  bool next_line(std::string_view& line) {
    if (text_.empty()) return false;
    ++line_number_;
    const std::size_t end = text_.find('\n');
    // A number cut in the middle still reads as a number: only the line end shows that it is whole.
    if (end == std::string_view::npos) fail("cut short: the last line has no line end");
    line = text_.substr(0, end);
    text_.remove_prefix(end + 1);
    if (!is_text(line)) fail("not text");
    return true;
  }

  void read_header() {
    std::string_view line;
    while (next_line(line)) {
      const std::string_view keyword = take_word(line);
      if (keyword == "end_of_head") return accept_header();
      read_keyword(keyword, take_word(line));
    }
    fail("cut short: the header has no end_of_head");
  }

  void read_keyword(std::string_view keyword, std::string_view value) {
    if (keyword == "modelname") field_.name_ = value;
    if (keyword == "tide_system") field_.tide_system_ = value;
    if (keyword == "earth_gravity_constant" || keyword == "gravity_constant")
      field_.mu_m3ps2_ = positive(keyword, value, kLargestMu_m3ps2);
    if (keyword == "radius") field_.radius_m_ = positive(keyword, value, kLargestRadius_m);
    if (keyword == "max_degree") announced_degree_ = whole_number(value).value_or(-1);
    if (keyword == "norm" && value != "fully_normalized")
      fail("norm is " + quoted(value) + "; accepted: fully_normalized");
  }

  double positive(std::string_view keyword, std::string_view value, double largest) const {
    const std::optional<double> number = real_in(value);
    if (!number || !(*number > 0) || *number > largest)
      fail(std::string(keyword) + " is " + quoted(value) + "; accepted: a positive number up to " +
           in_short(largest));
    return *number;
  }

  void accept_header() {
    if (field_.mu_m3ps2_ == 0) fail("the header has no earth_gravity_constant");
    if (field_.radius_m_ == 0) fail("the header has no radius");
    if (announced_degree_ < 2) fail("the header's max_degree is missing or below 2");
    field_.degree_ = wanted_degree_.value_or(announced_degree_);
    if (field_.degree_ > announced_degree_ || field_.degree_ < 2 || field_.degree_ > kHighestDegree)
      fail("degree " + std::to_string(field_.degree_) + " asked for; accepted: 2 to " +
           std::to_string(std::min(announced_degree_, kHighestDegree)));
    const std::size_t count = triangle_index(field_.degree_ + 1, 0);
    field_.C_.assign(count, 0.0);
    field_.S_.assign(count, 0.0);
    field_.C_[0] = 1;
    seen_.assign(count, false);
  }

  void read_coefficients() {
    std::string_view line;
    while (next_line(line)) {
      const std::string_view key = take_word(line);
      if (key.empty()) continue;
      if (key != "gfc")
        fail(quoted(key) + " is not a line of a static field; accepted: gfc n m C S");
      read_coefficient(line);
    }
  }

  void read_coefficient(std::string_view line) {
    const std::optional<int> n = whole_number(take_word(line));
    const std::optional<int> m = whole_number(take_word(line));
    const std::optional<double> C = real_in(take_word(line));
    const std::optional<double> S = real_in(take_word(line));
    if (!n || !m || !C || !S) fail("malformed; accepted: gfc n m C S with four finite numbers");
    if (*m < 0 || *m > *n || *n > announced_degree_)
      fail("no such coefficient: n = " + std::to_string(*n) + ", m = " + std::to_string(*m) +
           "; accepted: 0 <= m <= n <= " + std::to_string(announced_degree_));
    if (*n < 2 && (*C != (*n == 0 ? 1 : 0) || *S != 0))
      fail("degree " + std::to_string(*n) +
           " must be C = 1 (degree 0) or 0 (degree 1): mu is the header's, the origin the centre "
           "of mass");
    if (std::abs(*C) > kLargestCoefficient || std::abs(*S) > kLargestCoefficient)
      fail("C = " + in_short(*C) + ", S = " + in_short(*S) +
           "; accepted: fully normalised coefficients, -1 to 1");
    if (*n <= field_.degree_) store(*n, *m, *C, *S);
  }

  void store(int n, int m, double C, double S) {
    const std::size_t i = triangle_index(n, m);
    if (seen_[i])
      fail("n = " + std::to_string(n) + ", m = " + std::to_string(m) + " is given twice");
    seen_[i] = true;
    field_.C_[i] = C;
    field_.S_[i] = S;
    last_ = {n, m};
  }

  void require_complete() const {
    for (int n = 2; n <= field_.degree_; ++n) {
      for (int m = 0; m <= n; ++m) {
        if (!seen_[triangle_index(n, m)]) fail(what_is_missing(n, m));
      }
    }
  }

  std::string what_is_missing(int n, int m) const {
    bool cut_short = true;
    for (std::size_t i = triangle_index(n, m); i < seen_.size(); ++i)
      cut_short = cut_short && !seen_[i];
    const std::string first = "n = " + std::to_string(n) + ", m = " + std::to_string(m);
    if (!cut_short) return first + " is missing";
    return "cut short: the file ends here after n = " + std::to_string(last_[0]) +
           ", m = " + std::to_string(last_[1]) + "; complete to degree " +
           std::to_string(field_.degree_) + " was announced or asked for, and " + first +
           " and all that follow are missing";
  }

  std::string_view text_;
  std::string source_;
  std::optional<int> wanted_degree_;
  GravityField field_;
  std::vector<bool> seen_;
  std::array<int, 2> last_{0, 0};
  int announced_degree_ = -1;
  int line_number_ = 0;
};

std::size_t GravityField::index_of(int n, int m) const {
  if (m < 0 || m > n || n > degree_) {
    throw std::out_of_range("GravityField: n = " + std::to_string(n) +
                            ", m = " + std::to_string(m) +
                            "; accepted: 0 <= m <= n <= " + std::to_string(degree_));
  }
  return triangle_index(n, m);
}

GravityField GravityField::ggm05s() {
  return parse(embedded::ggm05s_d60(), "ggm05s_d60.gfc (compiled in)");
}

GravityField GravityField::load(const std::string& path, std::optional<int> degree) {
  return parse(text::read_file(path, "GravityField::load"), path, degree);
}

GravityField GravityField::parse(std::string_view text, std::string_view source_name,
                                 std::optional<int> degree) {
  return GravityFieldReader(text, source_name, degree).read();
}

}  // namespace orrery
