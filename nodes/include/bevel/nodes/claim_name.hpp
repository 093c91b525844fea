// SPDX-License-Identifier: MIT
#pragma once
// One of each process on a rig.
#include <lcm/lcm-cpp.hpp>
#include <string>

namespace bevel::nodes {

// Refuses a second process of this name on the same rig; throws IoError. On this machine the name is held
// until the process ends, however it ends; on the network a process of that name is listened for, which takes 0.6 s.
// One rig is one LCM network: `lcm_url` as the process uses it.
void claim_name(lcm::LCM& lcm, const std::string& lcm_url, const std::string& name);

/// Claims the name of an operator program, as claim_name() does, and refuses it where the heartbeat of another operator
/// program arrives within 0.6 s.
/// @throws IoError naming the other program and the remedy
void claim_operator(lcm::LCM& lcm, const std::string& lcm_url, const std::string& name);

}  // namespace bevel::nodes
