#include "io/csv_import.hpp"

#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <stdexcept>

#include "io/log_writer.hpp"
#include "io/messages.hpp"

namespace bevel::io {
namespace {

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
  explicit Table(const std::string& path) : path_(path), file_(path) {
    if (!file_) throw std::runtime_error(path + ": cannot be read");
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
    const auto found = index_.find(column);
    if (found == index_.end()) {
      std::vector<std::string> names;
      for (const auto& [name, i] : index_) names.push_back(name);
      throw std::runtime_error(path_ + ": no column '" + column + "'; the nearest is '" + nearest_name(column, names) +
                               "'");
    }
    double value = 0;
    const std::string cell = found->second < cells_.size() ? cells_[found->second] : "";
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(value))
      throw std::runtime_error(path_ + ":" + std::to_string(line_) + ": column '" + column + "' is '" + cell +
                               "', not a finite number");
    return value;
  }
  double operator[](const SignedColumn& column) const { return column.sign * (*this)[column.name]; }

 private:
  std::string path_;
  std::ifstream file_;
  std::map<std::string, std::size_t> index_;
  std::vector<std::string> cells_;
  int line_ = 1;
};

}  // namespace

ColumnMap load_column_map(const std::string& path) {
  ConfigFile file = ConfigFile::load(path);
  ColumnMap map;
  const auto read_columns = [](Section s, const char* key, std::vector<std::string>& names, Presence presence) {
    s.read(key, names, presence, in_range(3, 3));
  };
  Section time = file.section("time", required);
  time.read("seconds", map.seconds, optional);
  time.read("nanoseconds", map.nanoseconds, optional);
  time.read("rate_hz", map.rate_hz, optional, above(0));
  if (time.present() && map.seconds.empty() == (map.rate_hz == 0))
    time.fail("", "either seconds (a column) or rate_hz must be given, and not both");
  Section tip = file.section("tip", required);
  std::vector<std::string> axes, origin;
  read_columns(tip, "axes", axes, required);
  read_columns(tip, "origin", origin, optional);
  tip.read("sigma_mm", map.sigma_mm, required, at_least(0));
  for (std::size_t i = 0; i < axes.size() && i < 3; ++i) map.tip[i] = signed_column(axes[i]);
  for (const std::string& column : origin) map.origin.push_back(signed_column(column));
  Section insertion = file.section("insertion", required);
  std::string column;
  insertion.read("column", column, required);
  map.insertion = signed_column(column);
  insertion.read("settled", map.settled, optional);
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
  Table row(csv_path);
  ImportedRecording out;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  bool started = false;
  double last_insertion = 0;
  while (row.next()) {
    const int index = out.rows++;
    bool empty = false;
    for (const std::string& column : map.nonzero) empty = empty || row[column] == 0;
    if (empty) {
      ++out.rows_without_data;
      continue;
    }
    const double insertion = row[map.insertion];
    if (!started)
      for (std::size_t i = 0; i < map.origin.size(); ++i) origin[static_cast<Eigen::Index>(i)] = row[map.origin[i]];
    if (started && map.settled && insertion == last_insertion) {
      ++out.rows_unsettled;
      continue;
    }
    started = true;
    last_insertion = insertion;

    std::int64_t utime = 0;
    if (map.seconds.empty()) {
      utime = 1'000'000 + std::llround(index * 1e6 / map.rate_hz);
    } else {
      utime = std::llround(row[map.seconds] * 1e6);
      if (!map.nanoseconds.empty()) utime += std::llround(row[map.nanoseconds] * 1e-3);
    }
    model::ActuatorState a;
    a.utime = utime;
    a.seq = static_cast<std::int64_t>(out.actuators.size());
    a.axis_status = {2, 2};
    a.insertion_mm = insertion;
    if (!map.rotation.empty()) a.rotation_rad = map.rotation_scale * row[map.rotation[0]];
    if (!out.actuators.empty()) {
      const double dt_s = static_cast<double>(utime - out.actuators.back().utime) * 1e-6;
      if (!(dt_s > 0)) throw std::runtime_error(csv_path + ": time does not grow at row " + std::to_string(index + 1));
      a.insertion_rate_mm_s = (a.insertion_mm - out.actuators.back().insertion_mm) / dt_s;
      a.rotation_rate_rad_s = (a.rotation_rad - out.actuators.back().rotation_rad) / dt_s;
    }
    out.actuators.push_back(a);

    model::TipMeasurement m;
    m.utime = utime;
    m.seq = a.seq;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      const double sigma = map.sigma_mm[i];
      m.information_per_mm2(axis, axis) = sigma > 0 ? 1 / (sigma * sigma) : 0;
      m.position_mm[axis] = sigma > 0 ? row[map.tip[i]] - origin[axis] : 0;
    }
    out.tips.push_back(m);
  }
  if (out.tips.empty()) throw std::runtime_error(csv_path + ": no row with data by this column map");
  return out;
}

void write_log(const ImportedRecording& recording, const std::string& log_path) {
  LogWriter log(log_path);
  for (std::size_t i = 0; i < recording.actuators.size(); ++i) {
    log.write_message(recording.actuators[i].utime, channel::kActuatorState, to_message(recording.actuators[i]));
    log.write_message(recording.tips[i].utime, channel::kTipMeasurement, to_message(recording.tips[i]));
  }
  log.close();
}

}  // namespace bevel::io
