// SPDX-License-Identifier: MIT
#include "csv_rows.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include <bevel/error.hpp>
#include <bevel/io/message_fields.hpp>
#include "csv_stops.hpp"

namespace bevel::io {
namespace {

// Seconds since the epoch until the year 2286, or of any clock of its own.
constexpr double kLatest_us = 1e16;
constexpr double kUnitWithin = 0.01;  // files round

// The cells of one row, by the map.
class RowReader {
 public:
  RowReader(CsvTable& table, const ColumnMap& map, const TimeColumn& time) : table_(table), map_(map), time_(time) {}

  bool says_it_has_no_data() {
    return std::ranges::any_of(map_.nonzero, [&](const std::string& column) { return table_.number(column) == 0; });
  }

  std::int64_t utime(int index) {
    const std::int64_t offset_us = std::llround(time_.offset_s * 1e6);
    if (time_.column.empty()) return kOwnEpoch_us + std::llround(index * 1e6 / time_.rate_hz) + offset_us;
    const auto cell = table_.number(time_.column);
    if (!cell) table_.fail(time_.column, "and every row with data needs a time");
    const double value_us = *cell * time_.us_per_unit;
    if (!(std::abs(value_us) <= kLatest_us))
      table_.fail(time_.column, "outside what is allowed, " + format_number(-kLatest_us / time_.us_per_unit) + " to " +
                                    format_number(kLatest_us / time_.us_per_unit) + " " + time_.unit());
    std::int64_t utime = std::llround(value_us) + offset_us;
    if (time_.nanoseconds.empty()) return utime;
    const auto nanoseconds = table_.number(time_.nanoseconds);
    if (!nanoseconds || !(*nanoseconds >= 0 && *nanoseconds <= 1e9))
      table_.fail(time_.nanoseconds, "outside what is allowed, 0 to 1e+09 ns");
    return utime + std::llround(*nanoseconds * 1e-3);
  }

  std::optional<double> insertion_mm() {
    auto value_mm = length_mm(map_.insertion, map_.mm_per_insertion_unit);
    if (value_mm) *value_mm += map_.insertion_offset_mm;
    if (value_mm && !(std::abs(*value_mm) <= kLargestLength_mm))
      table_.fail(map_.insertion.name, "with offset_mm " + format_number(*value_mm) + " mm; allowed " +
                                           format_number(kLargestLength_mm) + " mm either way");
    return value_mm;
  }
  std::optional<double> rotation_rad() {
    if (map_.rotation.empty()) return std::nullopt;
    return within(map_.rotation[0], kLargestAngle_rad, "rad", map_.rad_per_rotation_unit);
  }

  std::optional<model::TipMeasurement> tip() {
    if (!origin_mm_ && !(origin_mm_ = read_origin())) return std::nullopt;
    model::TipMeasurement m;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      const double sigma_mm = map_.sigma_mm[i];
      if (!(sigma_mm > 0)) continue;
      const auto value_mm = length_mm(map_.tip[i], map_.mm_per_tip_unit);
      if (!value_mm) continue;
      m.information_per_mm2(axis, axis) = 1 / (sigma_mm * sigma_mm);
      m.position_mm[axis] = *value_mm - (*origin_mm_)[axis];
    }
    if (m.information_per_mm2.isZero(0)) return std::nullopt;
    if (map_.needs_all_axes() && (m.information_per_mm2.diagonal().array() == 0).any()) return std::nullopt;
    if (map_.transform) m.position_mm = map_.transform->rotation * m.position_mm + map_.transform->translation_mm;
    for (std::size_t i = 0; i < 3; ++i)
      if (const double at_mm = m.position_mm[static_cast<Eigen::Index>(i)]; !(std::abs(at_mm) <= kLargestLength_mm))
        table_.fail(map_.tip[i].name, format_number(at_mm) + " mm from the origin; allowed " +
                                          format_number(kLargestLength_mm) + " mm either way");
    return m;
  }

  std::optional<model::TipHeading> heading() {
    const auto along = map_.quaternion ? of_quaternion(*map_.quaternion) : of_columns();
    if (!along) return std::nullopt;
    return heading_along(map_.transform ? map_.transform->rotation * *along : *along,
                         1 / (map_.heading_sd_rad * map_.heading_sd_rad));
  }

 private:
  // `scale` times the cell, at most `largest` either way: so that the messages made of it are what readers accept.
  std::optional<double> within(const SignedColumn& column, double largest, const char* unit, double scale) {
    const auto cell = table_.number(column.name);
    if (!cell) return std::nullopt;
    const double value = scale * column.sign * *cell;
    if (!(std::abs(value) <= largest))
      table_.fail(column.name, "outside what is allowed, " + format_number(-largest) + " to " + format_number(largest) +
                                   " " + unit + (scale == 1 ? "" : ", of which its unit has " + format_number(scale)));
    return value;
  }
  std::optional<double> length_mm(const SignedColumn& column, double mm_per_unit) {
    return within(column, kLargestLength_mm, "mm", mm_per_unit);
  }

