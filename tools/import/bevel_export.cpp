// SPDX-License-Identifier: MIT
// bevel-export: what an LCM log holds, as one CSV file a channel, or as one MCAP file.
#include <bevel/analysis/convert/export.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  using namespace bevel;
  analysis::ExportOptions o;
  cli::CommandLine command_line("bevel-export",
                                "Turns LCM logs into CSV files, one a channel, or into MCAP; bevel-import reads both.");
  command_line.option("-o,--out", o.out_folder, "folder; each log gets a folder in it, or a file LOG.mcap")
      .choice("-f,--format", o.format, "csv if not said, or mcap", {"csv", "mcap"})
      .arguments("LOG", o.logs, "LCM logs, or folders of them")
      .example("bevel-export --format mcap -o mcap out/insertion.lcm")
      .reads_recordings();
  return command_line.run(argc, argv, [&] { return analysis::run(o); });
}
