// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Configuration of the estimator: prior, noise, gate, health limits and effects.
#include <algorithm>
#include <cmath>
#include <vector>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/effects/variation.hpp>

/// Estimation of the needle: extended Kalman filter, history, health and entry line.
namespace bevel::estimator {

/// Mean and standard deviations of the state at the entry point.
struct Prior {
  model::NeedleParameters needle;      ///< means of k, lambda1, lambda2 and ell; slip and front_wheel are not estimated
  double curvature_sd_per_mm = 0.001;  ///< standard deviation of k, 1/mm
  double lambda1_sd_per_rad = 0.15;    ///< standard deviation of lambda1, 1/rad
  double lambda2_sd = 0.08;            ///< standard deviation of lambda2
  /// Standard deviation of ell, mm. 0: ell is fixed at its mean and there are nine states; above 0: ell is the tenth.
  double wheelbase_sd_mm = 0;
  /// Mean bending length of a stiff shaft in tissue, mm: (4 EI / modulus)^(1/4) (stiff_shaft.cpp). 0: the shaft is not
  /// stiff. Above 0 the bending length is the tenth state, ell is fixed, effects and relinearisation are not supported,
  /// and headings are ignored.
  double bending_mm = 0;
  double bending_sd_mm = 0;     ///< standard deviation of the bending length, mm
  double guide_mm = 0;          ///< distance from the guide to the entry point, mm
  double bevel_mm = 3.5;        ///< length of the bevel, mm; retracted by this, the bevel exerts no force
  double position_sd_mm = 0.3;  ///< standard deviation of the tip at the entry point, along each axis, mm
  double tilt_sd_rad = 0.02;    ///< standard deviation of the heading about body x and y, each, rad
  double roll_sd_rad = 0.05;    ///< standard deviation of the bevel's roll about the heading, rad
  /// Between-insertion standard deviations of the model file. They add in quadrature to the standard deviations above,
  /// which describe what is unknown of all insertions: the filter observes one insertion and starts with both.
  model::Variation variation{};
};

/// Computes the standard deviation of the k of one insertion: that of the mean and that between insertions.
/// @param prior prior of the needle
/// @return standard deviation, 1/mm
inline double insertion_curvature_sd_per_mm(const Prior& prior) {
  return std::hypot(prior.curvature_sd_per_mm, prior.variation.curvature_relative * prior.needle.curvature_per_mm);
}

/// Random walk of the state per square root of the insertion, for uneven tissue. A stationary needle has none.
struct ProcessNoise {
  double position_mm = 0.005;       ///< along each axis, mm per sqrt(mm) of insertion
  double tilt_rad = 5e-4;           ///< about body x and y, rad per sqrt(mm) of insertion
  double roll_rad = 1e-3;           ///< about the heading, rad per sqrt(mm) of insertion
  double roll_per_sqrt_rad = 0.01;  ///< about the heading, rad per sqrt(rad) of rotation; adds to roll_rad
  double curvature_per_mm = 2e-5;   ///< of k, 1/mm per sqrt(mm) of insertion; none if the prior fixes k
  double lambda1_per_rad = 1e-3;    ///< of lambda1, 1/rad per sqrt(mm) of insertion; none if the prior fixes it
  double lambda2 = 5e-4;            ///< of lambda2, 1 per sqrt(mm) of insertion; none if the prior fixes it
};

/// Autocorrelation of the measurement errors of cameras 0 and 1.
///
/// Along each axis of each camera, a share of the variance that the camera reports belongs to a first-order
/// Gauss-Markov error (six more states), and the rest is white. The error decays by 1/e over any of the three lengths
/// below; a length of 0 disables that kind of decay.
struct ReadingNoise {
  double correlated_share = 0;  ///< share of the variance, in [0, 1]; 0: white noise, identical to the plain filter
  double correlation_s = 0;     ///< correlation time, s
  double correlation_mm = 0;    ///< correlation length of insertion, mm: a stationary needle shades the same pixels
  double correlation_rad = 0;   ///< correlation angle of rotation, rad: rotation shows another side of the bevel
};

/// Prior standard deviations of the nuisance states (nuisance.hpp). 0: not estimated. With any of them, the past is not
/// relinearised and effects are not supported.
struct NuisancePrior {
  double windup_sd_rad = 0;  ///< of the tip's rotational lag at 100 mm of insertion, rad; the lag is not negative
  double latency_sd_s = 0;   ///< of the latency of each camera, s
  /// Returns whether any nuisance state is estimated.
  /// @return true if one of the standard deviations is above 0
  bool any() const { return windup_sd_rad > 0 || latency_sd_s > 0; }
};

/// Outlier rejection and declared resets.
struct Gate {
  double probability = 0.9999;  ///< share of correct measurements that pass
  /// Measurements rejected in a row, of one camera or of headings, from which the estimate is unsure (kUnsure): the
  /// needle slows down. With a tenth of outliers this happens each second and ends with the next frame.
  int rejects_before_unsure = 2;
  /// Measurements rejected in a row, of one camera, of all cameras or of headings, from which the estimate is unhealthy
  /// (kRejecting): the needle stops. With a tenth of outliers one measurement in a million is the sixth in a row.
  int rejects_before_unhealthy = 6;
  int rejects_before_reset = 20;  ///< positions rejected in a row, of all cameras, that cause a declared reset
  /// Smallest standard deviation of the position after a reset, mm. It is increased to the innovation that caused the
  /// reset, and by the bend that the needle can have.
  double reset_position_sd_mm = 5.0;
  double reset_tilt_sd_rad = 0.1;  ///< smallest standard deviation of each rotation after a reset, rad
};

/// Limits of the health word (health.hpp).
struct HealthLimits {
  /// Largest age of the newest measurement by its capture time, s: allows 30 Hz, 50 ms of latency and one lost frame.
  double measurement_age_s = 0.13;
  /// Largest time without a measurement by the monotonic clock, s: allows two lost frames of 30 Hz, not three.
  double measurement_silence_s = 0.1;
  double actuator_age_s = 0.08;  ///< largest age of the newest actuator state, s
  double position_sd_mm = 3.0;   ///< largest standard deviation of the position along any axis, mm
  /// Largest standard deviation of the heading about body x or y, rad. Three of them are the 1 rad up to which the slip
  /// law was validated (kDefaultGammaMax_rad). With a larger one the heading may be outside the model, and the
  /// linearisation fails.
  double heading_sd_rad = 1.0 / 3.0;
  /// Time without a measurement, s, after which the rejections in a row of that source no longer count. Ten times
  /// measurement_silence_s, after which the node reports the camera as silent.
  double rejects_forgotten_s = 1.0;
};

/// Limits of the axes between two actuator states. An interval longer than gap_s is a gap: the path
/// of the axes within it is unknown, and is not interpolated (NeedleFilter::pass_gap).
struct AxisLimits {
  double gap_s = 0.08;                ///< longest interval in which motion is interpolated, s; 0: no limit
  double insertion_rate_mm_s = 20.0;  ///< largest insertion rate, mm/s
  double rotation_rate_rad_s = 12.0;  ///< largest rotation rate, rad/s
};

/// Configuration of NeedleFilter and NeedleEstimator.
struct EstimatorConfig {
  Prior prior;             ///< state at the entry point
  ProcessNoise process;    ///< random walk of the state
  ReadingNoise reading;    ///< autocorrelation of the measurement errors
  NuisancePrior nuisance;  ///< nuisance states
  Gate gate;               ///< outlier rejection and resets
  HealthLimits limits;     ///< limits of the health word
  AxisLimits axes;         ///< limits of the axes
  /// Effects of the model file, with fixed parameters. They apply to the propagation and to the measurement (offset,
  /// camera, latency). Empty: the plain model, identical bit for bit.
  std::vector<model::ActiveEffect> effects;
  /// Number of past steps kept for NeedleFilter::relinearise, which runs each 15 mm or each eighth of the path,
  /// whichever is longer. One run takes about 0.2 ms, the time of more than 200 ordinary steps. 0: never. The number is
  /// 0 with effects, whose memory cannot be reversed, with a stiff shaft and with nuisance states.
  int relinearised_steps = 2048;
  /// Whether steps of up to 0.5 mm and 0.05 rad, which are all steps of the actuators at their rate, propagate the
  /// covariance by derivatives of the midpoint rule. Their error is below a thousandth of the step's change. False: by
  /// the exact derivatives, as for longer steps, at 1.2 times the time. The mean is the same.
  bool midpoint_derivatives = true;
  /// Expected standard deviation of the slope at the entry on this rig, about each axis, rad. A slope that such
  /// insertions do not have is reported (entry_line.hpp). Repeated insertions in the literature: 0.2 to 0.7 degrees.
  double entry_slope_sd_rad = 0.009;
  /// Cameras (tip_heading_t.camera) whose headings are the tangent of the shaft's end. The shaft follows the path of
  /// the tip, so the tangent is the direction in which the tip moves, gamma; headings of the other cameras are e3 of
  /// {B}. The two differ by alpha, which exceeds the uncertainty of hundreds of headings.
  std::vector<int> shaft_cameras;
  /// Whether a needle that is retracted and inserted again follows the channel that it has cut (channel.hpp) to its end
  /// and cuts from there; set on a rig. False: it cuts anew wherever it is, and a retraction is the bicycle run
  /// backwards with the present bevel angle, as in the integrator of the diagnosis and in imported simulated
  /// recordings. With effects it is always false.
  bool through_channel = false;
  /// Whether the axes count from the entry point, so that the first actuator state gives depth and rotation; set on a
  /// rig. False: the first position of the axes is the entry, as in imported recordings.
  bool start_at_axes = false;
};

/// Mean and standard deviation of the bending length of an unknown shaft, mm.
///
/// In soft tissue the bending length is 30 to 45 mm (steel of 1.27 mm, 20 to 50 kPa), in stiff gel below a millimetre.
/// The mean is small because the derivatives of the swing grow with the bending length: from a small mean the filter
/// converges in both, from 40 mm it diverges for a needle that does not bend (docs/steering.md). The mean plus three
/// standard deviations is the bending length in the softest tissue.
inline constexpr double kUnknownBending_mm = 5,  ///< mean bending length of an unknown shaft, mm
    kUnknownBendingSd_mm = 12;                   ///< standard deviation of the bending length of an unknown shaft, mm
/// Distance from the guide to the entry point if none is configured, mm.
inline constexpr double kUnknownGuide_mm = 15;

/// Sets bending length and guide distance of a prior to those of an unknown shaft.
/// @param prior prior to change
inline void assume_unknown_shaft(Prior& prior) {
  prior.bending_mm = kUnknownBending_mm;
  prior.bending_sd_mm = kUnknownBendingSd_mm;
  prior.guide_mm = kUnknownGuide_mm;
}

/// Adapts a configuration to the entry line (entry_line.hpp), which is linear in the bending length between its mean
/// and one standard deviation above. That range has to include soft tissue, or a shaft that bends there is mistaken for
/// a slope.
/// @param config configuration of the filter
/// @return the configuration, with a bending length whose mean plus standard deviation is at least 30 mm if it is
///     estimated
inline EstimatorConfig entry_line_config(EstimatorConfig config) {
  constexpr double kSoftTissueBending_mm = 30;  // at 50 to 100 kPa, steel of 1.27 mm
  Prior& prior = config.prior;
  if (prior.bending_mm > 0 && prior.bending_sd_mm > 0)
    prior.bending_sd_mm = std::max(prior.bending_sd_mm, kSoftTissueBending_mm - prior.bending_mm);
  return config;
}

/// Returns whether the covariance of a step is propagated by derivatives of the midpoint rule.
/// @param config configuration of the filter
/// @param insertion_mm increment of the insertion, mm
/// @param rotation_rad increment of the rotation, rad
/// @return true if EstimatorConfig::midpoint_derivatives is set and the step is at most 0.5 mm and 0.05 rad
inline bool takes_midpoint(const EstimatorConfig& config, double insertion_mm, double rotation_rad) {
  return config.midpoint_derivatives && std::abs(insertion_mm) <= 0.5 && std::abs(rotation_rad) <= 0.05;
}

}  // namespace bevel::estimator
