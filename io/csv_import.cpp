#include "io/csv_import.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <stdexcept>

#include "io/csv_stops.hpp"
#include "io/file_bytes.hpp"
#include "io/log_writer.hpp"
#include "io/messages.hpp"
#include "io/plausibility.hpp"
#include "io/recording_clock.hpp"

namespace bevel::io {
namespace {

// Seconds since the epoch until the year 2286, or of any clock of its own.
constexpr double kLatest_s = 1e10;
// Where a recording begins whose clock began at 0 or later: messages have a positive utime.
constexpr std::int64_t kOwnEpoch_us = 1'000'000;
constexpr double kMostRowsLeftOut = 0.2;
constexpr double kUnitWithin = 0.01;  // files round
constexpr std::size_t kRemarks = 10;

SignedColumn signed_column(const std::string& text) {
  if (text.starts_with('-')) return {text.substr(1), -1};
  if (text.starts_with('+')) return {text.substr(1), 1};
  return {text, 1};
}

std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\"");
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(" \t\r\"") - first + 1));
}

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::size_t from = 0;
  for (std::size_t comma = line.find(','); comma != std::string::npos; comma = line.find(',', from)) {
    cells.push_back(trimmed(std::string_view(line).substr(from, comma - from)));
    from = comma + 1;
  }
  cells.push_back(trimmed(std::string_view(line).substr(from)));
  return cells;
}

// One CSV file, a row at a time; every fault names file, line and column.
class Table {
 public:
  explicit Table(const std::string& path) : path_(path), file_(read_text_file(path)) {
    std::string header;
    if (!std::getline(file_, header)) throw std::runtime_error(path + ": is empty");
    const auto names = split(header);
    for (std::size_t i = 0; i < names.size(); ++i) index_.emplace(names[i], i);
  }

  bool next() {
    std::string line;
    while (std::getline(file_, line)) {
      ++line_;
      if (trimmed(line).empty()) continue;
      cells_ = split(line);
      return true;
    }
    return false;
  }

  double operator[](const std::string& column) const {
    const std::string& cell = text(column);
    double value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(value))
      fail(column, "not a finite number");
    return value;
  }
  // In range once multiplied by sign and scale, so that the messages made of it are what readers accept.
  double within(const SignedColumn& column, double lowest, double highest, const char* unit, double scale = 1) const {
    const double value = scale * column.sign * (*this)[column.name];
    if (!(value >= lowest && value <= highest))
      fail(column.name, "outside what is allowed, " + format_number(lowest) + " to " + format_number(highest) + " " +
                            unit + (scale == 1 ? "" : " after scaling by " + format_number(scale)));
    return value;
  }
  double length_mm(const SignedColumn& column) const {
    return within(column, -kLargestLength_mm, kLargestLength_mm, "mm");
  }
  [[noreturn]] void fail(const std::string& column, const std::string& why) const {
    throw std::runtime_error(place(line_) + "column '" + column + "' is '" + text(column) + "', " + why);
  }
  std::string place(int line) const { return path_ + ":" + std::to_string(line) + ": "; }
  int line() const { return line_; }

 private:
  const std::string& text(const std::string& column) const {
    static const std::string kNothing;
    const auto found = index_.find(column);
    if (found == index_.end()) {
      std::vector<std::string> names;
      for (const auto& [name, i] : index_) names.push_back(name);
      throw std::runtime_error(path_ + ": no column '" + column + "'; the nearest is '" + nearest_name(column, names) +
                               "'");
    }
    return found->second < cells_.size() ? cells_[found->second] : kNothing;
  }

  std::string path_;
  std::istringstream file_;
  std::map<std::string, std::size_t> index_;
  std::vector<std::string> cells_;
  int line_ = 1;
};

// What one row says, and where it stands.
struct Row {
  model::ActuatorState axes;
  model::TipMeasurement tip;
  model::TipHeading heading;
  int line = 0;
};

