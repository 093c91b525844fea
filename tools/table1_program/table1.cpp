// SPDX-License-Identifier: MIT
// bevel-table1: the paper's Table I and Figures 5, 7, 8 on simulated plants, beside the paper's figures.
#include <filesystem>
#include <iostream>

#include <bevel/analysis/table1/table1_report.hpp>
#include <bevel/cli/command_line.hpp>

int main(int argc, char** argv) {
  std::string out;
  bevel::cli::CommandLine command_line("bevel-table1", "Table I and Figures 5, 7 and 8, beside the paper's.");
  command_line.example("bevel-table1 --out table1").option("-o,--out", out, "folder for report.html");
  return command_line.run(argc, argv, [&] {
    bevel::cli::ProgressLine progress(bevel::cli::ProgressLine::as_stderr_is());
    const auto study = bevel::analysis::run_study(progress);
    bevel::analysis::print(std::cout, study);
    if (out.empty()) return 0;
    std::filesystem::create_directories(out);
    bevel::analysis::save_report(study, out + "/report.html");
    std::cout << "\nwritten: " << out << "/report.html\n";
    return 0;
  });
}
