// SPDX-License-Identifier: MIT
// bevel-check: proves the link before motion, and says what to type to mend what is not right.
#include <cstdio>

#include <bevel/cli/command_line.hpp>
#include <bevel/cli/exit_status.hpp>
#include <bevel/error.hpp>
#include <bevel/nodes/link_probe.hpp>
#include <bevel/nodes/runtime.hpp>

int main(int argc, char** argv) {
  using namespace bevel;
  cli::CommandLine command_line(
      "bevel-check",
      "Proves the link before motion: multicast, CAN, the drives' identities and heartbeats, timers, "
      "cameras.\nMoves nothing, and sends nothing to drives that another program commands. Status 1 if something is "
      "not "
      "right.");
  std::string config_path, lcm_url, can;
  command_line.example("bevel-check --config config/demo.toml --can can0")
      .option("-c,--config", config_path, "system file (TOML); config/demo.toml is one", true)
      .option("--lcm-url", lcm_url, "LCM provider; default: system.lcm_url, then LCM_DEFAULT_URL")
      .option("--can", can, "bus instead of the file's: can0, or unix:/path for the rig's local bus");
  return command_line.run(argc, argv, [&] {
    nodes::catch_signals();
    const nodes::SystemConfig config = nodes::load_system_config(config_path);
    const auto findings = nodes::check_all(config, lcm_url.empty() ? config.lcm_url : lcm_url,
                                           can.empty() ? config.can : can, config_path);
    std::fputs(drivers::to_text(findings).c_str(), stdout);
    if (nodes::stop_requested()) throw bevel::Error("interrupted: what is above is not all");
    return drivers::any_failed(findings) ? cli::kFailed : cli::kOk;
  });
}
