#include <orrery/models/frames/eop_nutation_offsets.hpp>
#include <orrery/models/frames/eop_readers.hpp>
#include <orrery/models/frames/eop_table.hpp>
#include <orrery/models/frames/time_scales.hpp>
#include <orrery/models/text/numbered_lines.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace orrery {
namespace {

constexpr double kArcsecond_rad = 4.848136811095359935899141e-6;
constexpr double kDay_s = 86400;
constexpr int kPoints = 4;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// 0h UTC of a day from 1980 on. GPS - UTC was zero, TAI - UTC 19 s, on 1980-01-06.
SimTime utc_midnight(int mjd) {
  constexpr int kMjdGpsEpoch = 44244;
  return SimTime(days(mjd - kMjdGpsEpoch) + (eop::tai_minus_utc_s(mjd) - 19) * 1s);
}

bool is_celestrak(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  return text.starts_with("VERSION") || text.starts_with("#") || text.starts_with("NUM_") ||
         text.starts_with("BEGIN");
}

// Weights of the Lagrange polynomial through `nodes` at `x`.
std::array<double, kPoints> lagrange_weights(const std::array<double, kPoints>& nodes, double x) {
  std::array<double, kPoints> weights;
  for (int i = 0; i < kPoints; ++i) {
    weights[i] = 1;
    for (int j = 0; j < kPoints; ++j) {
      if (j != i) weights[i] *= (x - nodes[j]) / (nodes[i] - nodes[j]);
    }
  }
  return weights;
}

}  // namespace

EarthOrientationTable EarthOrientationTable::parse(std::string_view text,
                                                   std::string_view source_name) {
  const eop::File file = is_celestrak(text) ? eop::read_celestrak(text, source_name)
                                            : eop::read_finals2000a(text, source_name);
  EarthOrientationTable table;
  table.source_ = source_name;
  table.offsets_ = file.offsets == eop::PoleOffsets::kIau1980 ? Offsets::kDpsiDeps : Offsets::kDxDy;
  for (const eop::Row& row : file.rows) {
    if (row.mjd < eop::kMjd1980) continue;
    const SimTime t = utc_midnight(row.mjd);
    table.rows_.push_back({.t = t,
                           .ut1_minus_tai_s = row.ut1_minus_utc_s - eop::tai_minus_utc_s(row.mjd),
                           .x_pole_rad = kArcsecond_rad * row.x_pole_arcsec,
                           .y_pole_rad = kArcsecond_rad * row.y_pole_arcsec,
                           .offset_1_rad = kArcsecond_rad * row.first_offset_arcsec.value_or(0),
                           .offset_2_rad = kArcsecond_rad * row.second_offset_arcsec.value_or(0),
                           .length_of_day_s = row.length_of_day_s.value_or(kUnknown)});
    if (!row.predicted || table.rows_.size() == 1) table.last_observed_ = t;
  }
  if (table.rows_.size() < kPoints)
    throw std::invalid_argument("EarthOrientationTable: " + table.source_ + ": " +
                                std::to_string(table.rows_.size()) +
                                " rows since 1980; at least 4 are needed");
  table.fill_length_of_day();
  return table;
}

// What a prediction leaves out follows from its UT1: a long day is one in which UT1 falls behind.
void EarthOrientationTable::fill_length_of_day() {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!std::isnan(rows_[i].length_of_day_s)) continue;
    const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, rows_.size() - 1);
    rows_[i].length_of_day_s = -(rows_[after].ut1_minus_tai_s - rows_[before].ut1_minus_tai_s) /
                               static_cast<double>(after - before);
  }
}

EarthOrientationTable EarthOrientationTable::load(const std::string& path) {
  return parse(text::read_file(path, "EarthOrientationTable::load"), path);
}

void EarthOrientationTable::require_rows(const char* function) const {
  if (is_none())
    throw std::logic_error(std::string("EarthOrientationTable::") + function +
                           ": a table without rows has no first or last day");
}

SimTime EarthOrientationTable::first() const {
  require_rows("first");
  return rows_.front().t;
}

SimTime EarthOrientationTable::last() const {
  require_rows("last");
  return rows_.back().t;
}

SimTime EarthOrientationTable::last_observed() const {
  require_rows("last_observed");
  return last_observed_;
}

// The row with row.t <= t < next row's, or the last but one.
std::size_t EarthOrientationTable::row_before(SimTime t) const {
  if (t < first() || t > last())
    throw std::out_of_range("EarthOrientationTable::at: t = " + to_string(t) + " is outside " +
                            source_ + ", which covers " + to_string(first()) + " to " +
                            to_string(last()));
  const auto after =
      std::upper_bound(rows_.begin(), rows_.end() - 1, t,
                       [](SimTime instant, const Row& row) { return instant < row.t; });
  return static_cast<std::size_t>(after - rows_.begin()) - 1;
}

EarthOrientationTable::Span EarthOrientationTable::rows_around(SimTime t) const {
  require_rows("rows_around");
  const std::size_t i = row_before(t);
  return {rows_[i].t, rows_[i + 1].t};
}

EarthOrientationParameters EarthOrientationTable::at(SimTime t) const {
  if (is_none()) return {};
  // Two rows on either side of t, where the table has them.
  const std::size_t before = std::max<std::size_t>(row_before(t), 1);
  const Row* const rows = &rows_[std::min(before - 1, rows_.size() - kPoints)];

  std::array<double, kPoints> nodes;
  for (int i = 0; i < kPoints; ++i) nodes[i] = to_seconds(rows[i].t - rows[0].t) / kDay_s;
  const std::array<double, kPoints> weights =
      lagrange_weights(nodes, to_seconds(t - rows[0].t) / kDay_s);
  const auto interpolated = [&](double Row::*quantity) {
    double sum = 0;
    for (int i = 0; i < kPoints; ++i) sum += weights[i] * rows[i].*quantity;
    return sum;
  };

  EarthOrientationParameters p;
  p.ut1_minus_utc_s = interpolated(&Row::ut1_minus_tai_s) + leap_seconds(t);
  p.x_pole_rad = interpolated(&Row::x_pole_rad);
  p.y_pole_rad = interpolated(&Row::y_pole_rad);
  p.length_of_day_s = interpolated(&Row::length_of_day_s);
  p.dpsi_rad = interpolated(&Row::offset_1_rad);
  p.deps_rad = interpolated(&Row::offset_2_rad);
  if (offsets_ == Offsets::kDxDy) {
    const eop::NutationOffsets offsets =
        eop::offsets_to_iau1980(gps_to_tt(t), p.dpsi_rad, p.deps_rad);
    p.dpsi_rad = offsets.dpsi_rad;
    p.deps_rad = offsets.deps_rad;
  }
  return p;
}

}  // namespace orrery
