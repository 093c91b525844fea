// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Line of insertion in the first centimetres, and a test for a rotated camera frame or guide.
#include <array>
#include <cstdint>

#include <bevel/estimator/needle_filter.hpp>

namespace bevel::estimator {

/// Estimates the line of insertion in {A} of the measurements, and tests its slope.
///
/// A slope outside the range expected of insertions on this rig means that the camera's frame, or the guide, is
/// rotated. The test does not distinguish the two. A target measured by the same cameras is still reached; a target
/// given in the guide's frame is missed by the slope times the depth.
///
/// The method is recursive weighted least squares of the difference between the measurements and the path p(t) of the
/// prior's mean needle for the reported axes:
///
///     x, y of the measurement - p  =  (x0, y0) + (a, b) z + c p_xy + r (-p_y, p_x) + sum of l_i dp_xy / dl_i
///
/// with the entry point (x0, y0), the slope (a, b), the relative error c of the bend, the roll r of the bevel, and the
/// errors l_i of lambda1, lambda2 and a stiff shaft's bending length in their standard deviations. Slip is confounded
/// with a slope until the needle is rotated. The priors of slope and bend are wide, the others are those of the filter.
/// Measurements along z contain no slope and are not used. Autocorrelated errors of a camera (ReadingNoise) reduce the
/// information of each measurement by NeedleFilter::worth, so that many of them count by their effective sample size.
/// Nothing is allocated.
class EntryLine {
 public:
  static constexpr double kFrom_mm = 10,  ///< insertion from which there is a result, mm
      kTo_mm = 30;                        ///< insertion up to which measurements are used, mm

  /// Constructs the estimate; restart() is called.
  /// @param config configuration of the filter (entry_line_config())
  explicit EntryLine(const EstimatorConfig& config);

  /// Discards the estimate; the next actuator state is at the entry point.
  void restart();
  /// Adds an actuator state. With EstimatorConfig::start_at_axes, states deeper than 1 mm before the entry are ignored.
  /// @param axes positions of the axes, mm and rad; in order of time
  void add(const model::ActuatorState& axes);
  /// Adds a position. It is ignored if its status is not 0, if it is older than the newest 128 actuator states, or if
  /// it was taken deeper than kTo_mm. A component beyond 5 standard deviations is ignored as an outlier.
  /// @param measurement tip position in {A}, mm; in any order of time
  void add(const model::TipMeasurement& measurement);

  /// Returns whether there is a result.
  /// @return true if the insertion has reached kFrom_mm and a measurement was used
  bool knows() const { return began_ && deepest_mm_ >= kFrom_mm && readings_ > 0; }
  /// Returns the slope (a, b) of the line.
  /// @return slope along x and y of {A}, mm per mm of depth
  Eigen::Vector2d slope() const { return mean_.segment<2>(2); }
  /// Computes the standard deviation of the slope.
  /// @return the larger of the two axes, mm per mm
  double slope_sd() const;
  /// Computes the test statistic: squared slope over the sum of its variance and that expected of insertions
  /// (EstimatorConfig::entry_slope_sd_rad).
  /// @return chi-square with two degrees of freedom if neither frame nor guide is rotated
  double statistic() const;
  /// Tests the slope at a significance of 0.01.
  /// @return true if there is a result and the statistic exceeds the quantile
  bool is_turned() const { return knows() && statistic() > kOneInAHundred; }

 private:
  static constexpr double kOneInAHundred = 9.21;
  static constexpr std::size_t kPast = 128;
  static constexpr int kNeedles = 3;  // with lambda1, lambda2 or bending length one standard deviation above the mean
  static constexpr int kUnknowns = 6 + kNeedles;
  using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
  struct Passed {
    std::int64_t utime = 0;
    double inserted_mm = 0;
    double forgotten = 0;  // decay of the shared errors since the start
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
  std::array<double, 2> forgotten_at_{};  // at the newest measurements of cameras 0 and 1
  std::int64_t axes_utime_ = 0;
  std::array<Passed, kPast> past_{};
  std::size_t passed_ = 0;
  Unknowns mean_;
  Eigen::Matrix<double, kUnknowns, kUnknowns> covariance_;
  std::int64_t readings_ = 0;
};

}  // namespace bevel::estimator
