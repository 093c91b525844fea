// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Prediction of the place and time at which the tip reaches a moving target.
#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include <bevel/controller/target_track.hpp>

namespace bevel::controller {

/// Standard deviations of a moving target's predicted position that a limit of the miss allows for.
inline constexpr double kTargetDeviations = 2;

/// Prediction of a moving target.
struct FollowConfig {
  TargetMotion motion;          ///< model of the motion
  bool gate_breathing = false;  ///< arrive at a turning point of the respiratory motion
};

/// Predicts the position of a target at the arrival of the tip.
///
/// With gating, the arrival is planned for a turning point of the respiratory motion. The target hardly moves around
/// that time, so errors of the arrival time and of the frequency have little influence.
class Rendezvous {
 public:
  /// Constructs the prediction; restart() sets the target.
  /// @param config model of the motion, and whether to gate
  explicit Rendezvous(const FollowConfig& config) : gate_(config.gate_breathing), track_(config.motion) {}

  /// Begins with a new target.
  /// @param utime time of the position, us
  /// @param position_mm position of the target, {A}, mm
  void restart(std::int64_t utime, const Eigen::Vector3d& position_mm);
  /// Adds a position of the target (TargetTrack::observe).
  /// @param utime time of the position, us
  /// @param position_mm position of the target, {A}, mm
  void observe(std::int64_t utime, const Eigen::Vector3d& position_mm) { track_.observe(utime, position_mm); }

  /// Plans the arrival.
  /// @param now_utime current time, us
  /// @param ahead_mm distance from the tip to the target's depth, mm
  /// @param rate_mm_s largest insertion rate, mm/s
  void plan(std::int64_t now_utime, double ahead_mm, double rate_mm_s);
  /// Returns the target's position at the planned arrival.
  /// @return position, {A}, mm
  const Eigen::Vector3d& target_mm() const { return target_mm_; }
  /// Computes the standard deviation of the target's position at the planned arrival.
  /// @return standard deviation along the least certain axis, mm; 0 for a target with a single position, which is exact
  double target_sd_mm() const { return track_.is_fixed() ? 0 : track_.position_sd_mm(meeting_utime_); }
  /// Computes the insertion rate above which the tip arrives before the planned turning point.
  /// @param now_utime current time, us
  /// @param ahead_mm distance from the tip to the target's depth, mm
  /// @return rate, mm/s; infinity without gating and after the turning point
  double rate_limit_mm_s(std::int64_t now_utime, double ahead_mm) const;

 private:
  std::int64_t plan_turn(std::int64_t now_utime, std::int64_t usual_utime, double least_s);

  bool gate_;
  TargetTrack track_;
  std::optional<std::int64_t> turn_utime_;  // planned turning point, with gating
  std::int64_t meeting_utime_ = 0;
  Eigen::Vector3d target_mm_ = Eigen::Vector3d::Zero();
};

}  // namespace bevel::controller
