// An exported folder back into a recording, and that into a log.
#include <algorithm>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <tuple>

#include "io/csv_columns.hpp"
#include "io/csv_export.hpp"
#include "io/csv_table.hpp"
#include "io/file_bytes.hpp"
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

struct Numbered {
  std::int64_t arrival, utime;
  Arrival where;
};

template <class Message, class Sample>
void read_arriving(const std::string& folder, const char* name, Arrival::Channel channel, std::vector<Sample>& samples,
                   std::vector<Numbered>& arrivals) {
  read_file<Message>(folder, name, [&](const Message& message, const CsvTable& table) {
    // Of a table that somebody else made: at their own times.
    const auto arrival = table.has(exported::kArrival) ? table.integer(exported::kArrival) : std::nullopt;
    arrivals.push_back({arrival.value_or(0), message.utime, {channel, samples.size()}});
    samples.push_back(to_sample(message));
  });
}

// Messages of all channels in the order of the log, each with its time of receipt.
class Merge {
 public:
  template <class Message>
  void add(std::int64_t time_us, const char* channel, const Message& message) {
    events_.push_back({time_us, channel, encode(message)});
  }
  // A channel's messages keep their order: none is received before the one before.
  template <class Message>
  void add_all(const char* channel, const std::vector<Message>& messages) {
    std::int64_t now_us = 0;
    for (const Message& m : messages) add(now_us = std::max(now_us, m.utime), channel, m);
  }
  void write(LogWriter& log, const std::string& config) {
    std::ranges::stable_sort(events_, {}, &Event::time_us);
    if (!config.empty()) log.write_text(events_.empty() ? 1 : events_.front().time_us, channel::kConfig, config);
    for (const Event& event : events_) log.write(event.time_us, event.channel, event.bytes);
  }

 private:
  struct Event {
    std::int64_t time_us;
    const char* channel;
    std::vector<std::uint8_t> bytes;
  };
  std::vector<Event> events_;
};

}  // namespace

bool is_exported(const std::string& folder) {
  return std::ranges::any_of(std::array{exported::kTips, exported::kHeadings, exported::kAxes, exported::kCommands,
                                        exported::kEstimates, exported::kTruths},
                             [&](const char* name) { return fs::exists(fs::path(folder) / name); });
}

Recording import_exported(const std::string& folder) {
  if (!is_exported(folder))
    throw std::runtime_error(folder + ": has none of the files of bevel-export, " + exported::kTips + " for instance");
  Recording out;
  std::vector<Numbered> arrivals;
  // Of equal number the axes come first: a reading of the tip is taken of where the base is.
  read_arriving<actuator_state_t>(folder, exported::kAxes, Arrival::Channel::actuator, out.actuators, arrivals);
  read_arriving<tip_measurement_t>(folder, exported::kTips, Arrival::Channel::tip, out.tips, arrivals);
  read_arriving<tip_heading_t>(folder, exported::kHeadings, Arrival::Channel::heading, out.headings, arrivals);
  std::ranges::stable_sort(arrivals, {}, [](const Numbered& a) { return std::tuple(a.arrival, a.utime); });
  for (const Numbered& a : arrivals) out.arrivals.push_back(a.where);
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
  Merge merge;
  std::int64_t now_us = 0;
  const auto add = [&](const auto& sample, const char* channel) {
    merge.add(now_us = std::max(now_us, sample.utime), channel, to_message(sample));
  };
  for (const Arrival& a : recording.arrivals) {
    if (a.channel == Arrival::Channel::tip) add(recording.tips[a.index], channel::kTipMeasurement);
    if (a.channel == Arrival::Channel::heading) add(recording.headings[a.index], channel::kTipHeading);
    if (a.channel == Arrival::Channel::actuator) add(recording.actuators[a.index], channel::kActuatorState);
  }
  std::vector<motion_command_t> commands;
  for (const model::MotionCommand& command : recording.commands) commands.push_back(to_message(command));
  merge.add_all(channel::kMotionCommand, commands);
  merge.add_all(channel::kNeedleState, recording.estimates);
  merge.add_all(channel::kNeedleTruth, recording.truths);
  write_whole_log(log_path, [&](LogWriter& log) { merge.write(log, recording.config); });
}

}  // namespace bevel::io
