// SPDX-License-Identifier: MIT
#pragma once
// What the five processes' mains share: the system file, LCM, their name on the rig, and how they end.
#include <lcm/lcm-cpp.hpp>
#include <optional>

#include <bevel/cli/command_line.hpp>
#include <bevel/nodes/fault_injector.hpp>
#include <bevel/nodes/lcm_port.hpp>
#include <bevel/nodes/runtime.hpp>
#include <bevel/nodes/system_config.hpp>

namespace bevel::tools {

struct ProcessContext {
  nodes::SystemConfig& config;
  lcm::LCM& lcm;
  std::optional<nodes::Fault> fault;  // to be injected into what this process sends; counted from its start
  std::int64_t started_ns = 0;
};
inline constexpr std::uint64_t kFaultSeed = 1;

using ProcessBody = std::function<int(ProcessContext& context)>;
// Which name the process claims, so that there is one of it on a rig.
using ProcessName = std::function<std::string(const nodes::SystemConfig& config)>;

// Adds --config, --lcm-url, --fault and --end-with, parses, loads, starts LCM, catches signals, claims the name, runs.
// realtime_priority: of SCHED_FIFO, asked for before LCM starts where the file wants it, so that the thread on which
// LCM receives has it too; a refusal is said and not fatal. 0: never. Returns the exit status.
int process_main(cli::CommandLine& command_line, int argc, char** argv, const ProcessName& name, int realtime_priority,
                 const ProcessBody& body);
inline int process_main(cli::CommandLine& command_line, int argc, char** argv, const ProcessName& name,
                        const ProcessBody& body) {
  return process_main(command_line, argc, argv, name, 0, body);
}

// Makes what the port sends suffer the fault that was asked for, if any.
void inject(const ProcessContext& context, nodes::LcmPort& port);

// A line on stderr for each effect of the file that cannot be used live.
void warn_of_effects_left_out(const nodes::SystemConfig& config, const char* program);

}  // namespace bevel::tools
