#include <orrery/harness/record/csv_writer.hpp>
#include <orrery/harness/record/number_format.hpp>

#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <stdexcept>

namespace orrery {
namespace {

constexpr std::size_t kValuesAtOnce = 4096;

std::uint64_t bits_of(double value) {
  return std::isnan(value) ? 0x7ff8000000000000 : std::bit_cast<std::uint64_t>(value);
}

}  // namespace

CsvWriter::CsvWriter(const std::filesystem::path& path,
                     const std::vector<std::string_view>& columns)
    : file_(path), columns_(columns.size()) {
  if (columns.empty()) {
    throw std::invalid_argument("CsvWriter: " + path.string() + " is to have no columns");
  }
  for (const std::string_view column : columns) text(column);
  end_row();
}

CsvWriter& CsvWriter::number(double value) {
  end_field(write_number(begin_fields(1), value));
  add_value(bits_of(value));
  return *this;
}

CsvWriter& CsvWriter::fixed(std::initializer_list<double> values, int decimals) {
  char* out = begin_fields(values.size());
  const char* const begin = out;
  for (const double value : values) {
    if (out != begin) *out++ = ',';
    out = write_fixed(out, value, decimals);
    add_value(bits_of(value));
  }
  end_field(out);
  return *this;
}

CsvWriter& CsvWriter::integer(std::int64_t value) {
  end_field(write_number(begin_fields(1), value));
  add_value(static_cast<std::uint64_t>(value));
  return *this;
}

CsvWriter& CsvWriter::integer(std::uint64_t value) {
  end_field(write_number(begin_fields(1), value));
  add_value(value);
  return *this;
}

CsvWriter& CsvWriter::text(std::string_view value) {
  begin_fields(1);
  const bool quoted = value.find_first_of(",\"\r\n") != std::string_view::npos;
  char* out = room(2 * value.size() + 2);
  if (quoted) *out++ = '"';
  for (const char c : value) {
    if (c == '"') *out++ = '"';
    *out++ = c;
  }
  if (quoted) *out++ = '"';
  end_field(out);
  if (sink_) {
    add_value(value.size());
    hand_over_values();
    sink_(std::as_bytes(std::span(value)));
  }
  return *this;
}

void CsvWriter::end_row() {
  if (fields_ != columns_) {
    throw std::logic_error("CsvWriter: " + file_.path().string() + ": " + std::to_string(fields_) +
                           " fields in a row of " + std::to_string(columns_));
  }
  if (values_.size() >= kValuesAtOnce) hand_over_values();
  *room(1) = '\n';
  file_.write(std::string_view(row_.data(), end_ + 1));
  end_ = 0;
  fields_ = 0;
}

void CsvWriter::close() {
  if (fields_ != 0) {
    throw std::logic_error("CsvWriter: " + file_.path().string() + " closed within a row");
  }
  hand_over_values();
  file_.close();
}

// Room for numbers; a text asks for more. @returns  where they go.
char* CsvWriter::begin_fields(std::size_t count) {
  if (count > columns_ - fields_) {
    throw std::logic_error("CsvWriter: " + file_.path().string() + ": more than " +
                           std::to_string(columns_) + " fields in a row");
  }
  char* out = room(1 + count * (1 + kLongestNumber));
  if (fields_ > 0) {
    *out++ = ',';
    ++end_;
  }
  fields_ += count;
  return out;
}

void CsvWriter::end_field(const char* end) {
  end_ = static_cast<std::size_t>(end - row_.data());
}

char* CsvWriter::room(std::size_t bytes) {
  if (row_.size() - end_ < bytes) row_.resize(2 * (row_.size() + bytes));
  return row_.data() + end_;
}

void CsvWriter::add_value(std::uint64_t value) {
  if (!sink_) return;
  values_.push_back(value);
}

void CsvWriter::hand_over_values() {
  if (!sink_ || values_.empty()) return;
  sink_(std::as_bytes(std::span(values_)));
  values_.clear();
}

}  // namespace orrery
