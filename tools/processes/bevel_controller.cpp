// bevel-controller: NEEDLE_STATE, ACTUATOR_STATE and STEERING_TARGET in, MOTION_COMMAND out at a fixed rate.
#include "nodes/controller_node.hpp"
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  tools::CommandLine command_line(
      "bevel-controller", "Steers the needle to the target on STEERING_TARGET, and stops it when anything is wrong.");
  return tools::process_main(command_line, argc, argv, [](nodes::SystemConfig& config, lcm::LCM& lcm) {
    nodes::claim_name("bevel-controller");
    tools::warn_of_effects_left_out(config, "bevel-controller");
    tools::go_realtime(config, "bevel-controller", 40);
    nodes::ControllerNode node(lcm, config.controller, config.needle, config.live_effects.active);
    nodes::run_periodic(lcm, config.controller.period_s, [&](const nodes::Now& now, double late_s) {
      node.step(now.utime, late_s);
      return true;
    });
    return 0;
  });
}
