// bevel-table1: the paper's Table I and Figures 5, 7, 8 on simulated plants, beside the paper's figures.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "tools/table1_program/table1_report.hpp"

int main(int argc, char** argv) {
  CLI::App app("Table I and Figures 5, 7 and 8, beside the paper's.", "bevel-table1");
  std::string out;
  app.set_version_flag("--version", BEVEL_VERSION);
  app.add_option("-o,--out", out, "folder for report.html");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    const auto study = bevel::table1::run_study();
    bevel::table1::print(std::cout, study);
    if (out.empty()) return 0;
    std::filesystem::create_directories(out);
    bevel::table1::save_report(study, out + "/report.html");
    std::cout << "\nwritten: " << out << "/report.html\n";
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bevel-table1: %s\n", e.what());
    return 1;
  }
}
