#include "tools/import/export.hpp"

#include <cstdio>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "io/csv_export.hpp"
#include "io/find_logs.hpp"
#include "io/mcap_export.hpp"
#include "tools/common/exit_status.hpp"

namespace bevel::exporting {
namespace {

namespace fs = std::filesystem;

void write_csv(const io::Recording& recording, const std::string& log, const std::string& folder) {
  const auto files = io::export_csv(recording, folder);
  if (files.empty()) throw std::runtime_error(log + ": " + recording.refusal());
  for (const auto& [file, rows] : files) std::printf("%s: %lld rows\n", file.c_str(), static_cast<long long>(rows));
}

void write_mcap(const io::Recording& recording, const std::string& log, const std::string& path) {
  const std::size_t messages = recording.arrivals.size() + recording.commands.size() + recording.estimates.size() +
                               recording.truths.size();
  if (messages == 0) throw std::runtime_error(log + ": " + recording.refusal());
  fs::create_directories(fs::path(path).parent_path());
  io::export_mcap(recording, path);
  std::printf("%s: %zu messages\n", path.c_str(), messages);
}

}  // namespace

int run(const Options& o) {
  bool intact = true;
  std::map<std::string, std::string> taken;
  const auto logs = io::find_logs(o.logs);
  for (const std::string& log : logs) {
    const std::string name = fs::path(log).stem().string();
    const auto [other, is_new] = taken.emplace(name, log);
    if (!is_new && other->second != log)
      throw std::runtime_error(other->second + " and " + log + ": would both become " + name +
                               "; export them into different folders");
  }
  for (const std::string& log : logs) {
    const io::Recording recording = io::read_recording(log);
    std::fprintf(stderr, "%s", recording.remarks(log).c_str());
    intact = intact && recording.intact();
    const std::string path = (fs::path(o.out_folder) / fs::path(log).stem()).string();
    if (o.format == "mcap")
      write_mcap(recording, log, path + ".mcap");
    else
      write_csv(recording, log, path);
  }
  return intact ? tools::kOk : tools::kDamagedInput;
}

}  // namespace bevel::exporting
