// SPDX-License-Identifier: MIT
#pragma once
// Where a target that moves will be: a middle that drifts and a breath about it. Along each axis, after a time t from
// now,
//   m + v t + s cos(w t) + c sin(w t),
// with one frequency w for all. The state (m, v, s, c) is linear for each w, so that for each of a grid (0.08 to 0.6
// Hz) there is a Kalman filter, whose process noise lets the coefficients change: no breath is like the one before. The
// frequencies are weighed by what each predicted, their likelihoods (a bank of filters: Magill, IEEE Trans. Automat.
// Contr. 10(4), 1965). A target at rest and one that only drifts are cases of it.
//
// Frame {A}, mm, mm/s, times in microseconds of one clock. Nothing allocates after the constructor.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace bevel::controller {

struct TargetMotion {
  double reading_sd_mm = 0.3;     // of a told position, along each axis
  double velocity_sd_mm_s = 0.5;  // of the drift, prior
  double breathing_sd_mm = 3.0;   // of s and c, prior
  double renewed_after_s = 60.0;  // by then drift and breath may be others altogether
};

class TargetTrack {
 public:
  explicit TargetTrack(const TargetMotion& motion = {});

  // Begins anew with the next position.
  void restart();
  // A position that is not newer than the one before is left out. Two in a row that no breath explains are another
  // target, with which it begins anew; one is left out.
  void observe(std::int64_t utime, const Eigen::Vector3d& position_mm);
  bool empty() const { return empty_; }
  /// Returns whether there is one position only, from which no motion is predicted.
  bool is_fixed() const { return at_rest_; }

  // By the frequencies' mean. Before the first position: zeros.
  Eigen::Vector3d position_mm(std::int64_t utime) const;
  // Of that prediction, along the axis that is known least: within each frequency and between them.
  double position_sd_mm(std::int64_t utime) const;
  double period_s() const;  // of the likeliest frequency

  // The first instant, from `from_utime` on and within one period, at which the target turns round along the direction
  // in which it breathes most: it hardly moves about then. The later turns of the same side are whole periods on.
  std::int64_t next_turn_utime(std::int64_t from_utime) const;
  // Largest distance from the middle of its breath; of the likeliest frequency.
  double breathing_mm() const;

 private:
  using Coefficients = Eigen::Matrix<double, 4, 3>;  // m, v, s, c at the newest reading; of x, y, z
  struct Breath {
    double frequency_rad_s = 0;
    Coefficients mean = Coefficients::Zero();
    Eigen::Matrix4d covariance;  // of each axis alike
    double log_weight = 0;       // the likeliest has 0
    double weight = 0;           // all together 1; 0 where it is negligible
  };
  double ahead_s(std::int64_t utime) const;
  bool is_jump(std::int64_t utime, const Eigen::Vector3d& position_mm) const;
  // What is read, m + s, after so long.
  static Eigen::Vector4d reading_after(const Breath& breath, double ahead_s);
  const Breath& likeliest() const;
  void weigh();

  TargetMotion motion_;
  std::vector<Breath> breaths_;  // sized once
  std::int64_t newest_utime_ = 0;
  Eigen::Vector3d origin_mm_ = Eigen::Vector3d::Zero();  // the first position
  bool empty_ = true;
  bool at_rest_ = true;  // as far as is known: of one reading, every coefficient is zero
  bool jumped_before_ = false;
};

}  // namespace bevel::controller
