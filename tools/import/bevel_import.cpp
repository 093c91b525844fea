// SPDX-License-Identifier: MIT
// bevel-import: CSV recordings to LCM logs, by a column map, or what bevel-export wrote.
#include <bevel/analysis/convert/import.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  using namespace bevel;
  analysis::ImportOptions o;
  cli::CommandLine command_line("bevel-import",
                                "Turns CSV recordings into LCM logs, by a column map or back from bevel-export.");
  command_line.option("-c,--columns", o.map_path, "column map (TOML) of CSV files of one's own; see docs/import.md")
      .option("-o,--out", o.out_folder, "folder for the logs, one a recording")
      .paths("--base", o.base, "the base's files, in the order of CSV, where the map has [base]")
      .arguments("CSV", o.inputs,
                 "recordings, or folders of them; without --columns folders or .mcap files of bevel-export")
      .example("bevel-import -c map.toml -o logs tip1.csv tip2.csv")
      .check([&] { return analysis::usage_fault(o); })
      .reads_recordings();
  return command_line.run(argc, argv, [&] { return analysis::run(o); });
}
