// SPDX-License-Identifier: MIT
// bevel-controller: NEEDLE_STATE, ACTUATOR_STATE and STEERING_TARGET in, MOTION_COMMAND out.
#include <bevel/nodes/controller_node.hpp>
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  constexpr int kPriority = 40;  // of SCHED_FIFO
  cli::CommandLine command_line(
      "bevel-controller", "Steers the needle to the target on STEERING_TARGET, and stops it when anything is wrong.");
  command_line.example("bevel-controller --config config/demo.toml");
  const auto name = [](const nodes::SystemConfig&) { return "bevel-controller"; };
  return tools::process_main(command_line, argc, argv, name, kPriority, [](tools::ProcessContext& context) {
    tools::warn_of_effects_left_out(context.config, "bevel-controller");
    nodes::ControllerNode node(context.lcm, context.config);
    tools::inject(context, node.port());
    const nodes::Loop loop{context.config.controller.period_s, [&](const nodes::Now& now) { node.tell_time(now); },
                           [&](const nodes::Now& now, double late_s) {
                             node.step(now, late_s);
                             return true;
                           }};
    nodes::run_with_end(
        context.lcm, loop, [&] { node.end(); }, {}, 0);
    return 0;
  });
}
