#include <orrery/harness/record/csv_writer.hpp>
#include <orrery/harness/record/number_format.hpp>

#include <stdexcept>

namespace orrery {

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
  begin_field();
  append_number(row_, value);
  return *this;
}

CsvWriter& CsvWriter::integer(std::int64_t value) {
  begin_field();
  append_number(row_, value);
  return *this;
}

CsvWriter& CsvWriter::integer(std::uint64_t value) {
  begin_field();
  append_number(row_, value);
  return *this;
}

CsvWriter& CsvWriter::text(std::string_view value) {
  begin_field();
  if (value.find_first_of(",\"\r\n") == std::string_view::npos) {
    row_ += value;
    return *this;
  }
  row_ += '"';
  for (const char c : value) {
    if (c == '"') row_ += '"';
    row_ += c;
  }
  row_ += '"';
  return *this;
}

void CsvWriter::end_row() {
  if (fields_ != columns_) {
    throw std::logic_error("CsvWriter: " + file_.path().string() + ": " + std::to_string(fields_) +
                           " fields in a row of " + std::to_string(columns_));
  }
  row_ += '\n';
  file_.write(row_);
  row_.clear();
  fields_ = 0;
}

void CsvWriter::close() {
  if (fields_ != 0) {
    throw std::logic_error("CsvWriter: " + file_.path().string() + " closed within a row");
  }
  file_.close();
}

void CsvWriter::begin_field() {
  if (fields_ == columns_) {
    throw std::logic_error("CsvWriter: " + file_.path().string() + ": more than " +
                           std::to_string(columns_) + " fields in a row");
  }
  if (fields_ > 0) row_ += ',';
  ++fields_;
}

}  // namespace orrery
