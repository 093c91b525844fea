// bevel-import: CSV recordings to LCM logs, by a column map.
#include <cstdio>
#include <filesystem>

#include "io/csv_import.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/exit_status.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  std::vector<std::string> files;
  std::string map_path, out = ".";
  tools::CommandLine command_line("bevel-import", "Turns CSV recordings into LCM logs; docs/import has column maps.");
  command_line.option("-c,--columns", map_path, "column map (TOML)", true)
      .option("-o,--out", out, "folder for the logs, one a file")
      .arguments("CSV", files, "recordings")
      .reads_recordings();
  return command_line.run(argc, argv, [&] {
    const io::ColumnMap map = io::load_column_map(map_path);
    std::filesystem::create_directories(out);
    int status = tools::kOk;
    for (const std::string& file : files) {
      const io::ImportedRecording recording = io::import_csv(file, map);
      const std::string log = out + "/" + std::filesystem::path(file).stem().string() + ".lcm";
      std::fprintf(stderr, "%s", recording.remarks(file).c_str());
      if (!recording.left_out.empty()) status = tools::kDamagedInput;
      io::write_log(recording, log);
      std::printf("%s: %d rows, %d without data, %d between steps, %d left out, %zu messages each to depth %.1f mm\n", log.c_str(),
                  recording.rows, recording.rows_without_data, recording.rows_unsettled, recording.rows_implausible, recording.tips.size(),
                  recording.actuators.back().insertion_mm);
    }
    return status;
  });
}