  std::optional<Eigen::Vector3d> read_origin() {
    Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < map_.origin.size(); ++i) {
      const auto value_mm = length_mm(map_.origin[i], map_.mm_per_tip_unit);
      if (!value_mm) return std::nullopt;
      origin_mm[static_cast<Eigen::Index>(i)] = *value_mm;
    }
    return origin_mm;
  }

  // Cells that together have unit length, as far as files round; nothing if one of them is empty.
  template <std::size_t N>
  std::optional<Eigen::Matrix<double, N, 1>> unit_length(const std::array<SignedColumn, N>& columns, const char* what) {
    Eigen::Matrix<double, N, 1> values;
    for (std::size_t i = 0; i < N; ++i) {
      const auto value = within(columns[i], 1 + kUnitWithin, "", 1);
      if (!value) return std::nullopt;
      values[static_cast<Eigen::Index>(i)] = *value;
    }
    if (!(std::abs(values.norm() - 1) <= kUnitWithin))
      table_.fail(columns[0].name, std::string("and the ") + what + "'s length is " + format_number(values.norm()) +
                                       "; allowed " + format_number(1 - kUnitWithin) + " to " +
                                       format_number(1 + kUnitWithin));
    return values;
  }
  std::optional<Eigen::Vector3d> of_columns() {
    return unit_length<3>({map_.heading[0], map_.heading[1], map_.heading[2]}, "heading");
  }
  std::optional<Eigen::Vector3d> of_quaternion(const QuaternionColumns& q) {
    const auto wxyz =
        unit_length<4>({SignedColumn{q.wxyz[0], 1}, {q.wxyz[1], 1}, {q.wxyz[2], 1}, {q.wxyz[3], 1}}, "quaternion");
    if (!wxyz) return std::nullopt;
    const Eigen::Quaterniond turn((*wxyz)[0], (*wxyz)[1], (*wxyz)[2], (*wxyz)[3]);
    const Eigen::Vector3d along =
        turn.normalized() * (q.along_sign * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(q.along)));
    Eigen::Vector3d in_A;
    for (std::size_t i = 0; i < 3; ++i)
      in_A[static_cast<Eigen::Index>(i)] = q.sign[i] * along[static_cast<Eigen::Index>(q.axis[i])];
    return in_A;
  }

  CsvTable& table_;
  const ColumnMap& map_;
  const TimeColumn& time_;
  std::optional<Eigen::Vector3d> origin_mm_;
};

// Rows of one stop into one.
std::vector<CsvRow> stops_of(const std::vector<CsvRow>& rows, const ColumnMap& map, int& between) {
  constexpr Eigen::Index kPosition = 3;
  std::vector<StopRow> readings;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    StopRow one{.depth_mm = *rows[i].insertion_mm, .reading = Eigen::VectorXd::Zero(2 * kPosition), .row = i};
    one.reading.head<3>() = rows[i].tip->position_mm;
    if (rows[i].heading) one.reading.tail<3>() = rows[i].heading->heading;
    readings.push_back(std::move(one));
  }
  std::vector<CsvRow> out;
  for (const Stop& stop : find_stops(readings, kPosition, between)) {
    CsvRow row = rows[stop.first_row];
    row.utime = kOwnEpoch_us * (1 + std::ssize(out));
    row.tip->position_mm = stop.reading.head<3>();
    row.tip->information_per_mm2 *= stop.information_share();
    if (row.heading)
      row.heading =
          heading_along(stop.reading.tail<3>(), stop.information_share() / (map.heading_sd_rad * map.heading_sd_rad));
    out.push_back(row);
  }
  return out;
}

// A stepwise insertion needs all of a row: which axes it sees must not change from stop to stop.
// Of a stepwise insertion: what a row has to have. A needle that is turned on the way may have rows of the base alone.
bool complete(const CsvRow& row, const ColumnMap& map) {
  if (!row.insertion_mm || (!map.rotation.empty() && !row.rotation_rad)) return false;
  if (map.settled && !map.rotation.empty() && !row.tip && !row.heading) return true;
  if (!row.tip || (map.has_heading() && !row.heading)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    if (map.sigma_mm[i] > 0 && !(row.tip->information_per_mm2(axis, axis) > 0)) return false;
  }
  return true;
}

