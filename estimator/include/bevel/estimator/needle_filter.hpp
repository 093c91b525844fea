// SPDX-License-Identifier: MIT
#pragma once
// Extended Kalman filter of the needle: pose on SE(3), curvature and lambda, driven by actuator increments.
//
// State: pose of {B} in {A} (error in the body frame, mm | rad), k, lambda1, lambda2. Nine error states, in this order;
// a tenth is ell where the prior gives it a width (Prior::wheelbase_sd_mm), or the bending length of a stiff shaft
// (Prior::bending_mm).
// Model: bevel/model/kinematics.hpp, (10) with the slip of (25); measurements: tip position in {A}, heading in {A},
// each with information of any rank. Pure: no clock, no allocation, fixed-size Eigen. Covariance by the Joseph form,
// symmetric and floored.
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

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

// Where the base and the effects of the model file stand; not in use without effects. Values only: that what an effect
// remembers depends on the estimate is not followed.
struct EffectState {
  model::BaseMotion entry, base;
  double tip_insertion_mm = 0, tip_rotation_rad = 0;
  std::array<std::array<double, model::EffectMemory::kSlots>, model::kMaxEffects> slot{};
  std::array<std::array<double, model::EffectMemory::kNumbers>, model::kMaxEffects> number{};
  std::array<int, model::kMaxEffects> phase{};
  model::BaseHistory history;
};

// Errors that a camera's neighbouring readings share (ReadingNoise), in their own standard deviations: each of unit
// variance beforehand; three along the axes of {A} of camera 0, three of camera 1. Not in use where all is white.
inline constexpr int kSharedErrors = 6;
struct SharedErrors {
  Eigen::Matrix<double, kSharedErrors, 1> mean = Eigen::Matrix<double, kSharedErrors, 1>::Zero();
  Eigen::Matrix<double, 10, kSharedErrors> with_state = Eigen::Matrix<double, 10, kSharedErrors>::Zero();  // covariance
  Eigen::Matrix<double, kSharedErrors, kSharedErrors> covariance =
      Eigen::Matrix<double, kSharedErrors, kSharedErrors>::Identity();
};

struct FilterState {
  model::Pose pose;
  double curvature_per_mm = 0;
  double lambda1_per_rad = 0;
  double lambda2 = 0;
  double wheelbase_mm = 0;
  double bending_mm = 0;  // above 0: the shaft is stiff
  Matrix9d covariance = Matrix9d::Zero();
  // Of ell, or the bending length, with the nine, and its own; zero where there are nine.
  Vector9d tenth_covariance = Vector9d::Zero();
  double tenth_variance = 0;
  std::int64_t measurement_utime = 0;  // newest position accepted; 0 before the first
  std::int64_t reading_utime = 0;      // newest that saw anything, accepted or not
  std::int32_t rejects_in_row = 0;
  std::array<std::uint8_t, 4> camera_rejects_in_row{};  // cameras 0 to 3; higher numbers share the last
  std::int32_t heading_rejects_in_row = 0;              // of any camera; they bring no reset
  std::array<std::int64_t, 4> camera_utime{};           // newest position of each, accepted or not
  std::int64_t heading_utime = 0;                       // newest heading of any camera, accepted or not
  std::int32_t reset_count = 0;
  ResetCause reset_cause = ResetCause::none;  // of the newest reset
  std::int64_t reset_utime = 0;
  bool turned_over = false;  // a reset put the bevel on the other side; it does so once
  bool outside_model = false;
  Channel channel;
  EffectState effects;
  SharedErrors shared;
  Nuisance nuisance;
};

struct Update {
  bool accepted = false;
  bool reset = false;       // this measurement brought a declared reset
  int rank = 0;             // axes that it saw
  double mahalanobis2 = 0;  // d^2 = innovation^T S^-1 innovation
  double test_ratio = 0;    // d^2 over the gate of its rank
  Eigen::Vector3d innovation =
      Eigen::Vector3d::Zero();  // first `rank` entries, along the seen axes, mm; of a heading rad
  Eigen::Vector3d innovation_whitened =
      Eigen::Vector3d::Zero();  // L^-1 innovation, S = L L^T: unit variance if all is right
};

