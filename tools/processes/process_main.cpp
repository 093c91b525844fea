// SPDX-License-Identifier: MIT
#include "tools/processes/process_main.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <stdexcept>

#include <bevel/nodes/claim_name.hpp>
#include <bevel/nodes/open_lcm.hpp>

namespace bevel::tools {

int process_main(cli::CommandLine& command_line, int argc, char** argv, const ProcessName& name, int realtime_priority,
                 const ProcessBody& body) {
  std::string config_path, lcm_url, fault;
  int parent = 0;
  command_line.option("-c,--config", config_path, "system file (TOML); config/demo.toml is one", true)
      .option("--lcm-url", lcm_url, "LCM provider; default: system.lcm_url, then LCM_DEFAULT_URL")
      .option("--fault", fault, "for tests: spoil what this process sends, as in camera:off@5s")
      .option("--end-with", parent, "id of the process that started this one: end, in order, when it is gone", 0,
              std::numeric_limits<int>::max());
  return command_line.run(argc, argv, [&] {
    nodes::catch_signals();
    if (parent != 0) nodes::end_with(parent);
    nodes::SystemConfig config = nodes::load_system_config(config_path);
    if (config.realtime && realtime_priority > 0)
      if (const std::string refused = nodes::try_realtime(realtime_priority); !refused.empty())
        std::fprintf(stderr, "%s: %s; running without\n", name(config).c_str(), refused.c_str());
    if (lcm_url.empty()) lcm_url = config.lcm_url;
    const auto opened = nodes::open_lcm(lcm_url);
    lcm::LCM& lcm = *opened;
    ProcessContext context{config, lcm, {}, nodes::now().ns};
    if (!fault.empty()) context.fault = nodes::parse_fault(fault);
    nodes::claim_name(lcm, lcm_url, name(config));
    return body(context);
  });
}

void inject(const ProcessContext& context, nodes::LcmPort& port) {
  if (!context.fault) return;
  const auto& [component, kind, at_s] = *context.fault;
  const std::int64_t start_ns = context.started_ns + std::llround(at_s * 1e9);
  auto injector = std::make_unique<nodes::FaultInjector>(component);
  injector->begin(kind, start_ns, kFaultSeed);
  port.inject(std::move(injector));
}

void warn_of_effects_left_out(const nodes::SystemConfig& config, const char* program) {
  for (const std::string& sentence : config.live_effects.left_out)
    std::fprintf(stderr, "%s: %s\n", program, sentence.c_str());
}

}  // namespace bevel::tools
