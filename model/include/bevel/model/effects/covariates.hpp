// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Covariates of the discrepancies and of the measurements. All but the tip positions follow from the actuator motion.
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {

/// Values of all covariates at one time. The enumerators of Covariate state the definitions and units. The tip
/// positions are NaN until a caller that knows the tip sets them.
struct Covariates {
  std::array<double, kCovariates> value{};  ///< values in the order of Covariate, in their units
  /// Returns one value.
  /// @param covariate covariate
  /// @return its value, in its unit
  double operator[](Covariate covariate) const { return value[static_cast<std::size_t>(covariate)]; }
  /// Accesses one value.
  /// @param covariate covariate
  /// @return reference to its value, in its unit
  double& operator[](Covariate covariate) { return value[static_cast<std::size_t>(covariate)]; }
};

/// Computes the covariates of the actuator motion leg by leg. Insertion counts as moving above 0.05 mm/s and rotation
/// above 0.02 rad/s. A change of the insertion velocity by more than 0.5 mm/s counts as a speed change.
class CovariateTracker {
 public:
  /// State that the next leg requires.
  struct History {
    double moved_s = 0;     ///< time at which insertion last moved, s
    double turned_mm = 0;   ///< insertion at which the shaft last rotated, mm
    double deepest_mm = 0;  ///< largest insertion so far, mm
    double changed_s = 0;   ///< time of the last speed change, s
    double speed_mm_s = 0;  ///< insertion velocity since that change, mm/s
  };
  /// Starts at the entry and computes the covariates there.
  /// @param entry actuator motion at the entry
  explicit CovariateTracker(const BaseMotion& entry)
      : CovariateTracker(entry, {entry.time_s, entry.insertion_mm, entry.insertion_mm, entry.time_s}) {
    advance(entry, entry);
  }
  /// Resumes from a state. The covariates are valid after the next leg.
  /// @param entry actuator motion at the entry
  /// @param history state from history()
  CovariateTracker(const BaseMotion& entry, const History& history)
      : entry_turned_rad_(entry.rotation_rad), history_(history) {}
  /// Updates the covariates to the end of a leg.
  /// @param from actuator motion at the start of the leg
  /// @param to actuator motion at the end of the leg
  void advance(const BaseMotion& from, const BaseMotion& to);
  /// @return the state for the next leg
  const History& history() const { return history_; }
  /// @return the covariates at the end of the last leg
  const Covariates& now() const { return now_; }
  /// Returns one covariate at the end of the last leg.
  /// @param covariate covariate
  /// @return its value, in its unit
  double operator[](Covariate covariate) const { return now_[covariate]; }

 private:
  double entry_turned_rad_;
  History history_;
  Covariates now_;
};

/// Projects a point onto a direction of tip_direction(). A coordinate with weight zero is ignored, even if it is NaN.
/// @param direction unit vector (x, y) in {A}
/// @param point_mm point in {A}, mm
/// @return the coordinate along \p direction, mm; NaN if a required coordinate is NaN
double place_along(const Eigen::Vector2d& direction, const Eigen::Vector3d& point_mm);

/// Computes the covariates at all nodes of a motion.
/// @param nodes nodes in order of time, at least one; the first is the entry
/// @return one element per node
std::vector<Covariates> find_covariates(std::span<const BaseMotion> nodes);

}  // namespace bevel::model
