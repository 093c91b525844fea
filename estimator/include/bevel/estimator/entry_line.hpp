// SPDX-License-Identifier: MIT
#pragma once
// Along what line the needle went in, from the first centimetres of an insertion, as {A} of the readings sees it. A
// slope that insertions on this rig do not have, by the width that is expected of them, says that the camera's frame is
// turned against the guide's, or the guide. It cannot say which: a target seen by the same cameras is met all the same,
// one given in the guide's frame is missed by the slope times the depth.
//
// Weighted least squares, recursive, of what the readings are beside the path that the prior's mean needle goes on the
// reported axes, p(t):
//   x, y of the reading - p  =  (x0, y0) + (a, b) z + c p_xy + r (-p_y, p_x) + sum of l_i dp_xy / dl_i
// with the entry point (x0, y0), the slope (a, b), the relative error c of the bend, the bevel's roll r, and lambda1,
// lambda2 and a stiff shaft's bending length in their own standard deviations: which way a needle slips looks like a
// slope until it is turned. Of slope and bend next to nothing is held beforehand, of the others the filter's priors.
// Measurements along z are left out: they contain no slope. Autocorrelated errors of a camera (ReadingNoise) reduce the
// information of each measurement by NeedleFilter::worth, so that many of them count by their effective sample size.
// Lengths in mm, angles in rad; nothing allocates.
#include <array>
#include <cstdint>

#include <bevel/estimator/needle_filter.hpp>

namespace bevel::estimator {

class EntryLine {
 public:
  static constexpr double kFrom_mm = 10, kTo_mm = 30;  // of insertion: says nothing before, takes nothing after

  explicit EntryLine(const EstimatorConfig& config);

  // From the next actuator state on, which is at the entry point.
  void restart();
  // In order of time.
  void add(const model::ActuatorState& axes);
  // Late or in any order, up to as long ago as a hundred actuator states.
  void add(const model::TipMeasurement& measurement);

  bool knows() const { return began_ && deepest_mm_ >= kFrom_mm && readings_ > 0; }
  // (a, b): mm along x and y of {A} for each that is inserted. Its standard deviation is the larger of the two.
  Eigen::Vector2d slope() const { return mean_.segment<2>(2); }
  double slope_sd() const;
  // Squared slope over its variance and that which is expected of insertions: chi-square of two, if all is well.
  double statistic() const;
  // Beyond what one insertion in a hundred has.
  bool is_turned() const { return knows() && statistic() > kOneInAHundred; }

 private:
  static constexpr double kOneInAHundred = 9.21;
  static constexpr std::size_t kPast = 128;
  static constexpr int kNeedles = 3;  // whose lambda1, lambda2, bending length is off by a standard deviation
  static constexpr int kUnknowns = 6 + kNeedles;
  using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
  struct Passed {
    std::int64_t utime = 0;
    double inserted_mm = 0;
    double forgotten = 0;  // of shared errors, since it began
    Eigen::Vector3d p_mm = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, 2, kNeedles> beside_mm = Eigen::Matrix<double, 2, kNeedles>::Zero();
  };
  const Passed* at(std::int64_t utime) const;

  NeedleFilter filter_;
  double expected_slope_sd_;
  FilterState nominal_;
  std::array<FilterState, kNeedles> needles_;
  bool began_ = false;
  double deepest_mm_ = 0;
  double inserted_mm_ = 0, from_mm_ = 0, rotation_rad_ = 0;
  double forgotten_ = 0;
  std::array<double, 2> forgotten_at_{};  // when cameras 0 and 1 were last used
  std::int64_t axes_utime_ = 0;
  std::array<Passed, kPast> past_{};
  std::size_t passed_ = 0;
  Unknowns mean_;
  Eigen::Matrix<double, kUnknowns, kUnknowns> covariance_;
  std::int64_t readings_ = 0;
};

}  // namespace bevel::estimator
