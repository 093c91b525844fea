// SPDX-License-Identifier: MIT
// bevel-rig: the simulated rig, two CiA 402 drives, a needle in tissue, and the cameras that look at it.
#include <cstdio>
#include <thread>

#include <bevel/drivers/can/local_bus.hpp>
#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/nodes/rig_node.hpp>
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  constexpr double kOutlives_s = 0.5;
  constexpr int kWirePriority = 60;  // of SCHED_FIFO: a wire waits for no program
  cli::CommandLine command_line("bevel-rig", "Simulates needle, cameras and drives; the other processes cannot tell.");
  command_line.example("bevel-rig --config config/demo.toml");
  const auto name = [](const nodes::SystemConfig&) { return "bevel-rig"; };
  return tools::process_main(command_line, argc, argv, name, [](tools::ProcessContext& context) {
    const nodes::SystemConfig& config = context.config;
    // On a local bus the rig is also the hub; a CAN interface needs none.
    constexpr std::string_view kLocal = "unix:";
    std::unique_ptr<can::LocalHub> hub;
    std::jthread hub_thread;
    if (config.can.starts_with(kLocal)) {
      hub = std::make_unique<can::LocalHub>(config.can.substr(kLocal.size()));
      hub_thread = std::jthread([&](const std::stop_token& stop) {
        if (config.realtime)
          if (const std::string refused = nodes::try_realtime(kWirePriority); !refused.empty())
            std::fprintf(stderr, "bevel-rig: the local bus runs without: %s\n", refused.c_str());
        hub->run(stop);
      });
    }
    const auto insertion = can::open_bus(config.can), rotation = can::open_bus(config.can);
    rig::FrameServer frames(config.rig.frames_socket);
    nodes::RigNode node(context.lcm, *insertion, *rotation, config, &frames);
    if (config.rig.variation != model::Variation{})
      std::fprintf(stderr, "bevel-rig: this insertion differs, drawn with seed %lld: %s\n",
                   static_cast<long long>(config.rig.seed), model::describe(node.own_values()).c_str());
    if (context.fault) node.break_drive(*context.fault, context.started_ns, tools::kFaultSeed);
    const nodes::Loop loop{0.001, {}, [&](const nodes::Now& now, double) {
                             node.step(now);
                             return true;
                           }};
    // A bench is still there when the programs that drive it have gone: its axes come to rest.
    nodes::run_with_end(
        context.lcm, loop, [] {}, loop, kOutlives_s);
    return 0;
  });
}
