#include "tools/processes/process_main.hpp"

#include <cstdio>
#include <stdexcept>

namespace bevel::tools {

int process_main(CommandLine& command_line, int argc, char** argv, const ProcessBody& body) {
  std::string config_path, lcm_url;
  command_line.option("-c,--config", config_path, "system file (TOML); config/demo.toml is one", true)
      .option("--lcm-url", lcm_url, "LCM provider; default: system.lcm_url, then LCM_DEFAULT_URL");
  return command_line.run(argc, argv, [&] {
    nodes::SystemConfig config = nodes::load_system_config(config_path);
    lcm::LCM lcm(lcm_url.empty() ? config.lcm_url : lcm_url);
    if (!lcm.good()) throw std::runtime_error("LCM does not start; is multicast routed? (see docs/running.md)");
    nodes::catch_signals();
    return body(config, lcm);
  });
}

void go_realtime(const nodes::SystemConfig& config, const char* program, int priority) {
  if (!config.realtime) return;
  if (const std::string refused = nodes::try_realtime(priority); !refused.empty())
    std::fprintf(stderr, "%s: %s; running without\n", program, refused.c_str());
}

void warn_of_effects_left_out(const nodes::SystemConfig& config, const char* program) {
  for (const std::string& sentence : config.live_effects.left_out)
    std::fprintf(stderr, "%s: %s\n", program, sentence.c_str());
}

}  // namespace bevel::tools