// What was measured of a direction on a stretch of the past, as one linear reading: information times (seen -
// direction).
struct DirectionReading {
  bool measured = false;  // and accepted
  Eigen::Vector3d seen = Eigen::Vector3d::Zero();
  Eigen::Vector3d offset =
      Eigen::Vector3d::Zero();  // in {B} at the end of the step: of when it was measured, from then
  Eigen::Matrix3d information_per_rad2 = Eigen::Matrix3d::Zero();
};

// One step of the past, as relinearise() needs it: increments since the step before it, then perhaps what was measured
// on the way, as one reading of a point that stands still in the body and one each of its heading and of its motion.
struct PastStep {
  double insertion_mm = 0;
  double rotation_rad = 0;
  bool measured = false;  // and accepted by the gate at its time
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  // in {B} at the end of the step: where the tip was when measured
  Eigen::Matrix3d information_per_mm2 = Eigen::Matrix3d::Zero();
  DirectionReading heading{};  // of e3
  DirectionReading motion{};   // of the way the tip moves

  bool has_reading() const { return measured || heading.measured || motion.measured; }
};

// What relinearise() writes down of a step of a path when it walks back over it.
struct WalkedStep {
  model::NeedleJacobian backwards;  // of the step that undoes it
  Eigen::Matrix3d R;                // of the pose after it
  Eigen::Vector3d residual_mm;      // measured, less where the path has the point
  Eigen::Vector3d residual_rad;     // the same of the heading
  Eigen::Vector3d motion_residual_rad;
};

// A state's heading as the cameras see it, or the way its tip moves: a unit vector in {A}, and its derivatives by the
// error of the pose and by lambda1, lambda2.
struct SeenHeading {
  Eigen::Vector3d along;
  Eigen::Matrix<double, 3, 6> by_error;
  Eigen::Matrix<double, 3, 2> by_slip = Eigen::Matrix<double, 3, 2>::Zero();
};

template <int kSize>
struct LinearFilter;  // relinearise.cpp

class NeedleFilter {
 public:
  explicit NeedleFilter(const EstimatorConfig& config);

  // The prior at the entry point: heading along z_A but for what effects say, bevel as the model file says, the base
  // where it stands then.
  FilterState initial(double insertion_mm = 0, double rotation_rad = 0) const;

  // The same for a needle that was inserted before anybody watched: as deep and turned as the axes say, straight, and
  // as uncertain as it can have bent on the way. Without depth it is initial(), turned.
  FilterState inserted(double insertion_mm, double rotation_rad) const;

  // Moves the state by increments of the two axes in so much time (which only effects ask for): through the channel
  // that was cut where there is one (EstimatorConfig::through_channel, filter_channel.cpp), cutting beyond. Where the
  // model has no answer the pose stays, and outside_model is set.
  void predict(FilterState& state, double insertion_mm, double rotation_rad, double duration_s = 0) const;

  /// Moves the state across a gap: an interval in which the axes were not observed and moved by \p insertion_mm and
  /// \p rotation_rad in all. Their path is known only by the rates that no axis exceeds (AxisLimits), so the mean goes
  /// straight and the covariance is widened by every path within those (filter_gap.cpp). A declared reset.
  /// @param duration_s length of the gap
  /// @param utime time of its end, us
  void pass_gap(FilterState& state, double insertion_mm, double rotation_rad, double duration_s,
                std::int64_t utime) const;

  // The same without the covariance, for what is only predicted.
  void predict_mean(FilterState& state, double insertion_mm, double rotation_rad, double duration_s = 0) const;

  // As predict() without effects, of a tip that cuts where it is, whatever has been cut before; back too.
  void predict_cutting(FilterState& state, double insertion_mm, double rotation_rad) const;

  // The tip in {A} and the shaft's end there: the state's own pose, but for what effects or a stiff shaft make of it.
  model::Pose tip_pose(const FilterState& state) const;

  // Where the cameras see the tip of a state, and by how much they are late.
  Eigen::Vector3d seen_position_mm(const FilterState& state) const;
  SeenHeading seen_heading(const FilterState& state) const;
  // Nothing outside the domain of the slip law.
  std::optional<SeenHeading> seen_motion(const FilterState& state) const;
  // Whether this camera's headings are of the shaft, and so of the way the tip moves (EstimatorConfig::shaft_cameras).
  bool is_of_shaft(std::int32_t camera) const;
  // Which way the tip of a state moves, in {A}; zero where no camera gives it, and outside the slip law's domain.
  Eigen::Vector3d motion_of(const FilterState& state) const;
  std::int64_t latency_us() const;

