// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Interface of an effect: one piece of physics that the nominal model omits, as a set of hooks into the integrator.
///
/// An effect is one file with a class without state, derived from Effect, and one line in registry.cpp. The class
/// states its equation in dual numbers (dual.hpp), which yields its sensitivities. docs/adding-an-effect.md explains
/// the steps.
///
/// A leg is the actuator motion between two nodes, at constant rates. Order of the hooks within a leg
/// (augmented_needle.hpp): axes, curvature, the integrator, settle. For a position measurement follow offset and
/// camera; for a heading measurement follow sensor and frame. Several effects act in the order of the registry, from
/// the motor to the camera.
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <bevel/model/effects/dual.hpp>
#include <bevel/model/needle.hpp>

namespace bevel::model {

/// Largest number of parameters of one effect.
inline constexpr int kMaxEffectParameters = 4;
/// Largest number of effects in one model.
inline constexpr int kMaxEffects = 8;

/// Recordings that share the value of a parameter.
enum class Scope {
  rig,        ///< one value for all recordings
  recording,  ///< one value per recording, for example a phase or an event time
};

/// Meaning of a parameter that states where its effect begins. The effect changes nothing before that.
enum class Begins {
  unsaid,   ///< the parameter does not state where the effect begins
  depth,    ///< at this depth of the tip along z, mm
  instant,  ///< at this event time, s from the start of the recording; 0: not in this recording
};

/// Properties of one effect parameter: bounds, start values of a fit and facts for the prior density.
struct EffectParameter {
  std::string_view name;  ///< name with unit; part of the formats of verdict.json and model.toml
  double lower,           ///< lower bound in model files and fits, in the parameter's unit
      upper;              ///< upper bound in model files and fits, in the parameter's unit
  double none;            ///< value at which the effect vanishes; NaN if no such value exists, as for a layer's depth
  /// Start values of a fit, in the parameter's unit: one value for one local minimum of the negative log-likelihood, a
  /// grid for several (a depth, a frequency).
  std::vector<double> starts;
  double reported = 0;  ///< largest distance from `none` that the literature reports; 0 where `none` is NaN
  /// Likely range from the literature and the length of needles, for a parameter that has no `none` and is not
  /// periodic. The prior density is uniform over this range, with one part in twenty uniform over [lower, upper].
  double likely_low = 0,
         likely_high = 0;    ///< upper end of the likely range, in the parameter's unit
  Scope scope = Scope::rig;  ///< recordings that share the value
  bool periodic = false;     ///< true for an angle; the bounds are one period apart
  /// For a periodic parameter: index of the angle that shifts by half of its period when this one shifts by one period;
  /// -1 if no such angle exists.
  int half_turns = -1;
  bool frequency = false;  ///< true for a frequency in Hz; the sampling interval of the measurements limits it
  /// True for a size that also determines the form. Responses at different values are not proportional, and a fit uses
  /// each start value unchanged.
  bool shape = false;
  Begins begins = Begins::unsaid;  ///< where the effect begins, if the parameter states it
  /// Distance between equivalent values, in the parameter's unit. Only measurements during the event distinguish them;
  /// meant() selects the one nearest to `none`. 0 if no values are equivalent. A periodic parameter stays within its
  /// bounds and needs none.
  double modulo = 0;
  double smallest_seen = 0;  ///< smallest distance from `none` that the causes of the effect produce
  double largest_seen = std::numeric_limits<double>::infinity();  ///< largest value that the causes produce
  /// Default if the model file has no value; NaN: `none` is the default, and without it the value is required.
  double usual = std::numeric_limits<double>::quiet_NaN();
  /// Standard uncertainty that the assumed form adds to an estimate, in the parameter's unit. Repetition does not
  /// reveal it (JCGM 100, 4.3). 0 if unknown.
  double form_sd = 0,
         form_share = 0;  ///< the same as a fraction of the value; 0 if unknown
};
/// Lists start values at even spacing. The spacing must not exceed the width of the effect, or a fit can miss it.
/// @param step spacing, in the parameter's unit, > 0
/// @param first first value
/// @param last upper limit of the values
/// @return first, first + step, ... up to \p last
std::vector<double> starts_every(double step, double first, double last);
/// Returns the default of a parameter, for a model file without a value and for variants without this parameter.
/// @param parameter parameter of an effect
/// @return 0 for Scope::recording, otherwise `usual`, or `none` if `usual` is NaN; NaN if the value is required
double value_if_unsaid(const EffectParameter& parameter);
/// Maps a value to the equivalent value nearest to `none` (EffectParameter::modulo).
/// @param parameter parameter of an effect
/// @param value value, in the parameter's unit
/// @return the equivalent value; \p value if `modulo` is 0
double meant(const EffectParameter& parameter, double value);
/// Length of the longest insertion needles, mm (brachytherapy and biopsy needles: 100 to 150 mm).
inline constexpr double kLongestNeedle_mm = 150;
/// Value of EffectParameter::none for a parameter at which the effect does not vanish.
inline constexpr double kNoNone = std::numeric_limits<double>::quiet_NaN();

/// Covariates of a discrepancy: the quantities against which an effect is plotted and tested. All but the tip positions
/// follow from the actuator motion.
enum class Covariate {
  time_s,               ///< time since the start of the recording, s
  depth_mm,             ///< position of the insertion axis, mm
  speed_mm_s,           ///< magnitude of the insertion rate, mm/s
  turn_rate_rad_s,      ///< magnitude of the rotation rate, rad/s
  since_stop_s,         ///< time since insertion stopped, s; 0 during insertion
  since_reversal_mm,    ///< insertion since the last rotation of the shaft, mm
  roll_rad,             ///< position of the rotation axis, rad
  turned_rad,           ///< rotation since the entry, rad, full turns included
  withdrawn_mm,         ///< retraction from the deepest position so far, mm
  tip_x_mm,             ///< tip position along x of {A}, mm
  tip_y_mm,             ///< tip position along y of {A}, mm
  tip_xy_mm,            ///< tip position along (x + y)/sqrt(2) of {A}, mm
  tip_yx_mm,            ///< tip position along (y - x)/sqrt(2) of {A}, mm
  since_speed_change_s  ///< time since the last change of the insertion velocity, s
};
/// Number of covariates.
inline constexpr std::size_t kCovariates = 14;
/// Returns the name of a covariate, which is that of its enumerator.
/// @param covariate covariate
/// @return the name with its unit, for example "depth_mm"
std::string_view name_of(Covariate covariate);
/// Returns whether a covariate requires time stamps: time, speed, rotation rate, and time since a stop or speed change.
/// @param covariate covariate
/// @return true if recordings without time stamps do not determine it
bool needs_clock(Covariate covariate);
/// Returns the direction along which a covariate measures the tip position. The diagonals are included because no axis
/// of {A} is a preferred direction of tissue.
/// @param covariate covariate
/// @return unit vector (x, y) in {A}; empty for a covariate of the actuator motion
std::optional<Eigen::Vector2d> tip_direction(Covariate covariate);
/// Lists all covariates.
/// @return the covariates in the order of the enumeration; static storage
std::span<const Covariate> all_covariates();
/// Returns whether the contributions of several past events add up. This holds only for changes of speed.
/// @param covariate covariate
/// @return true for Covariate::since_speed_change_s
inline bool adds_up(Covariate covariate) { return covariate == Covariate::since_speed_change_s; }

/// Number of past intervals in SpeedChanges.
inline constexpr std::size_t kSpeedChanges = 12;
/// Length of one interval of SpeedChanges, s.
inline constexpr double kSpeedChange_s = 0.1;
/// Returns the age of an element of SpeedChanges.
/// @param i index, below kSpeedChanges
/// @return the age, s
constexpr double since_speed_change_s(std::size_t i) { return static_cast<double>(i + 1) * kSpeedChange_s; }
/// Changes of the insertion velocity of the actuator, mm/s. Element i is the change since_speed_change_s(i) ago
/// (base_history.hpp).
using SpeedChanges = std::array<double, kSpeedChanges>;

/// State of an effect between the legs of one insertion, with sensitivities.
struct EffectMemory {
  static constexpr std::size_t kSlots = 4,  ///< number of elements of `slot`
      kNumbers = 6;                         ///< number of elements of `number`
  std::array<Dual, kSlots> slot;            ///< state with sensitivities; each effect defines the meaning
  std::array<double, kNumbers> number{};    ///< state whose sensitivities are negligible
  int phase = 0;                            ///< 0 before the first leg; each effect defines the other values
};

/// Actuator motion at the end of a leg, as measured by the encoders.
struct BaseMotion {
  double time_s = 0;        ///< time since the start of the recording, s
  double insertion_mm = 0;  ///< position of the insertion axis, mm
  double rotation_rad = 0;  ///< position of the rotation axis, rad
};

/// Leg as an effect sees it: actuator motion, tip pose at its start and increments, with sensitivities.
struct LegView {
  BaseMotion entry,      ///< actuator motion at the entry of this insertion
      from,              ///< actuator motion at the start of the leg
      to;                ///< actuator motion at the end of the leg
  Dual tip_depth_mm;     ///< z of the tip in {A} at the start of the leg, mm
  Dual2 tip_side_mm;     ///< x and y of the tip in {A} at the start of the leg, mm
  Dual heading_z;        ///< cosine of the tilt at the start of the leg
  Eigen::Matrix3d R;     ///< orientation of {B} in {A} at the start of the leg, 3 x 3
  bool R_moves = false;  ///< true if R depends on a parameter; R_body is valid only then
  /// Derivatives of R: d(rotation vector in {B})/d(column), rad per unit of the column, 3 x kMaxColumns.
  Eigen::Matrix<double, 3, kMaxColumns> R_body;
  Dual curvature_per_mm;              ///< nominal curvature k of the needle, 1/mm, without effects
  Dual insertion_mm,                  ///< insertion of the tip over the leg, mm; valid after `axes`
      rotation_rad;                   ///< rotation of the tip over the leg, rad; valid after `axes`
  Dual tip_rotation_rad;              ///< rotation of the tip at the start of the leg, rad
  SpeedChanges speed_changes_mm_s{};  ///< speed changes before the end of the leg, mm/s; valid from `settle` on

