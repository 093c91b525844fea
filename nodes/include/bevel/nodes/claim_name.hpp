// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Only one process of each name on a rig.
#include <lcm/lcm-cpp.hpp>
#include <string>

namespace bevel::nodes {

/// Claims a process name on the rig. On this machine the name is held until the process ends, in whatever manner it
/// ends. On the network, messages of a process with that name are awaited for 0.6 s. One rig is one LCM network.
/// @param lcm     LCM of the process
/// @param lcm_url LCM provider as the process uses it
/// @param name    process name
/// @throws IoError if a second process of this name runs on the rig
void claim_name(lcm::LCM& lcm, const std::string& lcm_url, const std::string& name);

/// Claims the name of an operator program, as claim_name() does, and rejects it if the heartbeat of another operator
/// program arrives within 0.6 s.
/// @param lcm     LCM of the process
/// @param lcm_url LCM provider as the process uses it
/// @param name    process name
/// @throws IoError naming the other program and the remedy
void claim_operator(lcm::LCM& lcm, const std::string& lcm_url, const std::string& name);

}  // namespace bevel::nodes
