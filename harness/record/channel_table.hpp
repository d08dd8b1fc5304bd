/// Channels as tables, a file each.
#pragma once

#include <orrery/harness/record/channel.hpp>
#include <orrery/harness/record/csv_writer.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace orrery {

/// A file name of the channel's, without folder and extension: '/' becomes '.', and all but
/// letters, digits, '_', '-', '+' and '.' become '_'. At most 200 characters; different channels
/// may share it.
std::string file_name_of(std::string_view channel);

/// t_GPS_ns, then what the channel's name ends in: "angle_rad"; of a vector one column per axis,
/// "offset_RTN_r_m", "offset_RTN_t_m", "offset_RTN_n_m"; of states and events their text.
std::vector<std::string> columns_of(const Channel& channel);

/// A row for each sample, in the order of recording; numbers are the shortest that read back.
void write_rows(CsvWriter& csv, const Channel& channel);

}  // namespace orrery
