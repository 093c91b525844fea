// bevel-export: what an LCM log holds, as one CSV file a channel.
#include <cstdio>
#include <filesystem>

#include "io/csv_export.hpp"
#include "io/find_logs.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/exit_status.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  std::vector<std::string> logs;
  std::string out = ".";
  tools::CommandLine command_line("bevel-export",
                                  "Turns LCM logs into CSV files, one a channel; bevel-import reads them back.");
  command_line.option("-o,--out", out, "folder; each log gets a folder in it")
      .arguments("LOG", logs, "LCM logs, or folders of them")
      .example("bevel-export -o csv out/insertion.lcm")
      .reads_recordings();
  return command_line.run(argc, argv, [&] {
    bool intact = true;
    for (const std::string& log : io::find_logs(logs)) {
      const io::Recording recording = io::read_recording(log);
      std::fprintf(stderr, "%s", recording.remarks(log).c_str());
      intact = intact && recording.intact();
      const auto folder = std::filesystem::path(out) / std::filesystem::path(log).stem();
      const auto files = io::export_csv(recording, folder.string());
      if (files.empty()) throw std::runtime_error(log + ": " + recording.refusal());
      for (const auto& [file, rows] : files) std::printf("%s: %lld rows\n", file.c_str(), static_cast<long long>(rows));
    }
    return intact ? tools::kOk : tools::kDamagedInput;
  });
}
