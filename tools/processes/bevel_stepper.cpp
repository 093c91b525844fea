// bevel-stepper: MOTION_COMMAND in, two CiA 402 drives over CAN (or the rig's local bus), ACTUATOR_STATE out.
#include "drivers/can/open_bus.hpp"
#include "nodes/stepper_node.hpp"
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  tools::CommandLine command_line("bevel-stepper", "Drives the insertion and rotation axes over CANopen.");
  std::string can;
  command_line.option("--can", can, "bus instead of the file's: can0, or unix:/path for the rig's local bus");
  return tools::process_main(command_line, argc, argv, [&](nodes::SystemConfig& config, lcm::LCM& lcm) {
    nodes::claim_name("bevel-stepper");
    tools::go_realtime(config, "bevel-stepper", 50);
    const auto bus = can::open_bus(can.empty() ? config.can : can, stepper::StepperDriver::listen_ids(config.stepper));
    nodes::StepperNode node(lcm, *bus, config.stepper);
    nodes::run_periodic(lcm, static_cast<double>(config.stepper.period_ns) * 1e-9, [&](const nodes::Now& now, double) {
      node.step(now.ns, now.utime);
      return true;
    });
    return 0;
  });
}
