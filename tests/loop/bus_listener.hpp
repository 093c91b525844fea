// SPDX-License-Identifier: MIT
// What the drives say of their rates, read from the bus beside the driver: for studies with real processes.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <bevel/drivers/can/open_bus.hpp>
#include <bevel/drivers/stepper/cia301.hpp>
#include <bevel/drivers/stepper/stepper_config.hpp>
#include <bevel/nodes/runtime.hpp>

namespace bevel::test {

inline constexpr double kRest_unit_s = 0.05;
inline constexpr double kMoving_unit_s = 1.0;
inline constexpr std::int64_t kMs = 1'000'000;              // ns
inline constexpr std::int64_t kToRest_ns = 200 * kMs;       // docs/hazards.md
inline constexpr std::int64_t kFrameOverdue_ns = 25 * kMs;  // of a cycle of 10 ms

// What the drives say of their rates (606C), in TPDO1 or when asked.
class BusListener {
 public:
  BusListener(const std::string& bus, const stepper::StepperConfig& config) : config_(config) {
    std::vector<std::uint32_t> ids;
    for (const auto& axis : config.axes) {
      ids.push_back(stepper::cia301::tpdo1_id(axis.node_id));
      ids.push_back(stepper::cia301::sdo_response_id(axis.node_id));
    }
    ids.push_back(stepper::cia301::kSyncId);
    bus_ = can::open_bus(bus, ids);
  }
  void listen() {
    bus_->maintain(nodes::now().ns);
    for (can::Reception r = bus_->receive(); r.kind != can::Reception::Kind::nothing; r = bus_->receive()) {
      if (r.kind != can::Reception::Kind::frame) continue;
      if (r.frame.id == stepper::cia301::kSyncId) driver_ns_ = nodes::now().ns;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto node = config_.axes.at(axis).node_id;
        const bool answer = r.frame.id == stepper::cia301::sdo_response_id(node) && r.frame.data[0] == 0x43 &&
                            stepper::cia301::get_u16(r.frame, 1) == 0x606C;
        if (!answer && r.frame.id != stepper::cia301::tpdo1_id(node)) continue;
        const auto counts_s = static_cast<std::int32_t>(stepper::cia301::get_u32(r.frame, answer ? 4 : 2));
        rate_.at(axis) = counts_s / config_.axes.at(axis).counts_per_unit;
        if (!answer) heard_ns_ = nodes::now().ns;
      }
    }
  }
  // Where no driver asks any more somebody has to: an SDO for 606C, which a drive answers in any state. A driver that
  // lives takes such an answer for another master's, so only where it cannot be on time any more.
  void ask_if_silent(std::int64_t silence_ns = kFrameOverdue_ns) {
    if (nodes::now().ns - heard_ns_ < silence_ns) return;
    for (const auto& axis : config_.axes)
      (void)bus_->send({stepper::cia301::sdo_request_id(axis.node_id), 8, {0x40, 0x6C, 0x60, 0x00}});
  }
  double rate(std::size_t axis) const { return std::abs(rate_.at(axis)); }
  bool at_rest() const { return rate(0) < kRest_unit_s && rate(1) < kRest_unit_s; }
  std::int64_t driver_ns() const { return driver_ns_; }  // when the driver last began a cycle (SYNC)

 private:
  stepper::StepperConfig config_;
  std::unique_ptr<can::Bus> bus_;
  std::array<double, 2> rate_{};
  std::int64_t heard_ns_ = 0;
  std::int64_t driver_ns_ = 0;
};

}  // namespace bevel::test
