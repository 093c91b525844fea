// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Extended Kalman filter of the needle: pose on SE(3), curvature and slip parameters, driven by actuator increments.
///
/// The model is bevel/model/kinematics.hpp, (10) with the slip of (25). Measurements are the tip position in {A} and
/// the heading in {A}, each with an information matrix of any rank. The filter reads no clock and allocates nothing;
/// its matrices have a fixed size. The covariance update has the Joseph form, is symmetrised, and its diagonal has a
/// lower bound.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include <bevel/estimator/channel.hpp>
#include <bevel/estimator/config.hpp>
#include <bevel/estimator/end_motion.hpp>
#include <bevel/estimator/health.hpp>
#include <bevel/estimator/nuisance.hpp>
#include <bevel/model/kinematics.hpp>
#include <bevel/model/samples.hpp>

namespace bevel::estimator {

/// Error of a FilterState with nine states: position (3, mm) and rotation (3, rad) of the pose in the body frame {B},
/// k (1/mm), lambda1 (1/rad), lambda2 (1).
using Vector9d = Eigen::Matrix<double, 9, 1>;
/// Covariance of a Vector9d, in products of its units.
using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// Actuator positions and memory of the effects of the model file. Unused if there are no effects.
///
/// The state holds values only: derivatives of an effect's memory by the estimate are neglected.
struct EffectState {
  model::BaseMotion entry,      ///< time, s, and actuator positions, mm and rad, at the entry
      base;                     ///< the same at the newest step
  double tip_insertion_mm = 0,  ///< insertion of the tip, mm, after the effects between actuators and tip
      tip_rotation_rad = 0;     ///< rotation of the tip, rad, after the effects between actuators and tip
  /// EffectMemory::slot of each effect, without its derivatives; the unit depends on the effect.
  std::array<std::array<double, model::EffectMemory::kSlots>, model::kMaxEffects> slot{};
  /// EffectMemory::number of each effect; the unit depends on the effect.
  std::array<std::array<double, model::EffectMemory::kNumbers>, model::kMaxEffects> number{};
  std::array<int, model::kMaxEffects> phase{};  ///< EffectMemory::phase of each effect
  model::BaseHistory history;                   ///< recent actuator motion
};

/// Number of SharedErrors: three along the axes of {A} for camera 0, three for camera 1.
inline constexpr int kSharedErrors = 6;

/// Autocorrelated measurement errors of the cameras (ReadingNoise), normalised to unit variance. Unused if the
/// measurement noise is white.
struct SharedErrors {
  /// Mean, in standard deviations.
  Eigen::Matrix<double, kSharedErrors, 1> mean = Eigen::Matrix<double, kSharedErrors, 1>::Zero();
  /// Covariance of the ten errors of the state (rows) with the shared errors (columns).
  Eigen::Matrix<double, 10, kSharedErrors> with_state = Eigen::Matrix<double, 10, kSharedErrors>::Zero();
  /// Covariance of the shared errors; identity before the first measurement.
  Eigen::Matrix<double, kSharedErrors, kSharedErrors> covariance =
      Eigen::Matrix<double, kSharedErrors, kSharedErrors>::Identity();
};

/// Estimate of the filter at one time: mean, covariance and bookkeeping of the gate. A plain value; a copy is complete.
///
/// There are nine error states, in the order of Vector9d. A tenth is ell, if Prior::wheelbase_sd_mm is above 0, or the
/// bending length of a stiff shaft, if Prior::bending_mm is above 0.
struct FilterState {
  model::Pose pose;             ///< pose of {B} in {A}, mm; without the bend at the end of a stiff shaft (tip_pose())
  double curvature_per_mm = 0;  ///< k, 1/mm
  double lambda1_per_rad = 0;   ///< lambda1, 1/rad
  double lambda2 = 0;           ///< lambda2
  double wheelbase_mm = 0;      ///< ell, mm
  double bending_mm = 0;        ///< bending length of a stiff shaft, mm; 0: the shaft is not stiff
  Matrix9d covariance = Matrix9d::Zero();  ///< of the nine error states
  /// Covariance of the tenth error state, mm, with the nine; zero if there are nine states.
  Vector9d tenth_covariance = Vector9d::Zero();
  double tenth_variance = 0;           ///< variance of the tenth error state, mm^2
  std::int64_t measurement_utime = 0;  ///< time of the newest accepted position, us; 0: none since start or reset
  std::int64_t reading_utime = 0;      ///< time of the newest position with information, accepted or not, us
  std::int32_t rejects_in_row = 0;     ///< positions rejected in a row, of all cameras together
  /// Positions rejected in a row of cameras 0 to 3; cameras with a higher number share the last entry.
  std::array<std::uint8_t, 4> camera_rejects_in_row{};
  std::int32_t heading_rejects_in_row = 0;     ///< headings rejected in a row, of all cameras; they cause no reset
  std::array<std::int64_t, 4> camera_utime{};  ///< time of the newest position of each camera, accepted or not, us
  std::int64_t heading_utime = 0;              ///< time of the newest heading of any camera, accepted or not, us
  std::int32_t reset_count = 0;                ///< declared resets since the start
  ResetCause reset_cause = ResetCause::none;   ///< cause of the newest reset
  std::int64_t reset_utime = 0;                ///< time of the newest reset, us
  bool turned_over = false;    ///< a reset has rotated the bevel by 180 degrees; this happens at most once
  bool outside_model = false;  ///< the last step left the domain of the slip law (25); the pose did not move
  Channel channel;             ///< channel that the tip has cut; used with EstimatorConfig::through_channel
  EffectState effects;         ///< memory of the effects; used with EstimatorConfig::effects
  SharedErrors shared;         ///< autocorrelated camera errors; used with ReadingNoise::correlated_share
  Nuisance nuisance;           ///< nuisance states; used with NuisancePrior
};

/// Result of one measurement update.
struct Update {
  bool accepted = false;    ///< the measurement passed the gate and was applied
  bool reset = false;       ///< the measurement caused a declared reset
  int rank = 0;             ///< number of axes with information; 0: the measurement was ignored
  double mahalanobis2 = 0;  ///< d^2 = innovation^T S^-1 innovation
  double test_ratio = 0;    ///< d^2 divided by the gate of its rank; accepted up to 1
  /// Innovation along the observed axes in the first `rank` entries; mm for a position, rad for a heading.
  Eigen::Vector3d innovation = Eigen::Vector3d::Zero();
  /// L^-1 innovation with S = L L^T, in the first `rank` entries; unit variance for a consistent filter.
  Eigen::Vector3d innovation_whitened = Eigen::Vector3d::Zero();
};

/// Measurements of a direction over a stretch of the past, as one linear measurement of that direction: its
/// contribution to the normal equations is information_per_rad2 (seen - direction).
struct DirectionReading {
  bool measured = false;                           ///< there is a measurement, and the gate accepted it
  Eigen::Vector3d seen = Eigen::Vector3d::Zero();  ///< measured direction in {A}; not normalised
  /// Direction at the time of measurement minus the direction at the end of the step, in {B} at the end of the step.
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information_per_rad2 = Eigen::Matrix3d::Zero();  ///< information in {A}; singular along the direction
};

/// One step of the past for NeedleFilter::relinearise(): actuator increments since the previous step, then at most one
/// position, one heading and one direction of motion. The position is that of a point fixed in the body.
struct PastStep {
  double insertion_mm = 0;                                ///< increment of the insertion, mm
  double rotation_rad = 0;                                ///< increment of the rotation, rad
  bool measured = false;                                  ///< there is a position, and the gate accepted it
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  ///< measured position in {A}, mm
  /// Tip at the time of measurement, mm, in {B} at the end of the step.
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information_per_mm2 = Eigen::Matrix3d::Zero();  ///< information of the position in {A}
  DirectionReading heading{};                                     ///< measurement of the heading, e3 of {B}
  DirectionReading motion{};                                      ///< measurement of the tip's direction of motion

