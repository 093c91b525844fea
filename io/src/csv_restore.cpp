// SPDX-License-Identifier: MIT
// An exported folder back into a recording, and that into a log.
#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <map>

#include <bevel/error.hpp>
#include <bevel/io/config.hpp>
#include <bevel/io/csv_columns.hpp>
#include <bevel/io/csv_export.hpp>
#include <bevel/io/csv_table.hpp>
#include <bevel/io/file_bytes.hpp>
#include <bevel/io/log_order.hpp>
#include <bevel/io/log_writer.hpp>
#include <bevel/io/messages.hpp>

namespace bevel::io {
namespace {

namespace fs = std::filesystem;
constexpr std::array kTables{exported::kTips,     exported::kHeadings,  exported::kAxes,
                             exported::kCommands, exported::kEstimates, exported::kTruths};

// Fills a message from one row.
class FromRow {
 public:
  explicit FromRow(CsvTable& table) : table_(table) {}
  template <class Integer>
  void whole(const std::string& name, Integer& value) {
    const auto cell = table_.integer(name);
    if (!cell || *cell < std::numeric_limits<Integer>::min() || *cell > std::numeric_limits<Integer>::max())
      table_.fail(name, "not a number that this field can have");
    value = static_cast<Integer>(*cell);
  }
  void number(const std::string& name, double& value) {
    const auto cell = table_.number(name);
    if (!cell) table_.fail(name, "and must be given");
    value = *cell;
  }
  template <class IsSeen>
  void seen(const std::string& name, double& value, IsSeen&&) {
    value = table_.number(name).value_or(0);
  }

