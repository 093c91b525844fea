// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Needle with effects: open-loop propagation from the actuator motion, with sensitivities to any of its parameters in
/// the same pass. Without effects the result equals that of bevel/model/kinematics.hpp bit for bit (tested).
/// Source: definitions in effect.hpp; the sensitivities follow by the chain rule from StepJacobian.
#include <array>
#include <memory>
#include <vector>

#include <bevel/model/effects/base_history.hpp>
#include <bevel/model/effects/effect.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::model {

/// Effect of a model with the values of its parameters.
struct ActiveEffect {
  const Effect* effect = nullptr;                     ///< effect; must outlive this object; not null in a model
  std::array<Dual, kMaxEffectParameters> parameters;  ///< values in the order of effect->parameters()
  std::shared_ptr<const Effect> owned{};              ///< owner of an effect that is not in the registry
};

/// Sensitivity columns of the parameters of the needle and of its entry. -1: the sensitivity is not computed.
struct NeedleColumns {
  int curvature = -1;  ///< column of k, 1/mm
  int lambda1 = -1;    ///< column of lambda1, 1/rad
  int lambda2 = -1;    ///< column of lambda2
  int wheelbase = -1;  ///< column of ell, mm
  int tilt_x = -1,     ///< column of EntryPose::tilt_x_rad
      tilt_y = -1,     ///< column of EntryPose::tilt_y_rad
      roll = -1;       ///< column of EntryPose::roll_rad
  int entry_x = -1,    ///< column of x of the entry point in {A}, mm
      entry_y = -1;    ///< column of y of the entry point in {A}, mm
};

/// Sensitivities of a body perturbation (mm | rad), 6 x columns; row-major, as the slopes of a dual number.
using BodyColumns = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor, 6, kMaxColumns>;
/// Sensitivities of a point or direction in {A}, 3 x columns; row-major, as the slopes of a dual number.
using PointColumns = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor, 3, kMaxColumns>;

/// State of one insertion between legs. The object is copyable and uses no heap memory.
struct AugmentedState {
  Pose pose;                                     ///< pose of {B} in {A}
  BodyColumns D;                                 ///< d(body perturbation of the pose)/d(columns), 6 x columns
  BaseMotion entry,                              ///< actuator motion at the entry
      base;                                      ///< actuator motion at the end of the last leg
  Dual tip_insertion_mm,                         ///< position of the tip's insertion axis, mm
      tip_rotation_rad;                          ///< position of the tip's rotation axis, rad
  std::array<EffectMemory, kMaxEffects> memory;  ///< memory of each effect, in the order of AugmentedNeedle::effects()
  BaseHistory history;                           ///< past actuator motion; updated only if an effect requires it
};

/// Observed tip position with sensitivities.
struct TipReading {
  Eigen::Vector3d position_mm;  ///< position in {A}, mm
  PointColumns D;               ///< d(position)/d(columns), 3 x columns
};

/// Measured heading with sensitivities.
struct HeadingReading {
  Eigen::Vector3d direction;  ///< unit vector in {A}
  PointColumns D;             ///< d(direction)/d(columns), 3 x columns
};

/// Extended bicycle model with effects.
class AugmentedNeedle {
 public:
  /// Constructs the model. The effects are sorted into the order of the registry.
  /// @param needle needle parameters before effects
  /// @param effects effects with their parameters, at most kMaxEffects
  /// @param columns number of sensitivities that are computed, 0 to kMaxColumns
  /// @param needle_columns columns of the needle and entry parameters, each below \p columns
  /// @throws bevel::ArgumentError if there are too many effects or columns
  AugmentedNeedle(const NeedleParameters& needle, std::vector<ActiveEffect> effects = {}, int columns = 0,
                  const NeedleColumns& needle_columns = {});

  /// Computes the state at the entry point. Without effects the tip is unrolled and along z_A.
  /// @param base actuator motion at the entry
  /// @return the state
  AugmentedState entry(const BaseMotion& base) const;
  /// Propagates the state over one leg. The function does not allocate.
  /// @param[in,out] state state; on failure its pose and actuator motion are unchanged
  /// @param to actuator motion at the end of the leg
  /// @param[in,out] spread variance to which that of the effects is added, mm^2 | rad^2; null to omit it
  /// @return false outside the domain of the slip law (25)
  bool advance(AugmentedState& state, const BaseMotion& to, Spread* spread = nullptr) const;
  /// Computes the observed point in {A}, with the offsets of the effects and before the cameras.
  /// @param state state
  /// @param[out] reading point, mm in {A}, with sensitivities
  void point(const AugmentedState& state, TipReading& reading) const;
  /// Applies the camera effects to an observed point.
  /// @param[in,out] reading point from point(), mm in {A}; afterwards the point that the cameras report
  void through_cameras(TipReading& reading) const;
  /// Computes the heading that a sensor in the tip measures, with its misalignment and before the frame effects.
  /// @param state state
  /// @param[out] reading unit vector in {A}, with sensitivities
  void heading(const AugmentedState& state, HeadingReading& reading) const;
  /// Applies the frame effects to a heading.
  /// @param[in,out] reading heading from heading(); afterwards the direction that the sensor reports
  void through_frame(HeadingReading& reading) const;
  /// Computes the variance of a position measurement due to the uncertainty of the effects.
  /// @param state state
  /// @return variances along the axes of {A}, mm^2
  std::array<double, 3> blur_mm2(const AugmentedState& state) const;
  /// Computes the latency of the measurements.
  /// @return the latency, s; zero without the effect camera_latency
  Dual latency_s() const;
  /// Checks whether an effect can put a jump into the path (EffectDescription::sudden).
  /// @return true if at least one effect is sudden
  bool is_sudden() const;

  /// @return the needle parameters, modified by the effects
  const NeedleParameters& needle() const { return needle_; }
  /// @return the effects in the order in which they act; valid during the life of the object
  std::span<const ActiveEffect> effects() const { return effects_; }
  /// @return the number of sensitivities
  int columns() const { return columns_; }
  /// Sets the parameters that a filter estimates. Effects do not modify them afterwards.
  /// @param curvature_per_mm k, 1/mm
  /// @param lambda1_per_rad lambda1 of (25), 1/rad
  /// @param lambda2 lambda2 of (25)
  /// @param wheelbase_mm ell, mm
  void set_needle(double curvature_per_mm, double lambda1_per_rad, double lambda2, double wheelbase_mm);

 private:
  bool advance_plain(AugmentedState& state, const BaseMotion& to) const;
  bool advance_with_effects(AugmentedState& state, const BaseMotion& to, Spread* spread) const;
  // Integrates the pose over a leg. The derivatives through the increments and the curvature of the leg remain to be
  // added.
  bool integrate(AugmentedState& state, const StepInput& input, StepJacobian& J) const;
  Parameters parameters(const ActiveEffect& active) const {
    return {active.parameters.data(), active.effect->parameters().size()};
  }

  NeedleParameters needle_;
  SlipParameters slip_;
  std::vector<ActiveEffect> effects_;
  int columns_;
  NeedleColumns needle_columns_;
  bool keeps_history_ = false;
};

}  // namespace bevel::model