  /// Returns whether the step ends in a measurement of any kind.
  /// @return true if there is a position, a heading or a direction of motion
  bool has_reading() const { return measured || heading.measured || motion.measured; }
};

/// Work space of NeedleFilter::relinearise() for one step, filled on the backward pass over the path.
struct WalkedStep {
  model::NeedleJacobian backwards;      ///< derivatives of the inverse of the step
  Eigen::Matrix3d R;                    ///< rotation of the pose after the step, {B} to {A}
  Eigen::Vector3d residual_mm;          ///< measured position minus the point's position on the path, {A}
  Eigen::Vector3d residual_rad;         ///< measured heading minus heading on the path, {A}
  Eigen::Vector3d motion_residual_rad;  ///< measured direction of motion minus that on the path, {A}
};

/// Predicted direction, either the heading or the direction of motion as the cameras observe it, with its derivatives.
struct SeenHeading {
  Eigen::Vector3d along;                 ///< unit vector in {A}
  Eigen::Matrix<double, 3, 6> by_error;  ///< derivative by the error of the pose in the body frame (mm | rad)
  Eigen::Matrix<double, 3, 2> by_slip = Eigen::Matrix<double, 3, 2>::Zero();  ///< derivative by lambda1 and lambda2
};

template <int kSize>
struct LinearFilter;  // relinearise.cpp

/// Predicts and updates a FilterState. The filter itself holds the configuration only.
///
/// One instance serves one thread: with effects, const functions write to a shared work space.
class NeedleFilter {
 public:
  /// Constructs the filter for a configuration.
  /// @param config prior, noise, gate and effects; copied
  explicit NeedleFilter(const EstimatorConfig& config);

