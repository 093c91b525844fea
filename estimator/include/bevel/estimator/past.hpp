// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Steps that have left the estimator's history, for NeedleFilter::relinearise.
#include <span>
#include <vector>

#include <bevel/estimator/needle_filter.hpp>

namespace bevel::estimator {

/// Motion of the tip in one step of the model.
struct Moved {
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();   ///< displacement of the tip, {A}, mm
  Eigen::Vector3d heading = Eigen::Vector3d::Zero();  ///< change of the heading's unit vector, {A}
  Eigen::Vector3d motion = Eigen::Vector3d::Zero();   ///< change of the unit vector of the direction of motion, {A}
};

/// Compresses the past into few steps with few measurements.
///
/// Consecutive steps of the same direction with nearly proportional increments are joined to a stretch of at most
/// 2.5 mm and 0.25 rad. The measurements within a stretch become one, at their mean position in it. About forty
/// measurements represent 100 mm of insertion at any frame rate. Nothing is allocated after construction.
class Past {
 public:
  /// Constructs an empty past.
  /// @param room largest number of steps
  explicit Past(std::size_t room);

  /// Removes all steps.
  /// @param start state before the next step
  void restart(const FilterState& start);
  /// Adds one step of the history.
  /// @param before state before the step
  /// @param step increments and measurements of the step
  /// @param after state after the step
  /// @param moved motion of the tip in the step
  /// @param filter filter of the history
  void add(const FilterState& before, const PastStep& step, const FilterState& after, const Moved& moved,
           const NeedleFilter& filter);
  /// Ends the present stretch, so that steps() has all steps added so far.
  /// @param end state after the newest step
  /// @param filter filter of the history
  void close(const FilterState& end, const NeedleFilter& filter);

  /// Returns the first state.
  /// @return state before the first step
  const FilterState& start() const { return start_; }
  /// Returns the steps up to the last close().
  /// @return steps in order of time
  std::span<const PastStep> steps() const { return steps_; }
  /// Returns the capacity.
  /// @return largest number of steps
  std::size_t room() const { return steps_.capacity(); }
  /// Returns whether every step was recorded.
  /// @return false if the capacity was exceeded since restart()
  bool complete() const { return complete_; }

 private:
  bool joins(const PastStep& step) const;
  void join(const DirectionReading& comes, const Eigen::Vector3d& ahead, DirectionReading& open,
            Eigen::Vector3d& offset);
  void append(double insertion_mm, double rotation_rad);

  FilterState start_;
  std::vector<PastStep> steps_;
  PastStep open_;  // the present stretch; point_mm and directions at its end
  bool has_open_ = false;
  double progress_ = 0;  // length of the stretch, |mm| + |rad|
  // Mean progress of its position measurements; without any, of its heading measurements.
  double measured_at_ = 0;
  bool complete_ = true;
};

}  // namespace bevel::estimator
