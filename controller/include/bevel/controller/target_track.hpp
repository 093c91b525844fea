// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Prediction of a target with drift and respiratory motion.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace bevel::controller {

/// Prior and noise of the target's motion.
struct TargetMotion {
  double reading_sd_mm = 0.3;     ///< standard deviation of a commanded position along each axis, mm
  double velocity_sd_mm_s = 0.5;  ///< prior standard deviation of the drift along each axis, mm/s
  double breathing_sd_mm = 3.0;   ///< prior standard deviation of the amplitudes s and c along each axis, mm
  double renewed_after_s = 60.0;  ///< time after which drift and amplitudes have changed by their prior, s
};

/// Predicts the position of a target: a mean position with drift, and a respiratory motion. Along each axis, at the
/// time t after the newest position,
///
///     m + v t + s cos(w t) + c sin(w t),
///
/// with one frequency w for all axes. The state (m, v, s, c) is linear for each w. There is one Kalman filter for each
/// frequency of a grid (0.08 to 0.6 Hz), with process noise for the change of the coefficients. The filters are
/// weighted by their likelihoods (bank of filters: Magill, IEEE Trans. Automat. Contr. 10(4), 1965). A stationary
/// target and one that only drifts are special cases. All time stamps have the same clock. Nothing is allocated after
/// construction.
class TargetTrack {
 public:
  /// Constructs the prediction without positions.
  /// @param motion prior and noise; copied
  explicit TargetTrack(const TargetMotion& motion = {});

  /// Removes all positions.
  void restart();
  /// Adds a position. A position that is not newer than the previous one is ignored. A position that the motion does
  /// not explain is ignored once; a second one in a row is a new target, with which the prediction restarts.
  /// @param utime time of the position, us
  /// @param position_mm position of the target, {A}, mm
  void observe(std::int64_t utime, const Eigen::Vector3d& position_mm);
  /// Returns whether there is no position.
  /// @return true before the first position
  bool empty() const { return empty_; }
  /// Returns whether no motion is predicted.
  /// @return true with at most one position
  bool is_fixed() const { return at_rest_; }

  /// Predicts the position: the weighted mean over the frequencies.
  /// @param utime time of the prediction, us
  /// @return position, {A}, mm; zero before the first position
  Eigen::Vector3d position_mm(std::int64_t utime) const;
  /// Computes the standard deviation of the prediction, within and between the frequencies.
  /// @param utime time of the prediction, us
  /// @return standard deviation along the least certain axis, mm; 0 before the first position
  double position_sd_mm(std::int64_t utime) const;
  /// Returns the period of the respiratory motion.
  /// @return period of the most likely frequency, s
  double period_s() const;

  /// Computes the next turning point of the respiratory motion along the direction of its largest amplitude. Later
  /// turning points of the same side follow after whole periods.
  /// @param from_utime earliest time, us
  /// @return time of the turning point, us; \p from_utime before the first position
  std::int64_t next_turn_utime(std::int64_t from_utime) const;
  /// Computes the amplitude of the respiratory motion for the most likely frequency.
  /// @return largest distance from the mean position, mm
  double breathing_mm() const;

 private:
  using Coefficients = Eigen::Matrix<double, 4, 3>;  // m, v, s, c at the newest reading; of x, y, z
  struct Breath {
    double frequency_rad_s = 0;
    Coefficients mean = Coefficients::Zero();
    Eigen::Matrix4d covariance;  // identical for each axis
    double log_weight = 0;       // 0 for the most likely
    double weight = 0;           // the sum is 1; 0 if negligible
  };
  double ahead_s(std::int64_t utime) const;
  bool is_jump(std::int64_t utime, const Eigen::Vector3d& position_mm) const;
  // Row that maps the coefficients to the position after ahead_s.
  static Eigen::Vector4d reading_after(const Breath& breath, double ahead_s);
  const Breath& likeliest() const;
  void weigh();

  TargetMotion motion_;
  std::vector<Breath> breaths_;  // sized once
  std::int64_t newest_utime_ = 0;
  Eigen::Vector3d origin_mm_ = Eigen::Vector3d::Zero();  // the first position
  bool empty_ = true;
  bool at_rest_ = true;  // at most one position: every coefficient is zero
  bool jumped_before_ = false;
};

}  // namespace bevel::controller