  // How much of a camera's shared errors is forgotten on such a motion: exp(-this) is left of their correlation.
  double forgotten(double insertion_mm, double rotation_rad, double duration_s) const;
  // What a reading is worth, of a white one, when so much was forgotten since its camera's last: over many readings of
  // one constant exactly their information.
  double worth(double forgotten_since) const;

  // A heading about a state, without effects, as a point of which all that is known is linear: information times
  // (seen - h) is what it says of h, R e3 or the way the tip moves, and the information is singular along that.
  DirectionReading made_linear(const model::TipHeading& measurement, const FilterState& state) const;

  // Applies one measurement; its status must be 0 and its values finite (the checked decode sees to that).
  Update update(FilterState& state, const model::TipMeasurement& measurement) const;

  // The same for a heading: of what it knows across itself, one angle or two (filter_heading.cpp). It has the gate of
  // its rank and a count of rejects of its own, and brings no reset: a sensor that is turned about must not throw away
  // what the cameras know. One that points backwards is refused whatever its information says.
  Update update(FilterState& state, const model::TipHeading& measurement) const;

  // An extended filter keeps the derivatives that it took while it knew little of k and lambda, and is too sure for
  // it. This runs the steps since `start` (the state before the first of them) again; `state` is the estimate after the
  // last step and is replaced by the result. False, and nothing changed, where the model has no answer or the result's
  // path would not come nearer to the measurements.
  // Where data leave k and lambda to trade off, the posterior is a bent ridge. So this is done at three places along
  // the least known direction, each time with all derivatives on the path that leads there: an iterated Kalman filter
  // over a window (cf. Bell and Cathey 1993, IEEE TAC 38(2)) of the rest, given the place. The three are put together
  // by Gauss and Hermite's rule, weighed by how probable each makes the measurements: mean and covariance of the ridge.
  // `walked` is room to work in, for as many steps at least.
  bool relinearise(FilterState& state, const FilterState& start, std::span<const PastStep> steps,
                   std::span<WalkedStep> walked) const;

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
  // How much of the bevel's force is left: less than all of it where the tip was drawn back from what it has cut.
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
  // The shared errors' covariance with a state that a step moves by F = [Phi G; 0 I].
  template <int kSize>
  void carry_shared(FilterState& state, const model::Matrix6d& Phi, const Eigen::Matrix<double, 6, kSize - 6>& G) const;
  void forget_shared(FilterState& state, double share) const;
  // Of the nuisance states (filter_nuisance.cpp).
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
  double side_of_bend() const;  // the prior's sign of k; 0 of a prior that has none
  model::SlipParameters slip_of(const FilterState& state) const;
  model::AugmentedState augmented(const FilterState& state) const;
  // blur_mm2: what the effects do not know of it, along the axes of {A}.
  model::TipReading reading(const FilterState& state, Eigen::Vector3d* blur_mm2 = nullptr) const;
  // Variance of an unknown path at its end; that of offset and tilt is the same along both axes across the needle.
  struct Widening {
    double aside_mm2 = 0, aside_with_tilt_mm_rad = 0, tilt_rad2 = 0, along_mm2 = 0;
  };
  static void widen_pose(FilterState& state, const Widening& by);
  void widen_by_bend(FilterState& state, double inserted_mm) const;
  void declare_reset(FilterState& state, double reach_mm, std::int64_t utime) const;

  EstimatorConfig config_;
  std::array<double, 3> gate_{};  // chi-square quantile by rank
  model::SlipParameters slip_;    // the variants; lambda and ell come from the state
  bool wheelbase_estimated_ = false;
  bool stiff_ = false;
  bool ten_states_ = false;
  bool coloured_ = false;
  bool has_nuisance_ = false;
  // Its parameters are set to those of the state in each step: one filter serves one thread.
  mutable model::AugmentedNeedle needle_;
};

}  // namespace bevel::estimator