std::int64_t utime_of(const Table& row, const ColumnMap& map, int index) {
  if (map.seconds.empty()) return kOwnEpoch_us + std::llround(index * 1e6 / map.rate_hz);
  std::int64_t utime = std::llround(row.within({map.seconds, 1}, -kLatest_s, kLatest_s, "s") * 1e6);
  if (!map.nanoseconds.empty()) utime += std::llround(row.within({map.nanoseconds, 1}, 0, 1e9, "ns") * 1e-3);
  return utime;
}

model::TipMeasurement tip_of(const Table& row, const ColumnMap& map, const Eigen::Vector3d& origin) {
  model::TipMeasurement m;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double sigma = map.sigma_mm[i];
    if (!(sigma > 0)) continue;
    m.information_per_mm2(axis, axis) = 1 / (sigma * sigma);
    m.position_mm[axis] = row.length_mm(map.tip[i]) - origin[axis];
    if (!(std::abs(m.position_mm[axis]) <= kLargestLength_mm))
      row.fail(map.tip[i].name, format_number(m.position_mm[axis]) + " mm from the origin; allowed " +
                                    format_number(kLargestLength_mm) + " mm either way");
  }
  return m;
}

model::TipHeading heading_along(const Eigen::Vector3d& along, double information_per_rad2) {
  model::TipHeading m;
  m.heading = along.normalized();
  m.information_per_rad2 = information_per_rad2 * (Eigen::Matrix3d::Identity() - m.heading * m.heading.transpose());
  return m;
}

model::TipHeading heading_of(const Table& row, const ColumnMap& map) {
  Eigen::Vector3d along;
  for (std::size_t i = 0; i < 3; ++i)
    along[static_cast<Eigen::Index>(i)] = row.within(map.heading[i], -1 - kUnitWithin, 1 + kUnitWithin, "");
  if (!(std::abs(along.norm() - 1) <= kUnitWithin))
    row.fail(map.heading[0].name, "and the heading's length is " + format_number(along.norm()) + "; allowed " +
                                      format_number(1 - kUnitWithin) + " to " + format_number(1 + kUnitWithin));
  return heading_along(along, 1 / (map.heading_sd_rad * map.heading_sd_rad));
}

// Rows of one stop into one.
std::vector<Row> stops_of(const std::vector<Row>& rows, const ColumnMap& map, int& between) {
  constexpr Eigen::Index kPosition = 3;
  std::vector<StopRow> readings;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    StopRow one{.depth_mm = rows[i].axes.insertion_mm, .reading = Eigen::VectorXd(2 * kPosition), .row = i};
    one.reading << rows[i].tip.position_mm, rows[i].heading.heading;
    readings.push_back(std::move(one));
  }
  std::vector<Row> out;
  for (const Stop& stop : find_stops(readings, kPosition, between)) {
    Row row = rows[stop.first_row];
    row.axes.utime = row.tip.utime = kOwnEpoch_us * (1 + std::ssize(out));
    row.tip.position_mm = stop.reading.head<3>();
    row.tip.information_per_mm2 *= stop.information_share();
    if (!map.heading.empty())
      row.heading =
          heading_along(stop.reading.tail<3>(), stop.information_share() / (map.heading_sd_rad * map.heading_sd_rad));
    out.push_back(row);
  }
  return out;
}

// Each row's lines of what is implausible in it, and the rows without it.
void leave_out_the_implausible(const Table& table, std::vector<Row>& rows, ImportedRecording& out) {
  for (;;) {
    std::vector<model::ActuatorState> axes;
    std::vector<model::TipMeasurement> tips;
    for (const Row& row : rows) axes.push_back(row.axes), tips.push_back(row.tip);
    const Judgement of_axes = judge(axes);
    const Judgement of_tips = judge(tips, axes);
    std::vector<Row> kept;
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (!of_axes.left_out[i] && !of_tips.left_out[i]) kept.push_back(rows[i]);
    for (const auto* oddities : {&of_axes.oddities, &of_tips.oddities})
      for (const Oddity& oddity : *oddities) {
        const auto row = std::ranges::find(rows, oddity.utime, [](const Row& r) { return r.axes.utime; });
        const std::string text = table.place(row->line) + oddity.what;
        if (!oddity.left_out) throw std::runtime_error(text + "; it lasts, and is no recording of one insertion");
        out.left_out.push_back(text + "; the row is left out");
      }
    if (kept.size() == rows.size()) return;
    rows = std::move(kept);
  }
}

}  // namespace

