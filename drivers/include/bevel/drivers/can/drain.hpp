// SPDX-License-Identifier: MIT
// What has arrived on a bus, handed on by its kind.
#pragma once

#include <bevel/drivers/can/bus.hpp>

namespace bevel::can {

// At most so many receptions in one call: a bus that never falls silent must not hold whoever reads it.
inline constexpr int kReceptionsPerCall = 256;

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
