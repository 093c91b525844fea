// SPDX-License-Identifier: MIT
#pragma once
// Where and when tip and target meet: the target is aimed at where it will be when the tip gets there. Of a target that
// breathes the tip may be made to arrive where it turns round (gating): about then it hardly moves, so that neither the
// time of arrival nor the frequency need be known well.
#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include <bevel/controller/target_track.hpp>

namespace bevel::controller {

inline constexpr double kTargetDeviations = 2;  // of where a target that moves will be

struct FollowConfig {
  TargetMotion motion;
  bool gate_breathing = false;
};

class Rendezvous {
 public:
  explicit Rendezvous(const FollowConfig& config) : gate_(config.gate_breathing), track_(config.motion) {}

  void restart(std::int64_t utime, const Eigen::Vector3d& position_mm);
  void observe(std::int64_t utime, const Eigen::Vector3d& position_mm) { track_.observe(utime, position_mm); }

  // Plans the meeting for a tip that still has about ahead_mm to go at no more than rate_mm_s.
  void plan(std::int64_t now_utime, double ahead_mm, double rate_mm_s);
  const Eigen::Vector3d& target_mm() const { return target_mm_; }
  /// Returns the standard deviation, mm, of the target's position at the meeting: 0 for a target that was commanded
  /// once, whose position is exact.
  double target_sd_mm() const { return track_.is_fixed() ? 0 : track_.position_sd_mm(meeting_utime_); }
  // Above this the tip would be there too early.
  double rate_limit_mm_s(std::int64_t now_utime, double ahead_mm) const;

 private:
  std::int64_t plan_turn(std::int64_t now_utime, std::int64_t usual_utime, double least_s);

  bool gate_;
  TargetTrack track_;
  std::optional<std::int64_t> turn_utime_;  // at which it is to arrive, if gating
  std::int64_t meeting_utime_ = 0;
  Eigen::Vector3d target_mm_ = Eigen::Vector3d::Zero();
};

}  // namespace bevel::controller
