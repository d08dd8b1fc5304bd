#include <orrery/harness/record/channel_table.hpp>

#include <algorithm>
#include <cctype>

namespace orrery {
namespace {

constexpr std::size_t kLongestName = 200;  // file systems take 255 bytes, with ".csv" and more

bool is_kept(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-' || c == '+' || c == '.';
}

bool is_worded(const Channel& channel) {
  return channel.kind() == ChannelKind::kState || channel.kind() == ChannelKind::kEvent;
}

}  // namespace

std::string file_name_of(std::string_view channel) {
  std::string name(channel.substr(0, kLongestName));
  std::replace(name.begin(), name.end(), '/', '.');
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !is_kept(c); }, '_');
  if (name.empty() || name.front() == '.')
    name.insert(name.begin(), '_');  // neither hidden nor a folder
  return name;
}

std::vector<std::string> columns_of(const Channel& channel) {
  const std::string quantity = channel.name().substr(channel.name().rfind('/') + 1);
  std::vector<std::string> columns = {"t_GPS_ns"};
  if (channel.kind() != ChannelKind::kVector) {
    columns.push_back(quantity);
    return columns;
  }
  std::string unit = channel.unit();
  if (!unit.empty()) unit.insert(unit.begin(), '_');
  const std::string before = quantity.substr(0, quantity.size() - unit.size()) + "_";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const char letter = channel.axis_name(axis).front();
    columns.push_back(before + static_cast<char>(std::tolower(letter)) + unit);
  }
  return columns;
}

void write_rows(CsvWriter& csv, const Channel& channel) {
  const std::vector<Channel::Sample>& samples = channel.samples();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    csv.time(samples[i].t);
    if (is_worded(channel)) {
      csv.text(channel.text(samples[i]));
    } else if (channel.kind() == ChannelKind::kVector) {
      for (const double component : channel.vectors()[i]) csv.number(component);
    } else {
      csv.number(samples[i].value);
    }
    csv.end_row();
  }
}

}  // namespace orrery