  /// Computes the prior at the entry point: heading along z_A except for the effects, bevel as in the model file.
  /// @param insertion_mm actuator insertion at the entry, mm; used with effects only
  /// @param rotation_rad actuator rotation at the entry, rad; used with effects only
  /// @return state with the prior's mean and covariance
  FilterState initial(double insertion_mm = 0, double rotation_rad = 0) const;

  /// Computes the prior of a needle that was inserted before the estimate begins: straight, with the depth and the
  /// rotation of the axes, and a covariance that covers the bend it can have. Up to 1 mm deep it is initial(), rotated.
  /// @param insertion_mm insertion of the axis, mm; 0 is the entry point
  /// @param rotation_rad rotation of the axis, rad
  /// @return state with the mean and covariance at that depth
  FilterState inserted(double insertion_mm, double rotation_rad) const;

  /// Moves mean and covariance by increments of the two axes.
  ///
  /// With EstimatorConfig::through_channel the tip follows the channel where one is cut (filter_channel.cpp), and cuts
  /// new tissue beyond. Outside the domain of the slip law (25) the pose stays and FilterState::outside_model is set.
  /// @param state state before and after the step
  /// @param insertion_mm increment of the insertion, mm
  /// @param rotation_rad increment of the rotation, rad
  /// @param duration_s length of the step, s; used by effects, autocorrelated noise and the latency states
  void predict(FilterState& state, double insertion_mm, double rotation_rad, double duration_s = 0) const;

  /// Moves the state across a gap, an interval in which the axes were not observed. A declared reset.
  ///
  /// The path of the axes is known only by the rates that no axis exceeds (AxisLimits). The mean goes straight, and the
  /// covariance covers every path within those rates (derivation in filter_gap.cpp). With effects the mean is that of
  /// predict().
  /// @param state state before and after the gap
  /// @param insertion_mm net insertion within the gap, mm
  /// @param rotation_rad net rotation within the gap, rad
  /// @param duration_s length of the gap, s
  /// @param utime time of its end, us
  void pass_gap(FilterState& state, double insertion_mm, double rotation_rad, double duration_s,
                std::int64_t utime) const;

  /// Moves the mean as predict() does, without the covariance. With effects it is predict(), covariance included.
  /// @param state state before and after the step
  /// @param insertion_mm increment of the insertion, mm
  /// @param rotation_rad increment of the rotation, rad
  /// @param duration_s length of the step, s; used with effects only
  void predict_mean(FilterState& state, double insertion_mm, double rotation_rad, double duration_s = 0) const;

  /// Moves mean and covariance as predict() does, without effects and without the channel: the tip cuts in both
  /// directions.
  /// @param state state before and after the step
  /// @param insertion_mm increment of the insertion, mm
  /// @param rotation_rad increment of the rotation, rad
  void predict_cutting(FilterState& state, double insertion_mm, double rotation_rad) const;

  /// Computes the pose of the tip and of the shaft's end: FilterState::pose, corrected for effects or a stiff shaft.
  /// @param state estimate
  /// @return pose in {A}, mm
  model::Pose tip_pose(const FilterState& state) const;

  /// Computes the tip position as the cameras observe it, with the effects on the measurement.
  /// @param state estimate
  /// @return position in {A}, mm, shape (3)
  Eigen::Vector3d seen_position_mm(const FilterState& state) const;

  /// Computes the heading e3 as the cameras observe it, with the effects on the measurement.
  /// @param state estimate
  /// @return unit vector in {A} with its derivatives
  SeenHeading seen_heading(const FilterState& state) const;

  /// Computes the direction in which the tip moves as the cameras observe it (bevel/model/motion_direction.hpp).
  /// @param state estimate
  /// @return unit vector in {A} with its derivatives; empty outside the domain of the slip law (25)
  std::optional<SeenHeading> seen_motion(const FilterState& state) const;

  /// Returns whether a camera's headings are tangents of the shaft, and so directions of motion.
  /// @param camera number of the camera
  /// @return true if EstimatorConfig::shaft_cameras contains \p camera
  bool is_of_shaft(std::int32_t camera) const;

