// SPDX-License-Identifier: MIT
#include <bevel/io/csv_export.hpp>

#include <array>
#include <charconv>
#include <filesystem>
#include <stdexcept>

#include <bevel/io/csv_columns.hpp>
#include <bevel/io/log_order.hpp>
#include <bevel/io/messages.hpp>
#include <bevel/io/result_file.hpp>

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

constexpr std::array kFiles{exported::kTips,      exported::kHeadings, exported::kAxes,   exported::kCommands,
                            exported::kEstimates, exported::kTruths,   exported::kConfig, exported::kRows};

// Files are complete here before they get their place. The destructor removes what has none.
class UnfinishedFolder {
 public:
  explicit UnfinishedFolder(const std::string& path) : path_(path) {
    fs::remove_all(path_);  // of an export that was killed
    fs::create_directories(path_);
  }
  ~UnfinishedFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;

  void write(const char* name, const std::string& text) const { write_result_file((path_ / name).string(), text); }
  // Replaces the files of an earlier export in `folder`; other files stay. The list of rows comes last, so that a
  // folder with one is complete.
  void move_to(const fs::path& folder) const {
    fs::create_directories(folder);
    fs::remove(folder / exported::kRows);
    for (const char* name : kFiles) {
      if (fs::exists(path_ / name))
        fs::rename(path_ / name, folder / name);
      else
        fs::remove(folder / name);
    }
  }

 private:
  fs::path path_;
};

}  // namespace

std::vector<std::pair<std::string, std::int64_t>> export_csv(const Recording& recording, const std::string& folder) {
  const fs::path unfinished = fs::path(folder).lexically_normal() / ".";
  const UnfinishedFolder parts(unfinished.parent_path().string() + ".unfinished");
  std::string rows_of_tables;
  std::vector<std::pair<std::string, std::int64_t>> done;
  const auto write_file = [&](const char* name, const auto& rows, const std::vector<std::size_t>* arrivals) {
    if (rows.empty()) return;
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
    parts.write(name, text);
    done.emplace_back(folder + "/" + name, static_cast<std::int64_t>(rows.size()));
    rows_of_tables += fs::path(name).stem().string() + " = " + std::to_string(rows.size()) + "\n";
  };
  const ArrivalNumbers numbers(recording);
  write_file(exported::kTips, recording.tips, &numbers.tips);
  write_file(exported::kHeadings, recording.headings, &numbers.headings);
  write_file(exported::kAxes, recording.actuators, &numbers.actuators);
  write_file(exported::kCommands, recording.commands, nullptr);
  write_file(exported::kEstimates, recording.estimates, nullptr);
  write_file(exported::kTruths, recording.truths, nullptr);
  if (done.empty()) return done;
  if (!recording.config.empty()) {
    parts.write(exported::kConfig, recording.config);
    rows_of_tables += "config_bytes = " + std::to_string(recording.config.size()) + "\n";
  }
  parts.write(exported::kRows,
              "# Rows of each table; bevel-import refuses a table with another number of rows.\n" + rows_of_tables);
  parts.move_to(folder);
  return done;
}

}  // namespace bevel::io
