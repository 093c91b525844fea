// bevel-controller: NEEDLE_STATE, ACTUATOR_STATE and STEERING_TARGET in, MOTION_COMMAND out at a fixed rate.
#include "nodes/controller_node.hpp"
#include "tools/processes/process_main.hpp"

int main(int argc, char** argv) {
  using namespace bevel;
  CLI::App app("Steers the needle to the target on STEERING_TARGET, and stops it when anything is wrong.",
               "bevel-controller");
  tools::ProcessOptions options;
  tools::add_options(app, options);
  return tools::process_main(argc, argv, app, options, [](const nodes::SystemConfig& config, lcm::LCM& lcm) {
    nodes::claim_name("bevel-controller");
    if (config.realtime)
      if (const std::string refused = nodes::try_realtime(40); !refused.empty())
        std::fprintf(stderr, "bevel-controller: %s; running without\n", refused.c_str());
    nodes::ControllerNode node(lcm, config.controller, config.needle);
    nodes::run_periodic(lcm, config.controller.period_s, [&](const nodes::Now& now, double late_s) {
      node.step(now.utime, late_s);
      return true;
    });
    return 0;
  });
}
