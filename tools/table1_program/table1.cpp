// bevel-table1: the paper's Table I and Figures 5, 7, 8 on simulated plants, beside the paper's figures.
#include <filesystem>
#include <iostream>

#include "tools/common/command_line.hpp"
#include "tools/table1_program/table1_report.hpp"

int main(int argc, char** argv) {
  std::string out;
  bevel::tools::CommandLine command_line("bevel-table1", "Table I and Figures 5, 7 and 8, beside the paper's.");
  command_line.example("bevel-table1 --out table1").option("-o,--out", out, "folder for report.html");
  return command_line.run(argc, argv, [&] {
    bevel::tools::ProgressLine progress(bevel::tools::ProgressLine::as_stderr_is());
    const auto study = bevel::table1::run_study(progress);
    bevel::table1::print(std::cout, study);
    if (out.empty()) return 0;
    std::filesystem::create_directories(out);
    bevel::table1::save_report(study, out + "/report.html");
    std::cout << "\nwritten: " << out << "/report.html\n";
    return 0;
  });
}
