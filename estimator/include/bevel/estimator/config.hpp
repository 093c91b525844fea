// SPDX-License-Identifier: MIT
#pragma once
// What the estimator believes before it has seen anything, and how much it lets the model err.
#include <algorithm>
#include <cmath>
#include <vector>

#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/effects/variation.hpp>

namespace bevel::estimator {

struct Prior {
  model::NeedleParameters needle;  // means of k, lambda1, lambda2, ell; slip and front_wheel are taken as they are
  double curvature_sd_per_mm = 0.001;
  double lambda1_sd_per_rad = 0.15;
  double lambda2_sd = 0.08;
  double wheelbase_sd_mm = 0;  // 0: ell is held at its mean, nine states; above: ell is the tenth
  // A stiff shaft (stiff_shaft.cpp): the length over which it bends in the tissue, (4 EI / modulus)^(1/4), and from the
  // guide to the entry point. Above 0 the bending length is the tenth state; ell is then held, there are no effects,
  // and nothing is relinearised. Headings are not taken.
  double bending_mm = 0;
  double bending_sd_mm = 0;
  double guide_mm = 0;
  double bevel_mm = 3.5;        // length of the bevel: drawn back by this, it is out of what it cuts and pushes no more
  double position_sd_mm = 0.3;  // tip at the entry point
  double tilt_sd_rad = 0.02;    // heading about body x and y
  double roll_sd_rad = 0.05;    // bevel about the heading
  // Of the model file: by how much insertions differ, beside the widths above, which are for what is not known of all
  // of them. A filter watches one insertion and starts as wide as both together.
  model::Variation variation{};
};
// Of one insertion's own k.
inline double insertion_curvature_sd_per_mm(const Prior& prior) {
  return std::hypot(prior.curvature_sd_per_mm, prior.variation.curvature_relative * prior.needle.curvature_per_mm);
}

// Random walk per sqrt(mm) of insertion: what tissue does that the model does not. Nothing grows at rest.
struct ProcessNoise {
  double position_mm = 0.005;
  double tilt_rad = 5e-4;
  double roll_rad = 1e-3;  // per sqrt(mm) and, when turning, per sqrt(rad) of rotation
  double roll_per_sqrt_rad = 0.01;
  double curvature_per_mm = 2e-5;
  double lambda1_per_rad = 1e-3;
  double lambda2 = 5e-4;
};

// What neighbouring frames' errors have in common: of each axis of each camera's readings, `correlated_share` of the
// variance that the camera states is of an error that changes slowly (first-order Gauss-Markov, six more states), the
// rest is white. It is forgotten by 1/e over any of the three ways below; 0: not by that. Of cameras 0 and 1.
struct ReadingNoise {
  double correlated_share = 0;  // 0: all is white, the plain filter bit for bit
  double correlation_s = 0;     // of time
  double correlation_mm = 0;    // of insertion: a needle that rests shades the same pixels
  double correlation_rad = 0;   // of turning: which shows the bevel from another side
};

// Slowly known states of the rig (nuisance.hpp), standard deviations beforehand; 0 each: not a state. The past is then
// not run again, and there are no effects beside them.
struct NuisancePrior {
  double windup_sd_rad = 0;  // of the tip's lag at 100 mm inserted, which is not negative
  double latency_sd_s = 0;   // of each camera
  bool any() const { return windup_sd_rad > 0 || latency_sd_s > 0; }
};

struct Gate {
  double probability = 0.9999;  // share of good measurements that pass
  // Refused in a row, of one camera (another's good ones do not outweigh it), of all, or of headings. Unsure is slow: a
  // tenth of outliers brings it each second and it passes with the next frame. Unhealthy is a stop: of a tenth of
  // outliers one reading in a million is the sixth in a row.
  int rejects_before_unsure = 2;
  int rejects_before_unhealthy = 6;
  int rejects_before_reset = 20;  // in a row: then a declared reset
  // Covariance of the pose after a reset, at least: as far as the measurement that brought it, and what the needle can
  // have bent, are within it in any case.
  double reset_position_sd_mm = 5.0;
  double reset_tilt_sd_rad = 0.1;
};

struct HealthLimits {
  double measurement_age_s = 0.13;     // of capture: 30 Hz and 50 ms of latency pass, one lost frame too
  double measurement_silence_s = 0.1;  // since one arrived, by the steady clock: two lost frames pass, three do not
  double actuator_age_s = 0.08;
  double position_sd_mm = 3.0;  // largest standard deviation along any axis
  // Largest standard deviation of the heading about body x or y. Three of them are the 1 rad up to which the slip law
  // was validated (kDefaultGammaMax_rad): a wider heading may be outside the model, and linearisation about it fails.
  double heading_sd_rad = 1.0 / 3.0;
  // A source of measurements that was silent for so long is judged anew: its rejects in a row are forgotten. Ten times
  // measurement_silence_s, after which the node has reported the silent camera.
  double rejects_forgotten_s = 1.0;
};

/// Limits of the axes between two actuator states. An interval longer than gap_s is a gap: the path
/// of the axes within it is unknown, and is not interpolated (NeedleFilter::pass_gap).
struct AxisLimits {
  double gap_s = 0.08;                // longest interval in which motion is interpolated; 0: any
  double insertion_rate_mm_s = 20.0;  // no axis is faster
  double rotation_rate_rad_s = 12.0;
};

struct EstimatorConfig {
  Prior prior;
  ProcessNoise process;
  ReadingNoise reading;
  NuisancePrior nuisance;
  Gate gate;
  HealthLimits limits;
  AxisLimits axes;
  // What the model file says that the bicycle leaves out, with its parameters held: applied in propagation, and in the
  // measurement (offset, camera, latency). None: the plain model, bit for bit.
  std::vector<model::ActiveEffect> effects;
  // Steps that are kept of what has left the history, to run again with better derivatives (NeedleFilter::relinearise)
  // each 15 mm, or an eighth of the way so far; each time takes some 0.2 ms, more than two hundred ordinary
  // steps. 0: never.
  // With effects, whose memory cannot be walked back, always 0.
  int relinearised_steps = 2048;
  // Steps of up to 0.5 mm and 0.05 rad, all that actuators take at their rate, move the covariance by derivatives of
  // the midpoint rule, off by less than a thousandth of what the step does. False: by those of the step itself, as
  // longer ones, at 1.2 times the time. The path is the same.
  bool midpoint_derivatives = true;
  // What slopes at the entry are expected of insertions on this rig, standard deviation about each axis; one that no
  // such insertion has is said (entry_line.hpp). Repeated insertions in the literature: 0.2 to 0.7 degrees.
  double entry_slope_sd_rad = 0.009;
  // Cameras (tip_heading_t.camera) whose headings are the tangent of the shaft's end. The shaft lies where the tip has
  // passed, so that is the way the tip moves, gamma; the others' are of what the needle's tip points along, e3 of {B}.
  // Taken for one another they are wrong by alpha, more than hundreds of headings are uncertain by.
  std::vector<int> shaft_cameras;
  // Live: a needle that is drawn back, and inserted again, goes through the channel that it has cut (channel.hpp), to
  // its front, and cuts on from there. False: it cuts anew wherever it is, which drawn back is the bicycle run
  // backwards with the bevel as it stands: what the integrator of the diagnosis does, and simulated recordings made
  // elsewhere. With effects always so.
  bool through_channel = false;
  // Live: the axes count from the entry point, so the first actuator state says how deep the needle is and how it is
  // turned. False: wherever the axes stand at first is the entry, as in recordings made elsewhere.
  bool start_at_axes = false;
};

/// Bending length of the shaft where none is configured. In soft tissue it is 30 to 45 mm (steel of 1.27 mm, 20 to
/// 50 kPa), in stiff gel below a millimetre. The mean is small because the derivatives of the swing grow
/// with the bending length: from a small one the filter converges on both, from 40 mm it loses a needle that does not
/// bend (docs/steering.md). Three standard deviations above the mean lie in the softest tissue.
inline constexpr double kUnknownBending_mm = 5, kUnknownBendingSd_mm = 12;
/// Distance from the guide to the entry point where none is configured, mm.
inline constexpr double kUnknownGuide_mm = 15;

/// Sets the bending length of \p prior to that of an unknown shaft.
inline void assume_unknown_shaft(Prior& prior) {
  prior.bending_mm = kUnknownBending_mm;
  prior.bending_sd_mm = kUnknownBendingSd_mm;
  prior.guide_mm = kUnknownGuide_mm;
}

/// Returns \p config for the entry line (entry_line.hpp), which is linear in the bending length between its mean and
/// one standard deviation above: that range has to span soft tissue, or a shaft that bends there looks like a slope.
inline EstimatorConfig entry_line_config(EstimatorConfig config) {
  constexpr double kSoftTissueBending_mm = 30;  // at 50 to 100 kPa, steel of 1.27 mm
  Prior& prior = config.prior;
  if (prior.bending_mm > 0 && prior.bending_sd_mm > 0)
    prior.bending_sd_mm = std::max(prior.bending_sd_mm, kSoftTissueBending_mm - prior.bending_mm);
  return config;
}

inline bool takes_midpoint(const EstimatorConfig& config, double insertion_mm, double rotation_rad) {
  return config.midpoint_derivatives && std::abs(insertion_mm) <= 0.5 && std::abs(rotation_rad) <= 0.05;
}

}  // namespace bevel::estimator
