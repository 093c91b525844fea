// SPDX-License-Identifier: MIT
// bevel-stepper: MOTION_COMMAND in, two CiA 402 drives over CAN (or the rig's local bus), ACTUATOR_STATE out.
#include <cstdio>

#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/nodes/stepper_node.hpp>
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  constexpr int kPriority = 50;  // of SCHED_FIFO
  constexpr double kLongestStop_s = 0.5;
  cli::CommandLine command_line("bevel-stepper", "Drives the insertion and rotation axes over CANopen.");
  command_line.example("bevel-stepper --config config/demo.toml");
  std::string can;
  command_line.option("--can", can, "bus instead of the file's: can0, or unix:/path for the rig's local bus");
  const auto name = [](const nodes::SystemConfig&) { return "bevel-stepper"; };
  return tools::process_main(command_line, argc, argv, name, kPriority, [&](tools::ProcessContext& context) {
    const stepper::StepperConfig& config = context.config.stepper;
    const auto bus = can::open_bus(can.empty() ? context.config.can : can, stepper::StepperDriver::listen_ids(config));
    nodes::StepperNode node(context.lcm, *bus, config);
    tools::inject(context, node.port());
    const auto loop = [&](bool to_rest) {
      return nodes::Loop{static_cast<double>(config.period_ns) * 1e-9,
                         [&](const nodes::Now& now) { node.tell_time(now); },
                         [&, to_rest](const nodes::Now& now, double) {
                           node.step(now);
                           return !(to_rest && node.at_rest());
                         },
                         [&] { return node.waits_for_bus() ? bus->poll_fd() : -1; },
                         [&](const nodes::Now& now) { node.hear_bus(now); }};
    };
    // The axes are brought to rest before this ends, and others hear of it.
    nodes::run_with_end(
        context.lcm, loop(false), [&] { node.end(); }, loop(true), kLongestStop_s);
    if (node.at_rest()) return 0;
    std::fprintf(stderr, "bevel-stepper: ended before both axes were measured at rest: %s\n",
                 stepper::describe(node.report()).c_str());
    return 1;
  });
}
