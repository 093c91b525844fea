// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// bevel-rig: simulates a needle, cameras and two drives. The drives are on a CAN bus, the frames on a UNIX socket, the
/// true tip on NEEDLE_TRUTH, and its heading on TIP_HEADING if the needle has a sensor for it. The interfaces are those
/// of a hardware rig.
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

/// Node of the process bevel-rig.
class RigNode {
 public:
  /// Creates the simulated rig.
  /// @param lcm           LCM; must outlive the node
  /// @param insertion_bus bus of the insertion drive
  /// @param rotation_bus  bus of the rotation drive; a different one, because two drives on one bus would take each
  /// other's
  ///   frames
  /// @param config        system file
  /// @param frames        server of the frames; null: no images
  RigNode(lcm::LCM& lcm, can::Bus& insertion_bus, can::Bus& rotation_bus, const SystemConfig& config,
          rig::FrameServer* frames);
  /// Simulates the time since the last call. Call it about every millisecond.
  /// @param now present time
  void step(const Now& now);

  /// Plans a fault of one of the drives. Call it before the first step.
  /// @param fault    fault; starts fault.at_s after start_ns
  /// @param start_ns steady clock, ns
  /// @param seed     seed of the fault
  /// @throws ArgumentError if the component is not a drive
  void break_drive(const Fault& fault, std::int64_t start_ns, std::uint64_t seed);
  /// Returns the bus of a drive.
  /// @param axis 0 insertion, 1 rotation
  /// @return bus with fault injection
  FaultyBus& faulty_bus(std::size_t axis) { return buses_.at(axis); }

  /// @return simulated needle
  const rig::Plant& plant() const { return *plant_; }
  /// @return insertion-specific parameters, drawn from the rig's [variation] with its seed
  const model::OwnValues& own_values() const { return own_values_; }
  /// Returns a simulated drive.
  /// @param axis 0 insertion, 1 rotation
  /// @return drive
  rig::SimulatedDrive& drive(std::size_t axis) { return *drives_[axis]; }

 private:
  struct Eye {
    int camera;
    bool along_x;  // it looks along x; effects of a camera apply to it
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
    std::int64_t due_ns;  // steady clock: setting the wall clock must not delay images
    camera::Frame frame;  // with camera latency, stamped with the time of arrival
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
