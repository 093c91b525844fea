// SPDX-License-Identifier: MIT
// Drives that acknowledge a stop and do not carry it out, and settings that change while they move.
#include <cmath>

#include "tests/faults/fault_matrix.hpp"

namespace bevel::test {
namespace {

constexpr std::uint16_t kQuickStopRamp = 0x6085;
constexpr double kBehind_unit = 0.06;  // mm or rad: 0.05 that the driver tolerates, and 0.01 for scale and timing
constexpr const char* kAxisNames[] = {"insertion_drive", "rotation_drive"};

// A stop by the operator, or because the controller or the estimator ends.
void order_a_stop(SimulatedLoop& loop, std::mt19937_64& rng) {
  switch (rng() % 3) {
    case 0:
      return loop.say(nodes::Word::stop);
    case 1:
      return loop.controller.reset();
    default:
      return loop.estimator.reset();
  }
}

// Reasons of such a stop. The first one is missing if the axis was slow enough to rest by itself.
std::vector<std::string> causes_of_a_stop(const char* first) {
  return {first, "stopped by the operator", "set-points too old", "needle state stale",
          "a setting of the drive was changed"};  // the read-back may come before a silence is noticed
}

void restart(SimulatedLoop& loop) {
  if (!loop.controller) loop.start_controller();
  if (!loop.estimator) loop.start_estimator();
}

FaultClass stop_not_carried_out(std::size_t axis) {
  FaultClass c;
  c.name = std::string(kAxisNames[axis]) + ":stop_not_carried_out";
  c.causes = causes_of_a_stop("DID NOT SLOW");
  c.inject = [axis](SimulatedLoop& loop, std::mt19937_64& rng) {
    loop.rig->drive(axis).corrupt(kQuickStopRamp, 0, 1);
    order_a_stop(loop, rng);
  };
  c.mend = restart;
  return c;
}

FaultClass power_stage_stuck(std::size_t axis) {
  FaultClass c;
  c.name = std::string(kAxisNames[axis]) + ":power_stage_stuck";
  c.causes = causes_of_a_stop("DOES NOT STOP");
  c.defies_stops = true;
  c.inject = [axis](SimulatedLoop& loop, std::mt19937_64& rng) {
    loop.rig->drive(axis).set_power_stage_stuck(true);
    order_a_stop(loop, rng);
  };
  c.mend = [axis](SimulatedLoop& loop) {
    loop.rig->drive(axis).set_power_stage_stuck(false);
    restart(loop);
  };
  return c;
}

FaultClass foreign_write(std::size_t axis) {
  FaultClass c;
  c.name = std::string(kAxisNames[axis]) + ":foreign_write";
  c.causes = {"another master commands the drives"};
  c.inject = [axis](SimulatedLoop& loop, std::mt19937_64&) {
    const auto node = loop.config.stepper.axes.at(axis).node_id;
    can::Frame frame{stepper::cia301::sdo_request_id(node), 8, {0x23}};
    stepper::cia301::put_u16(frame, 1, kQuickStopRamp);
    stepper::cia301::put_u32(frame, 4, 1);
    loop.network.inject(frame);
  };
  c.mend = [](SimulatedLoop&) {};
  return c;
}

// The velocity factor becomes 20 or 1/20. It shows once the shaft is nowhere it was commanded to be.
FaultClass unit_error(std::size_t axis) {
  FaultClass c;
  c.name = std::string(kAxisNames[axis]) + ":unit_error";
  c.causes = {"moves faster than commanded", "does not follow", "a setting of the drive was changed",
              "ACTUATOR_STATE: "};
  c.inject = [axis](SimulatedLoop& loop, std::mt19937_64& rng) {
    loop.rig->drive(axis).corrupt(0x6096, static_cast<std::uint8_t>(1 + rng() % 2), 20);
  };
  c.mend = [axis](SimulatedLoop& loop) {
    for (const std::uint8_t term : {std::uint8_t{1}, std::uint8_t{2}}) loop.rig->drive(axis).corrupt(0x6096, term, 1);
  };
  c.shows = [axis](const SimulatedLoop& loop) {
    const double shaft = loop.rig->drive(axis).position_unit();
    const auto beyond = [&](double sign) {
      return std::ranges::all_of(loop.told,
                                 [&](const auto& told) { return sign * (told.at(axis) - shaft) > kBehind_unit; });
    };
    return beyond(1) || beyond(-1);
  };
  return c;
}

}  // namespace

std::vector<FaultClass> drive_fault_classes() {
  std::vector<FaultClass> classes;
  for (const std::size_t axis : {stepper::kInsertion, stepper::kRotation}) {
    classes.push_back(stop_not_carried_out(axis));
    classes.push_back(power_stage_stuck(axis));
    classes.push_back(foreign_write(axis));
    classes.push_back(unit_error(axis));
  }
  return classes;
}

}  // namespace bevel::test