ColumnMap load_column_map(const std::string& path) {
  ConfigFile file = ConfigFile::load(path);
  ColumnMap map;
  const auto read_columns = [](Section s, const char* key, std::vector<std::string>& names, Presence presence) {
    s.read(key, names, presence, in_range(3, 3));
  };
  Section insertion = file.section("insertion", required);
  insertion.read("stops", map.stops, optional);
  Section time = file.section("time", map.stops ? optional : required);
  time.read("seconds", map.seconds, optional);
  time.read("nanoseconds", map.nanoseconds, optional);
  time.read("rate_hz", map.rate_hz, optional, in_range(1e-3, 1e6));
  if (map.stops && time.present())
    time.fail("", "is given, but insertion.stops = true makes a log without a clock; leave one out");
  else if (time.present() && map.seconds.empty() == (map.rate_hz == 0))
    time.fail("", "either seconds (a column) or rate_hz must be given, and not both");
  Section tip = file.section("tip", required);
  std::vector<std::string> axes, origin;
  read_columns(tip, "axes", axes, required);
  read_columns(tip, "origin", origin, optional);
  tip.read("sigma_mm", map.sigma_mm, required, at_least(0));
  for (const double sigma_mm : map.sigma_mm)  // whose information is still a number that readers accept
    if (sigma_mm != 0 && !(sigma_mm >= 1e-6 && sigma_mm <= 1e6))
      tip.fail("sigma_mm", "is " + format_number(sigma_mm) + " for an axis; allowed are 0, or 1e-06 to 1e+06");
  for (std::size_t i = 0; i < axes.size() && i < 3; ++i) map.tip[i] = signed_column(axes[i]);
  for (const std::string& column : origin) map.origin.push_back(signed_column(column));
  std::vector<std::string> heading;
  read_columns(tip, "heading", heading, optional);
  tip.read("heading_sd_rad", map.heading_sd_rad, heading.empty() ? optional : required, in_range(1e-5, 1));
  for (const std::string& column : heading) map.heading.push_back(signed_column(column));
  std::string column;
  insertion.read("column", column, required);
  map.insertion = signed_column(column);
  insertion.read("settled", map.settled, optional);
  if (map.settled && map.stops) insertion.fail("settled", "is given beside stops; one of them");
  Section rotation = file.section("rotation", optional);
  std::string rotation_column;
  rotation.read("column", rotation_column, rotation.present() ? required : optional);
  rotation.read("scale", map.rotation_scale, optional);
  if (!rotation_column.empty()) map.rotation.push_back(signed_column(rotation_column));
  file.section("rows", optional).read("nonzero", map.nonzero, optional);
  file.finish();
  return map;
}

