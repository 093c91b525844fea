// SPDX-License-Identifier: MIT
#include <bevel/analysis/convert/import.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

#include <bevel/cli/exit_status.hpp>
#include <bevel/error.hpp>
#include <bevel/io/csv_export.hpp>
#include <bevel/io/csv_import.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/mcap_export.hpp>

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;

// Files as they are, folders by the .csv files in them.
std::vector<std::string> csv_files(const std::vector<std::string>& paths) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    if (!fs::exists(path)) throw IoError(path + ": no such file or folder");
    if (!fs::is_directory(path)) {
      files.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.path().extension() == ".csv") inside.push_back(entry.path().string());
    if (inside.empty()) throw IoError(path + ": holds no file that ends in .csv");
    std::ranges::sort(inside);
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

// OUT/NAME.lcm for each recording; no two are equal.
std::vector<std::string> log_paths(const std::vector<std::string>& recordings, const std::string& out_folder) {
  std::set<fs::path> known;
  for (const std::string& recording : recordings)
    if (!known.insert(fs::weakly_canonical(recording)).second)
      throw IoError(recording + ": given twice; give each recording once");
  std::vector<std::string> logs;
  for (const std::string& name : io::result_names(recordings))
    logs.push_back((fs::path(out_folder) / (name + ".lcm")).string());
  return logs;
}

// Prints what is odd. `intact` becomes false if that is damage.
io::Recording read_export(const std::string& path, bool& intact) {
  if (!io::is_mcap(path)) return io::import_exported(path);
  io::ImportedMcap mcap = io::import_mcap_file(path);
  std::fprintf(stderr, "%s", mcap.remarks(path).c_str());
  intact = intact && mcap.intact();
  return std::move(mcap.recording);
}

// Calls `one(i)` for each recording. What it throws is printed, and the other recordings are imported all the same.
// `one` returns whether its input was intact.
template <class One>
int for_each_recording(std::size_t count, One&& one) {
  std::size_t failed = 0;
  bool intact = true;
  for (std::size_t i = 0; i < count; ++i) {
    try {
      intact = one(i) && intact;
    } catch (const Error& e) {
      ++failed;
      std::fprintf(stderr, "%s\n", e.what());
    }
  }
  if (failed > 0 && count > 1) std::fprintf(stderr, "%zu of %zu recordings were not imported\n", failed, count);
  if (failed > 0) return cli::kFailed;
  return intact ? cli::kOk : cli::kDamagedInput;
}

int import_exports(const ImportOptions& o) {
  const auto logs = log_paths(o.inputs, o.out_folder);
  return for_each_recording(logs.size(), [&](std::size_t i) {
    if (fs::exists(logs[i]))
      throw IoError(logs[i] + ": is there already, and may be the log that was exported, which holds more " +
                    "than the export; give another folder with --out");
    bool intact = true;
    const io::Recording recording = read_export(o.inputs[i], intact);
    io::write_log(recording, logs[i]);
    std::printf("%s: %zu TIP_MEASUREMENT, %zu TIP_HEADING, %zu ACTUATOR_STATE, %zu MOTION_COMMAND, %zu NEEDLE_STATE\n",
                logs[i].c_str(), recording.tips.size(), recording.headings.size(), recording.actuators.size(),
                recording.commands.size(), recording.estimates.size());
    return intact;
  });
}

}  // namespace

std::string usage_fault(const ImportOptions& o) {
  if (!o.map_path.empty()) return "";
  if (!o.base.empty()) return "--base needs --columns, whose [base] says what is in its files";
  const auto file = std::ranges::find_if(
      o.inputs, [](const std::string& path) { return fs::is_regular_file(path) && !io::is_mcap(path); });
  if (file == o.inputs.end()) return "";
  return *file + ": a CSV file of one's own needs --columns (docs/import.md); without it a folder or a .mcap file of " +
         "bevel-export";
}

int run(const ImportOptions& o) {
  fs::create_directories(o.out_folder);
  if (o.map_path.empty()) return import_exports(o);
  const io::ColumnMap map = io::load_column_map(o.map_path);
  const auto files = csv_files(o.inputs), base = csv_files(o.base);
  if (map.base_time.has_value() != !base.empty() || (!base.empty() && base.size() != files.size()))
    throw IoError(o.map_path + ": " + (map.base_time ? "has [base]" : "has no [base]") + "; given are " +
                  std::to_string(files.size()) + " files of the tip and " + std::to_string(base.size()) +
                  " of the base; allowed: " + (map.base_time ? "as many of each" : "none of the base"));
  const auto logs = log_paths(files, o.out_folder);
  return for_each_recording(files.size(), [&](std::size_t i) {
    const io::ImportedRecording recording = io::import_csv(files[i], map, base.empty() ? "" : base[i]);
    io::write_log(recording, logs[i]);
    std::fprintf(stderr, "%s", recording.remarks(files[i]).c_str());
    std::printf("%s\n%s", logs[i].c_str(), io::summary(recording).c_str());
    return recording.intact();
  });
}

}  // namespace bevel::analysis
