// SPDX-License-Identifier: MIT
// bevel-estimator: TIP_MEASUREMENT, TIP_HEADING and ACTUATOR_STATE in, NEEDLE_STATE out.
#include <bevel/nodes/controller_node.hpp>
#include <bevel/nodes/estimator_node.hpp>
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  cli::CommandLine command_line(
      "bevel-estimator",
      "Estimates the needle's pose, curvature and lambda from tip measurements, headings and axis positions.");
  command_line.example("bevel-estimator --config config/demo.toml");
  const auto name = [](const nodes::SystemConfig&) { return "bevel-estimator"; };
  return tools::process_main(command_line, argc, argv, name, [](tools::ProcessContext& context) {
    tools::warn_of_effects_left_out(context.config, "bevel-estimator");
    nodes::EstimatorNode node(context.lcm, context.config.estimator, nodes::motion_bounds(context.config.stepper));
    tools::inject(context, node.port());
    // Messages are handled as they arrive; the period is that of the health checks.
    nodes::run_periodic(context.lcm, {0.01, [&](const nodes::Now& now) { node.tell_time(now); },
                                      [&](const nodes::Now& now, double) {
                                        node.step(now);
                                        return true;
                                      }});
    return 0;
  });
}