 private:
  CsvTable& table_;
};

/// Number of rows of each exported table and of bytes of config.toml, by file name; empty without rows.toml, which
/// older exports do not have.
std::map<std::string, std::int64_t> read_sizes(const std::string& folder) {
  const std::string path = folder + "/" + exported::kRows;
  std::map<std::string, std::int64_t> counts;
  if (!fs::exists(path)) return counts;
  ConfigFile file = ConfigFile::load(path);
  for (const char* name : kTables) {
    std::int64_t rows = -1;
    file.root().read(fs::path(name).stem().string(), rows, optional, at_least(0));
    if (rows >= 0) counts[name] = rows;
  }
  std::int64_t config_bytes = -1;
  file.root().read("config_bytes", config_bytes, optional, at_least(0));
  if (config_bytes >= 0) counts[exported::kConfig] = config_bytes;
  file.finish();
  return counts;
}

/// Checks that no file was cut, by a full disk or an interrupted copy for instance.
/// @param sizes  found: rows of each table, bytes of config.toml
/// @throws ParseError with the file, both sizes and the remedy
void require_all(const std::string& folder, const std::map<std::string, std::int64_t>& sizes) {
  for (const auto& [name, expected] : read_sizes(folder)) {
    const auto found = sizes.find(name);
    const std::int64_t count = found == sizes.end() ? 0 : found->second;
    const char* unit = name == exported::kConfig ? " bytes; " : " rows; ";
    if (count != expected)
      throw ParseError(folder + "/" + name + ": has " + std::to_string(count) + unit + exported::kRows + " lists " +
                       std::to_string(expected) +
                       ". The folder is incomplete: export or copy it again. If it was changed on purpose, "
                       "remove " +
                       exported::kRows);
  }
}

/// Checks that the last line is complete: a number that is cut is another number.
void require_line_end(const std::string& path) {
  const std::string text = read_text_file(path);
  if (!text.empty() && text.back() != '\n' && text.back() != '\r')
    throw ParseError(path + ": its last line has no line end, so that the file may be cut; export or copy it " +
                     "again, or add the line end if the file is complete");
}

template <class Message, class Take>
void read_file(const std::string& folder, const char* name, std::map<std::string, std::int64_t>& rows, Take&& take) {
  const std::string path = folder + "/" + name;
  if (!fs::exists(path)) return;
  require_line_end(path);
  CsvTable table(path);
  for (; table.next(); ++rows[name]) {
    Message message{};
    visit_columns(message, FromRow(table));
    if (const auto error = check_fields(message))
      throw ParseError(table.place(table.line()) + "readers would refuse this row (" + describe(*error) + ")");
    take(message, table);
  }
}

template <class Message, class Sample>
void read_arriving(const std::string& folder, const char* name, Arrival::Channel channel, std::vector<Sample>& samples,
                   ArrivalsByNumber& arrivals, std::map<std::string, std::int64_t>& rows) {
  read_file<Message>(folder, name, rows, [&](const Message& message, const CsvTable& table) {
    // Of a table that somebody else made: at their own times.
    const auto arrival = table.has(exported::kArrival) ? table.integer(exported::kArrival) : std::nullopt;
    arrivals.add(arrival.value_or(0), message.utime, {channel, samples.size()});
    samples.push_back(to_sample(message));
  });
}

}  // namespace

bool is_exported(const std::string& folder) {
  return std::ranges::any_of(kTables, [&](const char* name) { return fs::exists(fs::path(folder) / name); });
}

Recording import_exported(const std::string& folder) {
  if (!is_exported(folder))
    throw ParseError(folder + ": has none of the files of bevel-export, " + exported::kTips +
                     " for instance; CSV files of one's own need a column map, --columns");
  Recording out;
  ArrivalsByNumber arrivals;
  std::map<std::string, std::int64_t> sizes;
  // Of equal number the axes come first: a reading of the tip is taken of where the base is.
  read_arriving<actuator_state_t>(folder, exported::kAxes, Arrival::Channel::actuator, out.actuators, arrivals, sizes);
  read_arriving<tip_measurement_t>(folder, exported::kTips, Arrival::Channel::tip, out.tips, arrivals, sizes);
  read_arriving<tip_heading_t>(folder, exported::kHeadings, Arrival::Channel::heading, out.headings, arrivals, sizes);
  out.arrivals = arrivals.sorted();
  read_file<motion_command_t>(folder, exported::kCommands, sizes,
                              [&](const auto& m, const auto&) { out.commands.push_back(to_sample(m)); });
  read_file<needle_state_t>(folder, exported::kEstimates, sizes,
                            [&](const auto& m, const auto&) { out.estimates.push_back(m); });
  read_file<needle_state_t>(folder, exported::kTruths, sizes,
                            [&](const auto& m, const auto&) { out.truths.push_back(m); });
  const std::string config = folder + "/" + exported::kConfig;
  if (fs::exists(config)) out.config = read_text_file(config);
  sizes[exported::kConfig] = static_cast<std::int64_t>(out.config.size());
  require_all(folder, sizes);
  return out;
}

void write_log(const Recording& recording, const std::string& log_path) {
  const std::vector<Placed> order = log_order(recording);
  write_whole_log(log_path, [&](LogWriter& log) {
    if (!recording.config.empty())
      log.write_text(order.empty() ? 1 : order.front().time_us, channel::kConfig, recording.config);
    for (const auto& [time_us, channel, i] : order) {
      switch (channel) {
        case Placed::Channel::tip:
          log.write_message(time_us, channel::kTipMeasurement, to_message(recording.tips[i]));
          break;
        case Placed::Channel::heading:
          log.write_message(time_us, channel::kTipHeading, to_message(recording.headings[i]));
          break;
        case Placed::Channel::actuator:
          log.write_message(time_us, channel::kActuatorState, to_message(recording.actuators[i]));
          break;
        case Placed::Channel::command:
          log.write_message(time_us, channel::kMotionCommand, to_message(recording.commands[i]));
          break;
        case Placed::Channel::estimate:
          log.write_message(time_us, channel::kNeedleState, recording.estimates[i]);
          break;
        case Placed::Channel::truth:
          log.write_message(time_us, channel::kNeedleTruth, recording.truths[i]);
          break;
      }
    }
  });
}

}  // namespace bevel::io
