// bevel-export: what an LCM log holds, as one CSV file a channel.
#include <cstdio>
#include <filesystem>

#include "io/csv_export.hpp"
#include "tools/common/command_line.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  std::vector<std::string> logs;
  std::string out = ".";
  tools::CommandLine command_line("bevel-export", "Turns LCM logs into CSV files, one a channel.");
  command_line.option("-o,--out", out, "folder; each log gets a folder in it").arguments("LOG", logs, "LCM logs");
  return command_line.run(argc, argv, [&] {
    bool intact = true;
    for (const std::string& log : logs) {
      const io::Recording recording = io::read_recording(log);
      const auto folder = std::filesystem::path(out) / std::filesystem::path(log).stem();
      for (const auto& [file, rows] : io::export_csv(recording, folder.string()))
        std::printf("%s: %lld rows\n", file.c_str(), static_cast<long long>(rows));
      if (recording.intact()) continue;
      intact = false;
      std::fprintf(stderr, "%s: %s\n", log.c_str(), recording.describe_faults().c_str());
    }
    return intact ? 0 : 1;
  });
}