  /// @return the duration of the leg, s
  double duration_s() const { return to.time_s - from.time_s; }
  /// @return the insertion of the actuator over the leg, mm
  double base_insertion_mm() const { return to.insertion_mm - from.insertion_mm; }
  /// @return the rotation of the actuator over the leg, rad
  double base_rotation_rad() const { return to.rotation_rad - from.rotation_rad; }
  /// @return the magnitude of the insertion rate |u1|, mm/s; 0 for a leg without duration
  double speed_mm_s() const { return duration_s() > 0 ? std::abs(base_insertion_mm()) / duration_s() : 0; }
  /// @return the magnitude of the rotation rate |u2|, rad/s; 0 for a leg without duration
  double turn_rate_rad_s() const { return duration_s() > 0 ? std::abs(base_rotation_rad()) / duration_s() : 0; }
  /// Transforms a lateral vector from {A} to {B}, with {B} halfway through the rotation of the leg.
  /// @param world x and y in {A}, any unit; z is 0
  /// @return x and y in {B}, in the same unit
  Dual2 lateral_in_body(const Dual2& world) const;
  /// Computes the curvature in {B} that turns the heading toward +x and +y of {A} at given rates. As a rotation vector
  /// in {A} it is (-y, x), because the heading moves by kappa x e3 = (kappa_y, -kappa_x).
  /// @param world rates toward +x and +y of {A}, 1/mm
  /// @return (kappa_x, kappa_y) in {B}, 1/mm
  Dual2 curvature_toward(const Dual2& world) const { return lateral_in_body({-world[1], world[0]}); }
  /// Transforms a lateral vector from {B} at the start of the leg to {A}, without its z component.
  /// @param body x and y in {B}, any unit; z is 0
  /// @return x and y in {A}, in the same unit
  Dual2 lateral_in_world(const Dual2& body) const;
  /// Transforms a lateral vector from {B} at the start of the leg to {A}.
  /// @param body x and y in {B}, any unit; z is 0
  /// @return x, y and z in {A}, in the same unit
  Dual3 in_world(const Dual2& body) const;
  /// Computes the unit vector toward the bevel side, halfway through the rotation of the leg. The heading turns toward
  /// body -y for k > 0.
  /// @return x and y in {B} at the start of the leg
  Dual2 toward_bevel() const;
};

/// Pose of the tip at the entry relative to z_A, with sensitivities.
struct EntryPose {
  Dual tilt_x_rad,  ///< x of the rotation vector of the heading in {A}, rad
      tilt_y_rad;   ///< y of the rotation vector of the heading in {A}, rad
  Dual roll_rad;    ///< roll about the heading, rad, applied after the tilt
};

/// Values of an effect's parameters, in the order of Effect::parameters().
using Parameters = std::span<const Dual>;

/// Variance of the pose over one leg due to the uncertainty of the effects, as a body perturbation: mm^2 | rad^2.
using Spread = std::array<double, 6>;

/// Static properties of an effect.
struct EffectDescription {
  std::string_view name;                    ///< identifier; part of the formats of verdict.json and model.toml
  std::string_view meaning;                 ///< one clause for the report: the physical cause in the rig
  Covariate covariate;                      ///< covariate against which the effect is plotted
  std::vector<EffectParameter> parameters;  ///< parameters, at most kMaxEffectParameters
  bool of_headings = false;                 ///< true if only heading measurements depend on the effect
  /// The effect acts where the insertion changes direction. Without a retraction it is an offset of the depth.
  bool needs_retraction = false;
  /// True if the tip jumps within hundredths of a millimetre of actuator motion. The position error of the actuator
  /// then decides which measurement lies before the jump.
  bool sudden = false;
};

/// Base class of the effects. An object has no mutable state; EffectMemory stores the state of an insertion. The
/// default of each hook changes nothing.
class Effect {
 public:
  /// Stores the description.
  /// @param description static properties
  explicit Effect(EffectDescription description) : description_(std::move(description)) {}
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;
  virtual ~Effect() = default;

