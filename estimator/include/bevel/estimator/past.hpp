// SPDX-License-Identifier: MIT
#pragma once
// What has left the estimator's history, as the few steps that NeedleFilter::relinearise runs again: neighbours of one
// direction whose rates are nearly in proportion become one stretch, and what was measured on the way one reading,
// where on the average it was taken. A hundred millimetres are some forty readings, whatever the frame rate.
#include <span>
#include <vector>

#include <bevel/estimator/needle_filter.hpp>

namespace bevel::estimator {

// By how much a step of the model moved the tip, the heading and the way the tip moves, in {A}.
struct Moved {
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d heading = Eigen::Vector3d::Zero();
  Eigen::Vector3d motion = Eigen::Vector3d::Zero();
};

class Past {
 public:
  explicit Past(std::size_t room);  // sized here, nothing is allocated later

  // Forgets everything; what comes next starts at `start`.
  void restart(const FilterState& start);
  // The history's step from `before`, by the increments of `step` and its measurement, to `after`.
  void add(const FilterState& before, const PastStep& step, const FilterState& after, const Moved& moved,
           const NeedleFilter& filter);
  // Ends the stretch which still grows; `end` is the state after the newest step.
  void close(const FilterState& end, const NeedleFilter& filter);

  const FilterState& start() const { return start_; }
  std::span<const PastStep> steps() const { return steps_; }
  std::size_t room() const { return steps_.capacity(); }
  bool complete() const { return complete_; }  // false once there was no room

 private:
  bool joins(const PastStep& step) const;
  void join(const DirectionReading& comes, const Eigen::Vector3d& ahead, DirectionReading& open,
            Eigen::Vector3d& offset);
  void append(double insertion_mm, double rotation_rad);

  FilterState start_;
  std::vector<PastStep> steps_;
  PastStep open_;  // the stretch that still grows; point_mm and direction at its end
  bool has_open_ = false;
  double progress_ = 0;  // of the stretch, |mm| + |rad|
  // Progress at which its readings of the position were taken, on the average; without any, those of the heading.
  double measured_at_ = 0;
  bool complete_ = true;
};

}  // namespace bevel::estimator
