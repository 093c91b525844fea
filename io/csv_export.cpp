#include "io/csv_export.hpp"

#include <array>
#include <charconv>
#include <filesystem>
#include <stdexcept>

#include "io/csv_columns.hpp"
#include "io/log_order.hpp"
#include "io/messages.hpp"
#include "io/result_file.hpp"

namespace bevel::io {
namespace {

namespace fs = std::filesystem;

tip_measurement_t as_message(const model::TipMeasurement& m) { return to_message(m); }
tip_heading_t as_message(const model::TipHeading& m) { return to_message(m); }
actuator_state_t as_message(const model::ActuatorState& m) { return to_message(m); }
motion_command_t as_message(const model::MotionCommand& m) { return to_message(m); }
const needle_state_t& as_message(const needle_state_t& m) { return m; }

// Appends one line, of names or of values.
class Line {
 public:
  Line(std::string& text, bool names) : text_(text), names_(names) {}
  template <class Integer>
  void whole(const std::string& name, Integer value) {
    cell(name, value, true);
  }
  void number(const std::string& name, double value) { cell(name, value, true); }
  template <class IsSeen>
  void seen(const std::string& name, double value, IsSeen&& is_seen) {
    cell(name, value, is_seen());
  }

 private:
  template <class Value>
  void cell(const std::string& name, Value value, bool is_seen) {
    if (started_) text_ += ',';
    started_ = true;
    if (names_) {
      text_ += name;
    } else if (is_seen) {
      std::array<char, 32> digits;  // shortest that reads back as the same number
      text_.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
    }
  }
  std::string& text_;
  bool names_, started_ = false;
};

}  // namespace

std::vector<std::pair<std::string, std::int64_t>> export_csv(const Recording& recording, const std::string& folder) {
  fs::create_directories(folder);
  const std::string counts = folder + "/" + exported::kRows;
  fs::remove(counts);
  std::string rows_of_tables;
  std::vector<std::pair<std::string, std::int64_t>> done;
  const auto write_file = [&](const char* name, const auto& rows, const std::vector<std::size_t>* arrivals) {
    const std::string path = folder + "/" + name;
    if (rows.empty()) {
      fs::remove(path);  // of an export before, which would be taken for this one's
      return;
    }
    std::string text;
    const auto add = [&](const auto& message, bool names, std::size_t arrival) {
      Line line(text, names);
      visit_columns(message, line);
      if (arrivals != nullptr) line.whole(exported::kArrival, arrival);
      text += '\n';
    };
    add(as_message(rows.front()), true, 0);
    for (std::size_t i = 0; i < rows.size(); ++i)
      add(as_message(rows[i]), false, arrivals == nullptr ? 0 : arrivals->at(i));
    write_result_file(path, text);
    done.emplace_back(path, static_cast<std::int64_t>(rows.size()));
    rows_of_tables += fs::path(name).stem().string() + " = " + std::to_string(rows.size()) + "\n";
  };
  const ArrivalNumbers numbers(recording);
  write_file(exported::kTips, recording.tips, &numbers.tips);
  write_file(exported::kHeadings, recording.headings, &numbers.headings);
  write_file(exported::kAxes, recording.actuators, &numbers.actuators);
  write_file(exported::kCommands, recording.commands, nullptr);
  write_file(exported::kEstimates, recording.estimates, nullptr);
  write_file(exported::kTruths, recording.truths, nullptr);
  const std::string config = folder + "/" + exported::kConfig;
  fs::remove(config);
  if (!recording.config.empty() && !done.empty()) {
    write_result_file(config, recording.config);
    rows_of_tables += "config_bytes = " + std::to_string(recording.config.size()) + "\n";
  }
  if (!done.empty())
    write_result_file(
        counts, "# Rows of each table; bevel-import refuses a table with another number of rows.\n" + rows_of_tables);
  return done;
}

}  // namespace bevel::io