  /// @return EffectDescription::name
  std::string_view name() const { return description_.name; }
  /// @return EffectDescription::meaning
  std::string_view meaning() const { return description_.meaning; }
  /// @return EffectDescription::covariate
  Covariate covariate() const { return description_.covariate; }
  /// @return EffectDescription::parameters
  const std::vector<EffectParameter>& parameters() const { return description_.parameters; }
  /// @return EffectDescription::of_headings
  bool of_headings() const { return description_.of_headings; }
  /// @return EffectDescription::needs_retraction
  bool needs_retraction() const { return description_.needs_retraction; }
  /// @return EffectDescription::sudden
  bool sudden() const { return description_.sudden; }

  /// Modifies the needle parameters, once per model.
  virtual void change_needle(NeedleParameters&) const {}
  /// Modifies the pose at the entry, given the effect's parameters.
  virtual void enter(Parameters, EntryPose&) const {}
  /// Modifies the axis positions of the tip at the end of the leg: insertion, mm, and rotation, rad. The input is the
  /// actuator positions, modified by the preceding effects.
  virtual void axes(Parameters, const LegView&, EffectMemory&, Dual& /*insertion_mm*/, Dual& /*rotation_rad*/) const {}
  /// Modifies the curvature over the leg, in {B}, 1/mm. The input is (k, 0), modified by the preceding effects.
  virtual void curvature(Parameters, const LegView&, EffectMemory&, Dual2& /*kappa_per_mm*/) const {}
  /// Updates the memory after the integration of the leg, for effects with an offset. LegView::R remains that of the
  /// start of the leg.
  virtual void settle(Parameters, const LegView&, EffectMemory&) const {}
  /// Moves the observed point, mm in {A}, at a time in s since the start of the recording.
  virtual void offset(Parameters, const EffectMemory&, double /*time_s*/, Dual3& /*position_mm*/) const {}
  /// Transforms the observed point, mm in {A}, into the point that the cameras report.
  virtual void camera(Parameters, Dual3& /*position_mm*/) const {}
  /// Adds the misalignment of the heading sensor, or of the part that holds it: x and y of its rotation vector in {B},
  /// rad.
  virtual void sensor(Parameters, const EffectMemory&, Dual2& /*tilt_rad*/) const {}
  /// Transforms a direction in {A} into the frame in which the sensor reports it.
  virtual void frame(Parameters, Dual3& /*direction*/) const {}
  /// Computes the latency of the measurements. A measurement at time t shows the tip at t minus the latency.
  /// @return the latency, s
  virtual Dual latency_s(Parameters) const { return {}; }

