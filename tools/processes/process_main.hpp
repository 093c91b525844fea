#pragma once
// What the five processes' mains share: the system file and LCM.
#include <lcm/lcm-cpp.hpp>

#include "nodes/runtime.hpp"
#include "nodes/system_config.hpp"
#include "tools/common/command_line.hpp"

namespace bevel::tools {

using ProcessBody = std::function<int(nodes::SystemConfig& config, lcm::LCM& lcm)>;

// Adds --config and --lcm-url, parses, loads, starts LCM, catches signals, runs. Returns the exit status.
int process_main(CommandLine& command_line, int argc, char** argv, const ProcessBody& body);

// Asks for real-time scheduling where the file wants it; a refusal is said and not fatal.
void go_realtime(const nodes::SystemConfig& config, const char* program, int priority);

// A line on stderr for each effect of the file that cannot be used live.
void warn_of_effects_left_out(const nodes::SystemConfig& config, const char* program);

}  // namespace bevel::tools
