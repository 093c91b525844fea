// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// Detection of cameras that are silent or frozen, from the arrival of their messages. Uses the steady clock, so that
/// setting the wall clock cannot hide a dead camera.
#include <array>
#include <bevel/tip_heading_t.hpp>
#include <bevel/tip_measurement_t.hpp>
#include <cstdint>
#include <map>

namespace bevel::nodes {

/// Monitors the messages of all cameras.
class CameraWatch {
 public:
  /// Creates a watch without cameras.
  /// @param silence_s longest allowed time between two messages of a camera, s
  explicit CameraWatch(double silence_s) : silence_ns_(static_cast<std::int64_t>(silence_s * 1e9)) {}

  /// Records a tip measurement.
  /// @param m            message
  /// @param insertion_mm present position of the insertion axis, mm
  /// @param now_ns       steady clock, ns
  void hear(const tip_measurement_t& m, double insertion_mm, std::int64_t now_ns);
  /// Records a tip heading.
  /// @param m            message
  /// @param insertion_mm present position of the insertion axis, mm
  /// @param now_ns       steady clock, ns
  void hear(const tip_heading_t& m, double insertion_mm, std::int64_t now_ns);
  /// Evaluates all cameras. A camera is frozen if it repeats a value while the insertion axis moves.
  /// @param now_ns steady clock, ns
  /// @return bits kCameraSilent and kCameraFrozen of bevel/estimator/health.hpp
  std::int32_t health(std::int64_t now_ns) const;
  /// Forgets all cameras.
  void restart() { cameras_.clear(); }

 private:
  using Says = std::array<double, 3>;
  void hear(std::int32_t number, std::int32_t status, const Says& says, double insertion_mm, std::int64_t now_ns);

  struct Camera {
    std::int64_t heard_ns = 0;
    Says says{};
    double insertion_mm = 0;  // when the value last changed
    int repeats = 0;
    bool frozen = false;
  };
  std::int64_t silence_ns_;
  std::map<std::int32_t, Camera> cameras_;  // grows at the first message of each; the port bounds how many
};

}  // namespace bevel::nodes