ImportedRecording import_csv(const std::string& csv_path, const ColumnMap& map) {
  Table table(csv_path);
  ImportedRecording out;
  std::vector<Row> rows;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double last_insertion = 0;
  while (table.next()) {
    const int index = out.rows++;
    const bool empty = std::ranges::any_of(map.nonzero, [&](const std::string& column) { return table[column] == 0; });
    if (empty) {
      ++out.rows_without_data;
      continue;
    }
    const double insertion = table.length_mm(map.insertion);
    if (rows.empty())
      for (std::size_t i = 0; i < map.origin.size(); ++i)
        origin[static_cast<Eigen::Index>(i)] = table.length_mm(map.origin[i]);
    if (!rows.empty() && map.settled && insertion == last_insertion) {
      ++out.rows_unsettled;
      continue;
    }
    last_insertion = insertion;
    Row row;
    row.line = table.line();
    row.axes.utime = map.stops ? kOwnEpoch_us + index : utime_of(table, map, index);
    if (!rows.empty() && row.axes.utime <= rows.back().axes.utime)
      table.fail(map.seconds, "but time does not grow; allowed: later than the row before");
    row.axes.axis_status = {2, 2};
    row.axes.insertion_mm = insertion;
    if (!map.rotation.empty())
      row.axes.rotation_rad =
          table.within(map.rotation[0], -kLargestAngle_rad, kLargestAngle_rad, "rad", map.rotation_scale);
    row.tip = tip_of(table, map, origin);
    row.tip.utime = row.axes.utime;
    if (!map.heading.empty()) row.heading = heading_of(table, map);
    rows.push_back(row);
  }
  if (rows.empty()) throw std::runtime_error(csv_path + ": no row with data by this column map");
  out.has_clock = map.has_clock();
  if (map.stops) rows = stops_of(rows, map, out.rows_unsettled);

  const std::size_t found = rows.size();
  leave_out_the_implausible(table, rows, out);
  out.rows_implausible = static_cast<int>(found - rows.size());
  if (static_cast<double>(found - rows.size()) > kMostRowsLeftOut * static_cast<double>(found))
    throw std::runtime_error(out.left_out.front() + ", as are " + std::to_string(found - rows.size() - 1) +
                             " others of " + std::to_string(found) + "; at most 20 % may be");
  if (rows.front().axes.utime <= 0)
    out.time_shift_s = static_cast<double>(kOwnEpoch_us - rows.front().axes.utime) * 1e-6;
  const std::int64_t shift_us = std::llround(out.time_shift_s * 1e6);
  for (Row& row : rows) {
    model::ActuatorState& a = row.axes;
    a.utime += shift_us;
    row.tip.utime += shift_us;
    // Counted here: a row that was left out is no message that was lost.
    a.seq = row.tip.seq = row.heading.seq = static_cast<std::int64_t>(out.actuators.size());
    row.heading.utime = row.tip.utime;
    if (!out.actuators.empty() && !map.stops) {
      const double dt_s = static_cast<double>(a.utime - out.actuators.back().utime) * 1e-6;
      a.insertion_rate_mm_s = (a.insertion_mm - out.actuators.back().insertion_mm) / dt_s;
      a.rotation_rate_rad_s = (a.rotation_rad - out.actuators.back().rotation_rad) / dt_s;
    }
    const auto require_readable = [&](const auto& message) {
      if (const auto error = check_fields(message))
        throw std::runtime_error(table.place(row.line) + "readers would refuse the message made of this row (" +
                                 io::describe(*error) + ")");
    };
    require_readable(to_message(a));
    require_readable(to_message(row.tip));
    out.actuators.push_back(a);
    out.tips.push_back(row.tip);
    if (map.heading.empty()) continue;
    require_readable(to_message(row.heading));
    out.headings.push_back(row.heading);
  }
  return out;
}

std::string ImportedRecording::remarks(const std::string& name) const {
  std::string text;
  for (std::size_t i = 0; i < std::min(left_out.size(), kRemarks); ++i) text += left_out[i] + "\n";
  if (left_out.size() > kRemarks)
    text += name + ": and " + std::to_string(left_out.size() - kRemarks) + " more such rows\n";
  if (time_shift_s != 0)
    text += name + ": time starts at " + format_number(1e-6 * static_cast<double>(kOwnEpoch_us) - time_shift_s) +
            " s, and messages need a time after 0; shifted by " + format_number(time_shift_s) + " s\n";
  return text;
}

void write_log(const ImportedRecording& recording, const std::string& log_path) {
  const std::string unfinished = log_path + ".unfinished";
  try {
    LogWriter log(unfinished);
    if (!recording.has_clock && !recording.actuators.empty())
      log.write_text(recording.actuators.front().utime, channel::kConfig, kNoClockConfig);
    for (std::size_t i = 0; i < recording.actuators.size(); ++i) {
      log.write_message(recording.actuators[i].utime, channel::kActuatorState, to_message(recording.actuators[i]));
      log.write_message(recording.tips[i].utime, channel::kTipMeasurement, to_message(recording.tips[i]));
      if (!recording.headings.empty())
        log.write_message(recording.headings[i].utime, channel::kTipHeading, to_message(recording.headings[i]));
    }
    log.close();
    std::filesystem::rename(unfinished, log_path);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw;
  }
}

}  // namespace bevel::io
