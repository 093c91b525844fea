// SPDX-License-Identifier: MIT
#include <bevel/controller/arc_law.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <bevel/controller/arc_walk.hpp>

namespace bevel::controller {
namespace {

constexpr double kDeviations = 1;
// Where it turns and where it has turned enough; between the two it rests. Facing: what the miss is across, of the
// tube's width. Away: half a plane is away, so that coarsely will do.
constexpr double kTurnAcross = 0.5, kRestAcross = 0.1;
constexpr double kTurnAway_rad = std::numbers::pi / 3, kRestAway_rad = 0.2;
constexpr double kEitherWay_rad = 0.8 * std::numbers::pi;  // a turn this long may as well go the other way round
constexpr double kBrakingShare = 0.6;                      // of the acceleration, for an axis that follows late
constexpr double kConvergence_per_s = 8;                   // at the end of a turn
constexpr double kTurned_rad = 0.02;                       // a half turn is at its end
constexpr double kNearly_rad = 0.3;                        // from here on the feed is not slowed for a turn

double turn_feed_mm_s(const SteeringLimits& limits) {
  return limits.insertion_rate_mm_s * limits.insertion_rate_min_share;
}

// Inserted during half a turn, at the feed of a turn.
double half_turn_mm(const SteeringLimits& limits) {
  const double half_turn_s =
      std::numbers::pi / limits.rotation_rate_rad_s + limits.rotation_rate_rad_s / limits.rotation_acceleration_rad_s2;
  return half_turn_s * turn_feed_mm_s(limits);
}

// As fast as the axis can still stop at the angle; in proportion at the end.
double turn_rate_rad_s(double left_rad, const SteeringLimits& limits) {
  const double braking = std::sqrt(2 * kBrakingShare * limits.rotation_acceleration_rad_s2 * std::abs(left_rad));
  return std::copysign(std::min({limits.rotation_rate_rad_s, braking, kConvergence_per_s * std::abs(left_rad)}),
                       left_rad);
}

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

}  // namespace

ArcGeometry arc_geometry(const model::Pose& tip, const model::NeedleParameters& needle, const ShaftConfig& shaft,
                         const Eigen::Vector3d& target_mm, const BendUncertainty& uncertain) {
  ArcGeometry g;
  const ArcWalk walk(needle, shaft);
  const model::Pose middle = walk.middle_of(tip);
  const Eigen::Matrix3d R = middle.R;
  const Eigen::Vector3d along = R.col(2);
  g.ahead_mm = along.dot(target_mm - tip.p_mm);
  if (g.ahead_mm <= 0) {
    g.in_domain = true;
    return g;
  }
  Eigen::Vector3d straight_mm, kept_mm, facing_mm;
  if (!walk.to_plane(middle, target_mm, along, 0, straight_mm) || !walk.to_plane(middle, target_mm, along, 1, kept_mm))
    return g;
  const auto across = [&](const Eigen::Vector3d& v) -> Eigen::Vector2d { return (R.transpose() * v).head<2>(); };
  g.aim_mm = across(target_mm - straight_mm);
  g.miss_mm = across(target_mm - kept_mm);
  const double side = needle.curvature_per_mm < 0 ? -1.0 : 1.0;
  g.facing_rad = std::atan2(side * g.aim_mm.x(), -side * g.aim_mm.y());
  // The reach is that of the side on which it is wanted: slip makes it differ by the side.
  model::Pose turned = middle;
  turned.R = R * model::exp_so3({0, 0, g.facing_rad});
  if (!walk.to_plane(turned, target_mm, along, 1, facing_mm)) return g;
  g.reach_mm = across(facing_mm - straight_mm).norm();
  const ArcWalk::End there = walk.end_at(tip.p_mm.z() + 0.5 * g.ahead_mm);
  g.reach_per_mm = std::abs(there.cut_rad) + std::abs(there.curvature_per_mm) * g.ahead_mm;
  // Of k (b^2 / 2 + b q + q^2 / 2), the reach deep in the tissue. Where the tip is is known: of the swing, b^2 / 2,
  // only what it goes through until the bevel faces W is not.
  const double k = needle.curvature_per_mm, b = shaft.bending_mm, q = g.ahead_mm, swings = 1 - std::cos(g.facing_rad);
  g.reach_sd_mm = std::hypot((swings * 0.5 * b * b + b * q + 0.5 * q * q) * uncertain.curvature_per_mm,
                             k * (swings * b + q) * uncertain.bending_mm);
  g.in_domain = true;
  return g;
}

double arc_miss_mm(const ArcGeometry& geometry, bool by_half_turns) {
  if (!geometry.in_domain || geometry.ahead_mm <= 0) return std::numeric_limits<double>::infinity();
  const double aside_mm = geometry.aim_mm.norm();
  if (!by_half_turns) return std::max(0.0, aside_mm - geometry.reach_mm);
  const double within_mm = aside_mm * std::abs(std::cos(geometry.facing_rad));
  return std::hypot(aside_mm * std::sin(geometry.facing_rad), std::max(0.0, within_mm - geometry.reach_mm));
}

// At rest, by half turns from where the bevel stands, each to its end, and none before the last one has had an effect.
Rates ArcLaw::flip(double error_rad, double rotation_rad, double inserted_mm, const ControllerConfig& config) {
  const SteeringLimits& limits = config.limits;
  const bool again = inserted_mm - flipped_at_mm_ > half_turn_mm(limits);
  if (!flip_to_rad_ && std::abs(error_rad) > 0.5 * std::numbers::pi && again)
    flip_to_rad_ = rotation_rad + (rotation_rad > 0 ? -std::numbers::pi : std::numbers::pi);  // unwinds the cable
  if (!flip_to_rad_) return {limits.insertion_rate_mm_s, 0};
  const double left_rad = *flip_to_rad_ - rotation_rad;
  if (std::abs(left_rad) < kTurned_rad) {
    flip_to_rad_.reset();
    flipped_at_mm_ = inserted_mm;
    return {limits.insertion_rate_mm_s, 0};
  }
  return {0, turn_rate_rad_s(left_rad, limits)};
}

Rates ArcLaw::step(const ArcGeometry& g, double rotation_rad, double inserted_mm, double tolerance_mm,
                   const ControllerConfig& config) {
  const SteeringLimits& limits = config.limits;
  if (!g.in_domain || g.ahead_mm <= 0) return {};
  const double smallest_mm = g.reach_per_mm * half_turn_mm(limits);  // half of what away and back changes
  const double width_mm = std::max({tolerance_mm + config.gains.tube_share * g.reach_per_mm * g.ahead_mm, smallest_mm,
                                    2 * kDeviations * g.reach_sd_mm});
  // Half turns alone steer within the plane of the bevel; what lies beside it they leave, and while they turn nothing
  // is inserted.
  const bool flips = config.law == Law::flip, by_halves = flips && inserted_mm > kOutside_mm;
  const double inserted_turning_mm = flips ? 0 : half_turn_mm(limits);
  const double aside_mm = g.aim_mm.norm() * (by_halves ? std::abs(std::cos(g.facing_rad)) : 1);
  const double S = aside_mm - g.reach_mm;
  // Away, and back before it is there: two half turns, and room to brake.
  const bool time_for_both = g.ahead_mm > 3 * inserted_turning_mm;
  if (side_ == Side::undecided) side_ = S < -width_mm ? Side::away : Side::facing;
  const double S_turned = S + g.reach_per_mm * inserted_turning_mm;
  // The target has come to lie on the other side: that is away, already.
  const bool passed = std::abs(g.facing_rad) > 0.5 * std::numbers::pi && S_turned < -0.5 * width_mm;
  if (side_ == Side::facing && (S < -width_mm || passed) && time_for_both)
    side_ = Side::away;
  else if (side_ == Side::away && (S_turned >= -0.5 * width_mm || !time_for_both))
    side_ = Side::facing;

  double error_rad = side_ == Side::facing ? g.facing_rad : wrapped(g.facing_rad + std::numbers::pi);
  if (by_halves) return flip(error_rad, rotation_rad, inserted_mm, config);
  const double across_mm = g.aim_mm.norm() * std::abs(std::sin(error_rad));
  // Before that it faces the target: but one that lies as good as ahead has no side.
  if (flips && std::abs(error_rad) > kTurned_rad && across_mm > tolerance_mm)
    return {0, turn_rate_rad_s(error_rad, limits)};
  if (flips) return {limits.insertion_rate_mm_s, 0};
  const bool far_off = std::abs(error_rad) > 0.5 * std::numbers::pi;
  const bool must_turn =
      side_ == Side::facing ? far_off || across_mm > kTurnAcross * width_mm : std::abs(error_rad) > kTurnAway_rad;
  const bool done =
      side_ == Side::facing ? !far_off && across_mm < kRestAcross * width_mm : std::abs(error_rad) < kRestAway_rad;
  turning_ = turning_ ? !done : must_turn;
  Rates wanted{limits.insertion_rate_mm_s, 0};
  if (!turning_) {
    turn_ = rotation_rad > 0 ? -1 : 1;  // the next half turn unwinds the cable
    return wanted;
  }
  if (std::abs(error_rad) > kEitherWay_rad) error_rad = std::copysign(error_rad, turn_);
  const double room_rad = limits.total_rotation_rad - std::abs(rotation_rad);
  if (error_rad * rotation_rad > 0 && std::abs(error_rad) > room_rad)
    error_rad -= std::copysign(2 * std::numbers::pi, error_rad);
  turn_ = std::copysign(1.0, error_rad);
  wanted.rotation_rad_s = turn_rate_rad_s(error_rad, limits);
  wanted.insertion_mm_s = std::abs(error_rad) > kNearly_rad ? turn_feed_mm_s(limits) : limits.insertion_rate_mm_s;
  return wanted;
}

}  // namespace bevel::controller
