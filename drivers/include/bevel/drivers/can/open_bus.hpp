// SPDX-License-Identifier: MIT
// From an address in a configuration file to a bus.
#pragma once

#include <memory>
#include <string>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

// address: "unix:/path" is a local bus (LocalHub), anything else the name of a SocketCAN interface ("can0", "vcan0").
// listen: the identifiers to hear, own echoes included; empty hears all.
// A link that is not there yet is waited for; throws DeviceError for an address that can never work.
std::unique_ptr<Bus> open_bus(const std::string& address, std::span<const std::uint32_t> listen = {});

}  // namespace bevel::can
