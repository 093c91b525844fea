// SPDX-License-Identifier: MIT
#pragma once
// bevel-rig: a needle, two cameras and two drives that exist only as programs. Drives on a CAN bus, frames on a Unix
// socket, the true tip on NEEDLE_TRUTH, and its heading on TIP_HEADING if the needle has a sensor for it. The rest of
// the software cannot tell it from a bench.
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include <bevel/drivers/can/bus.hpp>
#include <bevel/nodes/faulty_bus.hpp>
#include <bevel/nodes/status_reporter.hpp>
#include <bevel/nodes/system_config.hpp>
#include <bevel/rig/camera/frame_server.hpp>
#include <bevel/rig/camera/needle_renderer.hpp>
#include <bevel/rig/drives/simulated_drive.hpp>
#include <bevel/rig/plant/plant.hpp>

namespace bevel::nodes {

class RigNode {
 public:
  // One bus for each drive: two on one would eat each other's frames. `frames` may be null: no pictures.
  RigNode(lcm::LCM& lcm, can::Bus& insertion_bus, can::Bus& rotation_bus, const SystemConfig& config,
          rig::FrameServer* frames);
  // Call about every millisecond.
  void step(const Now& now);

  // A fault of one of the drives, from start_ns + fault.at_s on (steady clock). Before the first step.
  void break_drive(const Fault& fault, std::int64_t start_ns, std::uint64_t seed);
  FaultyBus& faulty_bus(std::size_t axis) { return buses_.at(axis); }

  const rig::Plant& plant() const { return *plant_; }
  // What this insertion has of its own, drawn from the rig's [variation] with its seed.
  const model::OwnValues& own_values() const { return own_values_; }
  rig::SimulatedDrive& drive(std::size_t axis) { return *drives_[axis]; }

 private:
  struct Eye {
    int camera;
    bool along_x;  // it looks along x, and so is the one that effects of a camera concern
    rig::NeedleRenderer renderer;
  };
  void move_plant(std::int64_t now_ns);
  void publish_truth(std::int64_t now_utime);
  void take_heading(const Now& now);
  void publish_headings(std::int64_t now_ns);
  void take_frames(const Now& now);
  void publish_frames(std::int64_t now_ns);

  SystemConfig config_;
  LcmPort port_;
  StatusReporter status_;
  std::array<FaultyBus, 2> buses_;
  std::array<std::unique_ptr<rig::SimulatedDrive>, 2> drives_;
  std::optional<std::size_t> blocked_axis_;
  std::int64_t blocked_from_ns_ = 0;
  std::unique_ptr<rig::Plant> plant_;
  model::OwnValues own_values_;
  rig::FrameServer* frames_;
  std::vector<Eye> eyes_;
  struct Taken {
    std::int64_t due_ns;  // steady: who sets the wall clock keeps no picture back
    camera::Frame frame;  // a late camera's is stamped with the time at which it arrives
  };
  std::deque<Taken> taken_;
  struct Felt {
    std::int64_t due_ns;
    tip_heading_t heading;
  };
  std::deque<Felt> felt_;
  std::mt19937_64 heading_noise_;
  std::array<double, 2> moved_{};  // axis positions that the plant has followed
  std::int64_t last_ns_ = 0;
  std::int64_t next_truth_ns_ = 0;
  std::int64_t next_frame_ns_ = 0;
  std::int64_t next_heading_ns_ = 0;
  std::int64_t truth_seq_ = 0;
  std::int64_t frame_seq_ = 0;
  std::int64_t heading_seq_ = 0;
};

}  // namespace bevel::nodes
