// bevel-demo: starts the five processes, steers the simulated needle to a target, records, reports, ends everything.
// Exit status: 0 the needle arrived within the tolerance, 1 it did not or something failed, 2 usage, 130 interrupted.
#include <CLI/CLI.hpp>
#include <filesystem>

#include "nodes/system_config.hpp"
#include "tools/demo_loop/demo_run.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  tools::DemoOptions options;
  options.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
  CLI::App app("Steers a simulated needle with all five processes and a rendered camera in the loop.", "bevel-demo");
  app.set_version_flag("--version", BEVEL_VERSION);
  app.add_option("-c,--config", options.config_path, "system file")->capture_default_str();
  app.add_option("--target", options.target_mm, "target in {A}, mm")
      ->delimiter(',')
      ->expected(3)
      ->capture_default_str();
  app.add_option("--out", options.out, "folder for log, report and the processes' output")->capture_default_str();
  app.add_option("--tolerance", options.tolerance_mm, "largest miss that counts as success, mm")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  app.add_option("--time-limit", options.time_limit_s, "give up after, s")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  try {
    return tools::run_demo(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bevel-demo: %s\n", e.what());
    return 1;
  }
}
