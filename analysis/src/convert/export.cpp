// SPDX-License-Identifier: MIT
#include <bevel/analysis/convert/export.hpp>

#include <cstdio>
#include <filesystem>

#include <bevel/cli/exit_status.hpp>
#include <bevel/error.hpp>
#include <bevel/io/csv_export.hpp>
#include <bevel/io/find_logs.hpp>
#include <bevel/io/mcap_export.hpp>

namespace bevel::analysis {
namespace {

namespace fs = std::filesystem;

void write_csv(const io::Recording& recording, const std::string& log, const std::string& folder) {
  const auto files = io::export_csv(recording, folder);
  if (files.empty()) throw IoError(log + ": " + recording.refusal());
  for (const auto& [file, rows] : files) std::printf("%s: %lld rows\n", file.c_str(), static_cast<long long>(rows));
}

void write_mcap(const io::Recording& recording, const std::string& log, const std::string& path) {
  const std::size_t messages =
      recording.arrivals.size() + recording.commands.size() + recording.estimates.size() + recording.truths.size();
  if (messages == 0) throw IoError(log + ": " + recording.refusal());
  fs::create_directories(fs::path(path).parent_path());
  io::export_mcap(recording, path);
  std::printf("%s: %zu messages\n", path.c_str(), messages);
}

}  // namespace

int run(const ExportOptions& o) {
  bool intact = true;
  std::size_t failed = 0;
  const auto logs = io::find_logs(o.logs);
  const auto names = io::result_names(logs);
  for (std::size_t i = 0; i < logs.size(); ++i) {
    try {
      const io::Recording recording = io::read_recording(logs[i]);
      std::fprintf(stderr, "%s", recording.remarks(logs[i]).c_str());
      intact = intact && recording.intact();
      const std::string path = (fs::path(o.out_folder) / names[i]).string();
      if (o.format == "mcap")
        write_mcap(recording, logs[i], path + ".mcap");
      else
        write_csv(recording, logs[i], path);
    } catch (const Error& e) {
      ++failed;
      std::fprintf(stderr, "%s\n", e.what());
    }
  }
  if (failed > 0 && logs.size() > 1) std::fprintf(stderr, "%zu of %zu logs were not exported\n", failed, logs.size());
  if (failed > 0) return cli::kFailed;
  return intact ? cli::kOk : cli::kDamagedInput;
}

}  // namespace bevel::analysis
