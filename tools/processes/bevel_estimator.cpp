// bevel-estimator: TIP_MEASUREMENT and ACTUATOR_STATE in, NEEDLE_STATE out.
#include "nodes/estimator_node.hpp"
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  tools::CommandLine command_line(
      "bevel-estimator", "Estimates the needle's pose, curvature and lambda from tip measurements and axis positions.");
  return tools::process_main(command_line, argc, argv, [](nodes::SystemConfig& config, lcm::LCM& lcm) {
    nodes::claim_name("bevel-estimator");
    tools::warn_of_effects_left_out(config, "bevel-estimator");
    nodes::EstimatorNode node(lcm, config.estimator);
    // Messages are handled as they arrive; the period is that of the health checks.
    nodes::run_periodic(lcm, 0.01, [&](const nodes::Now& now, double) {
      node.step(now.utime);
      return true;
    });
    return 0;
  });
}
