// An exported folder back into a recording, and that into a log.
#include <algorithm>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "io/csv_columns.hpp"
#include "io/csv_export.hpp"
#include "io/csv_table.hpp"
#include "io/file_bytes.hpp"
#include "io/log_order.hpp"
#include "io/log_writer.hpp"
#include "io/messages.hpp"

namespace bevel::io {
namespace {

namespace fs = std::filesystem;

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

template <class Message, class Take>
void read_file(const std::string& folder, const char* name, Take&& take) {
  const std::string path = folder + "/" + name;
  if (!fs::exists(path)) return;
  CsvTable table(path);
  while (table.next()) {
    Message message{};
    visit_columns(message, FromRow(table));
    if (const auto error = check_fields(message))
      throw std::runtime_error(table.place(table.line()) + "readers would refuse this row (" + describe(*error) + ")");
    take(message, table);
  }
}

template <class Message, class Sample>
void read_arriving(const std::string& folder, const char* name, Arrival::Channel channel, std::vector<Sample>& samples,
                   ArrivalsByNumber& arrivals) {
  read_file<Message>(folder, name, [&](const Message& message, const CsvTable& table) {
    // Of a table that somebody else made: at their own times.
    const auto arrival = table.has(exported::kArrival) ? table.integer(exported::kArrival) : std::nullopt;
    arrivals.add(arrival.value_or(0), message.utime, {channel, samples.size()});
    samples.push_back(to_sample(message));
  });
}

}  // namespace

bool is_exported(const std::string& folder) {
  return std::ranges::any_of(std::array{exported::kTips, exported::kHeadings, exported::kAxes, exported::kCommands,
                                        exported::kEstimates, exported::kTruths},
                             [&](const char* name) { return fs::exists(fs::path(folder) / name); });
}

Recording import_exported(const std::string& folder) {
  if (!is_exported(folder))
    throw std::runtime_error(folder + ": has none of the files of bevel-export, " + exported::kTips +
                             " for instance; CSV files of one's own need a column map, --columns");
  Recording out;
  ArrivalsByNumber arrivals;
  // Of equal number the axes come first: a reading of the tip is taken of where the base is.
  read_arriving<actuator_state_t>(folder, exported::kAxes, Arrival::Channel::actuator, out.actuators, arrivals);
  read_arriving<tip_measurement_t>(folder, exported::kTips, Arrival::Channel::tip, out.tips, arrivals);
  read_arriving<tip_heading_t>(folder, exported::kHeadings, Arrival::Channel::heading, out.headings, arrivals);
  out.arrivals = arrivals.sorted();
  read_file<motion_command_t>(folder, exported::kCommands,
                              [&](const auto& m, const auto&) { out.commands.push_back(to_sample(m)); });
  read_file<needle_state_t>(folder, exported::kEstimates,
                            [&](const auto& m, const auto&) { out.estimates.push_back(m); });
  read_file<needle_state_t>(folder, exported::kTruths, [&](const auto& m, const auto&) { out.truths.push_back(m); });
  const std::string config = folder + "/" + exported::kConfig;
  if (fs::exists(config)) out.config = read_text_file(config);
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
