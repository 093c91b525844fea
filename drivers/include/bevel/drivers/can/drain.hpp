// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Dispatch of everything that has arrived on a bus.

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

/// Largest number of receptions in one call of drain(), so that continuous traffic does not block the caller.
inline constexpr int kReceptionsPerCall = 256;

/// Receives until the bus has nothing queued, at most kReceptionsPerCall times, and calls one function for each result.
/// @param bus      bus to receive from
/// @param on_frame called with each const Frame& of another participant
/// @param on_echo  called with each const Frame& of this participant that is on the wire
/// @param on_event called with each BusEvent
template <class OnFrame, class OnEcho, class OnEvent>
void drain(Bus& bus, OnFrame on_frame, OnEcho on_echo, OnEvent on_event) {
  for (int i = 0; i < kReceptionsPerCall; ++i) {
    const Reception found = bus.receive();
    switch (found.kind) {
      case Reception::Kind::nothing:
        return;
      case Reception::Kind::frame:
        on_frame(found.frame);
        break;
      case Reception::Kind::echo:
        on_echo(found.frame);
        break;
      case Reception::Kind::event:
        on_event(found.event);
        break;
    }
  }
}

}  // namespace bevel::can