// Refuses a row that is not later than the one before it that read the same.
class Clock {
 public:
  void require_later(const CsvTable& table, const TimeColumn& time, const CsvRow& row) {
    const std::array reads = {row.insertion_mm.has_value(), row.rotation_rad.has_value(),
                              row.tip.has_value() || row.heading.has_value()};
    for (std::size_t i = 0; i < reads.size(); ++i) {
      if (!reads[i]) continue;
      if (last_[i].line > 0 && row.utime <= last_[i].utime) {
        const std::string why = "but time does not grow; allowed: later than in line " + std::to_string(last_[i].line);
        if (!time.column.empty()) table.fail(time.column, why);
        throw ParseError(table.place(row.line) + why);
      }
      last_[i] = {row.utime, row.line};
    }
  }

 private:
  struct Last {
    std::int64_t utime = 0;
    int line = 0;
  };
  std::array<Last, 3> last_;
};

using Series = std::vector<std::pair<std::int64_t, double>>;

double at(const Series& series, std::int64_t utime) {
  const auto later = std::ranges::lower_bound(series, utime, {}, &Series::value_type::first);
  if (later->first == utime) return later->second;
  const auto earlier = std::prev(later);
  const double share = static_cast<double>(utime - earlier->first) / static_cast<double>(later->first - earlier->first);
  return earlier->second + share * (later->second - earlier->second);
}

}  // namespace

model::TipHeading heading_along(const Eigen::Vector3d& along, double information_per_rad2) {
  model::TipHeading m;
  m.heading = along.normalized();
  const Eigen::Vector3d& h = m.heading;
  m.information_per_rad2 = -h * h.transpose();
  // 1 - h_x^2, which by rounding would be below 0 for a heading along an axis.
  m.information_per_rad2.diagonal() << h.y() * h.y() + h.z() * h.z(), h.x() * h.x() + h.z() * h.z(),
      h.x() * h.x() + h.y() * h.y();
  m.information_per_rad2 *= information_per_rad2;
  return m;
}

CsvRows read_rows(CsvTable& table, const ColumnMap& map, const TimeColumn& time, CsvParts parts) {
  table.set_unseen(map.unseen);
  RowReader reader(table, map, time);
  Clock clock;
  CsvRows out;
  const auto stays = [&](const CsvRow& row) {
    const CsvRow& last = out.rows.back();
    return row.insertion_mm == last.insertion_mm && row.rotation_rad == last.rotation_rad && (last.tip || !row.tip);
  };
  while (table.next()) {
    const int index = out.read++;
    if (parts.tip && reader.says_it_has_no_data()) {
      ++out.without_data;
      continue;
    }
    CsvRow row;
    row.line = table.line();
    if (parts.base) {
      row.insertion_mm = reader.insertion_mm();
      row.rotation_rad = reader.rotation_rad();
    }
    if (parts.tip) row.tip = reader.tip();
    if (parts.tip && map.has_heading()) row.heading = reader.heading();
    const bool anything = row.insertion_mm || row.rotation_rad || row.tip || row.heading;
    if (!anything || (!map.has_clock() && !complete(row, map))) {
      ++out.without_data;
      continue;
    }
    if (map.settled && !out.rows.empty() && stays(row)) {
      ++out.unsettled;
      continue;
    }
    row.utime = map.stops ? kOwnEpoch_us + index : reader.utime(index);
    clock.require_later(table, time, row);
    out.rows.push_back(std::move(row));
  }
  if (out.rows.empty()) throw ParseError(table.path() + ": no row with data by this column map");
  if (map.stops) out.rows = stops_of(out.rows, map, out.unsettled);
  // Rows of the base may follow all rows of the tip: each grows, both together need not.
  std::ranges::stable_sort(out.rows, {}, &CsvRow::utime);
  return out;
}

std::vector<BaseReading> base_motion(const std::vector<CsvRow>& rows, bool has_rotation) {
  Series insertion, rotation;
  for (const CsvRow& row : rows) {
    if (row.insertion_mm) insertion.emplace_back(row.utime, *row.insertion_mm);
    if (row.rotation_rad) rotation.emplace_back(row.utime, *row.rotation_rad);
  }
  std::vector<BaseReading> out;
  if (insertion.empty() || (has_rotation && rotation.empty())) return out;
  for (const CsvRow& row : rows) {
    if (!row.insertion_mm && !row.rotation_rad) continue;
    if (row.utime < insertion.front().first || row.utime > insertion.back().first) continue;
    if (has_rotation && (row.utime < rotation.front().first || row.utime > rotation.back().first)) continue;
    // Each axis may have a row of its own for one instant.
    if (!out.empty() && out.back().axes.utime >= row.utime) continue;
    BaseReading reading;
    reading.line = row.line;
    reading.axes.utime = row.utime;
    reading.axes.axis_status = {2, 2};
    reading.axes.insertion_mm = at(insertion, row.utime);
    if (has_rotation) reading.axes.rotation_rad = at(rotation, row.utime);
    out.push_back(reading);
  }
  return out;
}

}  // namespace bevel::io