  /// Adds the variance of the pose over the leg that is due to the uncertainty of the effect; called after settle. The
  /// legs count as independent, so an effect scales its contributions until their sum is correct.
  virtual void spread(const LegView&, const EffectMemory&, Spread&) const {}
  /// Adds the variance of the offset in one measurement, mm^2 along the axes of {A}. Consecutive measurements share the
  /// error.
  virtual void blur(const EffectMemory&, std::array<double, 3>& /*variance_mm2*/) const {}

  /// Checks whether measurements jump at the event time of a variant. The likelihood then has no derivative with
  /// respect to the event time. The argument is an element of variants().
  /// @return true if they jump
  virtual bool jumps(std::uint32_t /*kind*/) const { return false; }
  /// Lists the sets of parameters that are fitted together, one per variant of the effect.
  /// @return one bit mask per variant: bit i represents parameter i; static storage. The default is one mask with all
  ///     bits set.
  virtual std::span<const std::uint32_t> variants() const;

 private:
  EffectDescription description_;
};

/// Lists all effects of the library.
/// @return the effects in the order in which they act; static storage
std::span<const Effect* const> all_effects();
/// Finds an effect by its name.
/// @param name identifier, for example "layer"
/// @return the effect, with static storage; null if the library has none of that name
const Effect* find_effect(std::string_view name);

/// Finds the first parameter that is not finite or outside its bounds.
/// @param effect effect
/// @param values one value per parameter of \p effect, in its unit and order
/// @return the index of the parameter; -1 if all are valid
int find_parameter_violation(const Effect& effect, std::span<const double> values);

}  // namespace bevel::model