  /// Computes the direction in which the tip moves.
  /// @param state estimate
  /// @return unit vector in {A}; zero if EstimatorConfig::shaft_cameras is empty or outside the slip law's domain
  Eigen::Vector3d motion_of(const FilterState& state) const;

  /// Computes the latency of the camera time stamps by the effects of the model file.
  /// @return latency, us; 0 without effects
  std::int64_t latency_us() const;

  /// Computes the decay of a camera's autocorrelated error over a motion: exp(-x) of its correlation is left, where x
  /// is the return value.
  /// @param insertion_mm insertion since the earlier time, mm
  /// @param rotation_rad rotation since the earlier time, rad
  /// @param duration_s time since the earlier time, s
  /// @return sum of the three motions' magnitudes, each over its length in ReadingNoise; a length of 0 adds nothing
  double forgotten(double insertion_mm, double rotation_rad, double duration_s) const;

  /// Computes the information of a measurement with autocorrelated noise as a share of that of a white one. For a long
  /// series of measurements of a constant, the sum of the shares is exact.
  /// @param forgotten_since forgotten() since the previous measurement of the same camera
  /// @return share in [0, 1]; 1 if the noise is white
  double worth(double forgotten_since) const;

  /// Linearises a heading about a state, without effects, for relinearise().
  /// @param measurement heading in {A}; of e3, or of the direction of motion for a camera of the shaft
  /// @param state state about which it is linearised
  /// @return linear measurement; `measured` is false if motion_of() gives no direction
  DirectionReading made_linear(const model::TipHeading& measurement, const FilterState& state) const;

  /// Applies one position measurement.
  ///
  /// After Gate::rejects_before_reset rejected measurements in a row, or if the measurement moves the curvature to the
  /// other sign, the state is reset (FilterState::reset_cause) and the measurement applied to the reset state. If the
  /// state is little known, the information is applied in parts (Zanetti 2012, IEEE TAC 57(2)).
  /// @param state state before and after the update
  /// @param measurement tip position in {A}; precondition: status 0 and finite values, which the checked decode ensures
  /// @return outcome of the gate; rank 0 and no change if the measurement has no information
  Update update(FilterState& state, const model::TipMeasurement& measurement) const;

  /// Applies one heading measurement: one or two angles across the measured direction (filter_heading.cpp).
  ///
  /// The gate is that of the rank. Headings have their own count of rejections and cause no reset, so that a sensor
  /// with a wrong orientation does not discard the position measurements. A heading at 90 degrees or more to the
  /// predicted one is rejected whatever its information is.
  /// @param state state before and after the update
  /// @param measurement heading in {A}; precondition: status 0 and finite values
  /// @return outcome of the gate; rank 0 and no change if it has no information, the shaft is stiff, or the direction
  ///     of motion is outside the slip law's domain
  Update update(FilterState& state, const model::TipHeading& measurement) const;

  /// Recomputes the estimate from the past with new derivatives.
  ///
  /// An extended filter keeps the derivatives taken while k and lambda were little known, and becomes overconfident.
  /// If the data do not separate k from lambda, the posterior is a curved ridge. The past is therefore filtered again
  /// at three places along the least known direction (nine with ell, along two directions), with all derivatives on the
  /// path to that place: an iterated Kalman filter over a window (cf. Bell and Cathey 1993, IEEE TAC 38(2)) of the
  /// other states. The results are combined by Gauss-Hermite quadrature, weighted by the evidence of the measurements.
  /// Effects, a stiff shaft and nuisance states are not supported.
  /// @param state estimate after the last step; replaced by the result
  /// @param start state before the first step
  /// @param steps the steps since \p start
  /// @param walked work space; precondition: at least as many entries as \p steps
  /// @return false, and \p state unchanged, if \p walked is too short, the path leaves the model's domain, or the new
  ///     path does not fit the measurements better
  bool relinearise(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                   std::span<WalkedStep> walked) const;

  /// Returns the configuration.
  /// @return configuration given to the constructor
  const EstimatorConfig& config() const { return config_; }

