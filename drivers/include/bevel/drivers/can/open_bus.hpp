// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Creation of a bus from an address in a configuration file.

#include <memory>
#include <string>

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

/// Opens a bus. A link that does not exist yet is opened later, by Bus::maintain().
/// @param address "unix:/path" for a local bus (LocalHub), otherwise the name of a SocketCAN interface ("can0",
/// "vcan0")
/// @param listen  identifiers to receive, own echoes included; empty: all
/// @return the bus
/// @throws DeviceError if the address can never work: a name or path of invalid length, or a kernel without SocketCAN
std::unique_ptr<Bus> open_bus(const std::string& address, std::span<const std::uint32_t> listen = {});

}  // namespace bevel::can