 private:
  // kSize: 9, or 10 with ell.
  template <int kSize>
  void predict_plain(FilterState& state, double insertion_mm, double rotation_rad) const;
  bool mean_cutting(FilterState& state, double insertion_mm, double rotation_rad) const;
  template <class Cutting>
  void follow(FilterState& state, double insertion_mm, double rotation_rad, bool with_covariance,
              const Cutting& cutting, bool bend_known = true) const;
  template <class Cutting>
  void predict_by(FilterState& state, double insertion_mm, double rotation_rad, double duration_s,
                  const Cutting& cutting, bool bend_known) const;
  void cut_straight(FilterState& state, double insertion_mm) const;
  template <int kSize>
  bool cut_straight_sized(FilterState& state, double insertion_mm) const;
  void widen_by_gap(FilterState& state, double insertion_mm, double rotation_rad, double duration_s) const;
  static void begin_reset(FilterState& state, ResetCause cause, std::int64_t utime);
  bool draw_through(FilterState& state, const Channel::Part& part, bool with_covariance) const;
  // Share of the bevel's force that acts, in [0, 1]: below 1 where the tip is retracted from the end of the channel.
  double pressing(const FilterState& state) const;
  Shaft shaft_of(const FilterState& state) const;
  template <int kSize>
  Eigen::Vector3d drawn_back_tip(const FilterState& state, Eigen::Matrix<double, 3, kSize>& by_state) const;
  bool move_stiff(FilterState& state, double insertion_mm, double rotation_rad) const;
  void predict_stiff(FilterState& state, double insertion_mm, double rotation_rad) const;
  template <int kSize>
  bool predict_with_effects(FilterState& state, const model::BaseMotion& increment) const;
  template <int kSize>
  Update update_sized(FilterState& state, const model::TipMeasurement& measurement) const;
  template <int kSize>
  Update update_heading(FilterState& state, const model::TipHeading& measurement) const;
  // Propagates the covariance of the shared errors with the state through a step with F = [Phi G; 0 I].
  template <int kSize>
  void carry_shared(FilterState& state, const model::Matrix6d& Phi, const Eigen::Matrix<double, 6, kSize - 6>& G) const;
  void forget_shared(FilterState& state, double share) const;
  // Nuisance states (filter_nuisance.cpp).
  struct TipTurn {
    double rad = 0, by_windup = 0;
  };
  TipTurn follow_windup(FilterState& state, double insertion_mm, double rotation_rad) const;
  void spread_turn(FilterState& state, double by_windup) const;
  void begin_nuisance(FilterState& state) const;
  Eigen::Vector3d seen_by_camera(const FilterState& state, int camera, const Eigen::Vector3d& tip_mm,
                                 Eigen::Matrix<double, 3, kNuisance>& by_nuisance) const;
  Eigen::Matrix3d seen_shift(const FilterState& state) const;
  template <int kSize>
  bool relinearise_sized(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                         std::span<WalkedStep> walked) const;
  template <int kSize>
  bool relinearise_coloured(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                            std::span<WalkedStep> walked) const;
  template <int kSize>
  bool run_again(const FilterState& about, const FilterState& start, std::span<const PastStep> steps,
                 std::span<WalkedStep> walked, LinearFilter<kSize>& linear, double& cost) const;
  template <int kSize>
  double path_cost(const FilterState& state, const FilterState& start, std::span<const PastStep> steps) const;
  template <int kSize>
  Eigen::Matrix<double, kSize, 1> process_variance(const Eigen::Matrix<double, kSize, kSize>& covariance,
                                                   double insertion_mm, double rotation_rad) const;
  template <int kSize>
  void keep_in_domain(FilterState& state) const;
  bool bends_to_the_other_side(const FilterState& state) const;
  bool is_forgotten(std::int64_t heard_utime, std::int64_t utime) const;
  double side_of_bend() const;  // the sign of the prior's k; 0 if that is 0
  model::SlipParameters slip_of(const FilterState& state) const;
  model::AugmentedState augmented(const FilterState& state) const;
  // blur_mm2: variance that the effects add, along the axes of {A}.
  model::TipReading reading(const FilterState& state, Eigen::Vector3d* blur_mm2 = nullptr) const;
  // Covariance of the end of an unknown path; offset and tilt have the same along both axes across the needle.
  struct Widening {
    double aside_mm2 = 0, aside_with_tilt_mm_rad = 0, tilt_rad2 = 0, along_mm2 = 0;
  };
  static void widen_pose(FilterState& state, const Widening& by);
  void widen_by_bend(FilterState& state, double inserted_mm) const;
  void declare_reset(FilterState& state, double reach_mm, std::int64_t utime) const;

  EstimatorConfig config_;
  std::array<double, 3> gate_{};  // chi-square quantile by rank
  model::SlipParameters slip_;    // variants of the law; lambda and ell come from the state
  bool wheelbase_estimated_ = false;
  bool stiff_ = false;
  bool ten_states_ = false;
  bool coloured_ = false;
  bool has_nuisance_ = false;
  // Each step writes the parameters of the state to it: one filter serves one thread.
  mutable model::AugmentedNeedle needle_;
};

}  // namespace bevel::estimator
