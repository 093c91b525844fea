#pragma once
// One piece of physics that the bicycle model leaves out, as a set of hooks into the integrator. An effect is one file:
// a class without state, derived from Effect, that states its equation in dual numbers (dual.hpp) and so yields its
// sensitivities; and one line in registry.cpp. docs/adding-an-effect.md walks through it.
//
// Order within a leg (augmented_needle.hpp): axes -> curvature -> the integrator -> settle; then, for a measurement:
// offset -> camera; for a measured heading: sensor -> frame. Several effects act in the order of the registry, motor
// first, camera last.
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

inline constexpr int kMaxEffectParameters = 4;
inline constexpr int kMaxEffects = 8;

enum class Scope {
  rig,        // the same in all recordings
  recording,  // a phase or an instant of its own in each
};

// What a parameter says of where its effect begins to act. Before that it changes nothing.
enum class Begins {
  unsaid,
  depth,    // there, in mm of the tip along z
  instant,  // then, in s from the start of the recording; 0: not in this recording
};

struct EffectParameter {
  std::string_view name;  // a contract, with the unit: verdict.json, model.toml
  double lower, upper;    // of the model file and of a fit
  double none;            // where the effect vanishes; NaN: it does not vanish by this parameter (a layer's depth)
  // Where fits begin: one value if the likelihood has one valley, a grid if several (a depth, a frequency).
  std::vector<double> starts;
  double reported = 0;  // largest distance from `none` that the literature reports; 0 where `none` is NaN
  // Likely range by the literature and the length of needles, for a parameter without `none` that is not periodic. The
  // prior density is uniform over it, with one part in twenty uniform over [lower, upper].
  double likely_low = 0, likely_high = 0;
  Scope scope = Scope::rig;
  bool periodic = false;   // an angle: the bounds are one period apart
  int half_turns = -1;     // periodic: the angle that has to turn by half of its own period when this one turns by one
  bool frequency = false;  // in Hz: readings too far apart do not show it
  // A size on which the form depends as well: readings at one value are no multiple of those at another, and a start
  // is taken as it stands.
  bool shape = false;
  Begins begins = Begins::unsaid;
  // Values so far apart are the same to all readings but those while it happens; the one nearest to `none` is meant.
  // 0: none are. A periodic parameter is kept within its bounds and needs none.
  double modulo = 0;
  double smallest_seen = 0;  // how far from `none` the effect's causes bring it at least
  double largest_seen = std::numeric_limits<double>::infinity();  // the largest value that they bring about
  double usual = std::numeric_limits<double>::quiet_NaN();        // where a model file does not say; NaN: it has to
  // Standard uncertainty, in the parameter's unit, that this form of the effect adds to a value found by it (JCGM 100,
  // 4.3: one that no repetition shows); the same as a share of the value. 0: none is known.
  double form_sd = 0, form_share = 0;
};
// Starts from first to last, evenly: as close as the effect is narrow, or a fit never finds it.
std::vector<double> starts_every(double step, double first, double last);
// Where a model file does not say, or another kind of the effect is meant; NaN: it has to be said.
double value_if_unsaid(const EffectParameter& parameter);
// Of all values that are the same (EffectParameter::modulo) the one that is meant.
double meant(const EffectParameter& parameter, double value);
// Insertion needles are up to 150 mm long (brachytherapy and biopsy needles, 100 to 150 mm).
inline constexpr double kLongestNeedle_mm = 150;
inline constexpr double kNoNone = std::numeric_limits<double>::quiet_NaN();

// Against what the effect is to be looked at: where it shows.
enum class Covariate {
  time_s,
  depth_mm,
  speed_mm_s,
  turn_rate_rad_s,
  since_stop_s,
  since_reversal_mm,
  roll_rad,
  turned_rad,
  withdrawn_mm,
  tip_x_mm,
  tip_y_mm,
  tip_xy_mm,
  tip_yx_mm,
  since_speed_change_s
};
inline constexpr std::size_t kCovariates = 14;
std::string_view name_of(Covariate covariate);
bool needs_clock(Covariate covariate);  // time, speed, rate, rest: unknown where only the order of readings is
// Unit vector (x, y of {A}) along which a covariate says where the tip is; nothing for one of the base's motion. An
// axis of {A} is no better than a direction between: tissue does not know them.
std::optional<Eigen::Vector2d> tip_direction(Covariate covariate);
std::span<const Covariate> all_covariates();
// Whether it counts from each of several causes, of which each still acts: what they bring adds up.
inline bool adds_up(Covariate covariate) { return covariate == Covariate::since_speed_change_s; }

// By how much the base's speed of insertion changed, mm/s: at i, since_speed_change_s(i) ago (base_history.hpp).
inline constexpr std::size_t kSpeedChanges = 12;
inline constexpr double kSpeedChange_s = 0.1;
constexpr double since_speed_change_s(std::size_t i) { return static_cast<double>(i + 1) * kSpeedChange_s; }
using SpeedChanges = std::array<double, kSpeedChanges>;

// What an effect remembers between legs of one insertion. Slopes come with it.
struct EffectMemory {
  static constexpr std::size_t kSlots = 4, kNumbers = 6;
  std::array<Dual, kSlots> slot;
  std::array<double, kNumbers> number{};  // what no unknown moves much
  int phase = 0;                          // 0 until it has seen a leg
};

// The base, as the encoders say, at the ends of a leg; t counts from the start of the recording.
struct BaseMotion {
  double time_s = 0;
  double insertion_mm = 0;
  double rotation_rad = 0;
};

// What a leg looks like to an effect.
struct LegView {
  BaseMotion entry, from, to;  // of the insertion, of this leg
  Dual tip_depth_mm;           // z of the tip at the start of the leg
  Dual2 tip_side_mm;           // its x and y there
  Dual heading_z;              // cosine of the tilt there
  Eigen::Matrix3d R;           // orientation of {B} at the start, and its derivatives as body rotations:
  bool R_moves = false;        // with an unknown: then
  Eigen::Matrix<double, 3, kMaxColumns> R_body;  // d(rotation vector in {B})/d(column)
  Dual curvature_per_mm;                         // the needle's own k, whatever effects make of it
  // Known from `axes` on:
  Dual insertion_mm, rotation_rad;    // increments of the tip
  Dual tip_rotation_rad;              // of the tip at the start of the leg
  SpeedChanges speed_changes_mm_s{};  // before the leg's end; known from `settle` on

  double duration_s() const { return to.time_s - from.time_s; }
  double base_insertion_mm() const { return to.insertion_mm - from.insertion_mm; }
  double base_rotation_rad() const { return to.rotation_rad - from.rotation_rad; }
  // |u1|, |u2|
  double speed_mm_s() const { return duration_s() > 0 ? std::abs(base_insertion_mm()) / duration_s() : 0; }
  double turn_rate_rad_s() const { return duration_s() > 0 ? std::abs(base_rotation_rad()) / duration_s() : 0; }
  // A vector of {A} seen in {B} halfway through the leg's own rotation.
  Dual2 lateral_in_body(const Dual2& world) const;
  // Curvature in {B} by which the heading turns toward +x and +y of {A} by so much per mm. As a rotation vector that is
  // (-y, x): the heading moves by kappa x e3 = (kappa_y, -kappa_x).
  Dual2 curvature_toward(const Dual2& world) const { return lateral_in_body({-world[1], world[0]}); }
  // A lateral vector of {B} at the start of the leg, as its x and y in {A}; all of it.
  Dual2 lateral_in_world(const Dual2& body) const;
  Dual3 in_world(const Dual2& body) const;
  // Unit vector in {B} at the start of the leg toward the bevel's side, halfway through the leg's own rotation: the
  // heading turns toward body -y for k > 0.
  Dual2 toward_bevel() const;
};

struct EntryPose {
  Dual tilt_x_rad, tilt_y_rad;  // rotation vector of the heading
  Dual roll_rad;                // about the heading, after the tilt
};

using Parameters = std::span<const Dual>;

// What an effect does not know of itself, over one leg: variance of the pose as a body perturbation, mm^2 | rad^2.
using Spread = std::array<double, 6>;

struct EffectDescription {
  std::string_view name;     // a contract: verdict.json, model.toml
  std::string_view meaning;  // one clause for the report: what is going on in the rig
  Covariate covariate;
  std::vector<EffectParameter> parameters;
  bool of_headings = false;  // no position shows it, only a measured heading
  /// The effect acts where the insertion changes direction. Without a retraction it is an offset of the depth.
  bool needs_retraction = false;
  // Within hundredths of a millimetre of the base: its own error decides which reading still is before, which after.
  bool sudden = false;
};

class Effect {
 public:
  explicit Effect(EffectDescription description) : description_(std::move(description)) {}
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;
  virtual ~Effect() = default;

  std::string_view name() const { return description_.name; }
  std::string_view meaning() const { return description_.meaning; }
  Covariate covariate() const { return description_.covariate; }
  const std::vector<EffectParameter>& parameters() const { return description_.parameters; }
  bool of_headings() const { return description_.of_headings; }
  bool needs_retraction() const { return description_.needs_retraction; }
  bool sudden() const { return description_.sudden; }

  virtual void change_needle(NeedleParameters&) const {}
  virtual void enter(Parameters, EntryPose&) const {}
  // Positions of the tip's axes at the end of the leg; come in as those of the base.
  virtual void axes(Parameters, const LegView&, EffectMemory&, Dual& /*insertion_mm*/, Dual& /*rotation_rad*/) const {}
  // Curvature in {B} over the leg; comes in as (k, 0).
  virtual void curvature(Parameters, const LegView&, EffectMemory&, Dual2& /*kappa_per_mm*/) const {}
  // After the leg has been integrated: memory that an offset needs. leg.R is still that of its start.
  virtual void settle(Parameters, const LegView&, EffectMemory&) const {}
  // Moves the point that the cameras see, in {A}.
  virtual void offset(Parameters, const EffectMemory&, double /*time_s*/, Dual3& /*position_mm*/) const {}
  // What the cameras make of the point.
  virtual void camera(Parameters, Dual3& /*position_mm*/) const {}
  // Rotation vector about x and y of {B} by which the sensor of the heading, or what it sits in, is askew.
  virtual void sensor(Parameters, const EffectMemory&, Dual2& /*tilt_rad*/) const {}
  // What a turned frame makes of a direction.
  virtual void frame(Parameters, Dual3& /*direction*/) const {}
  // The reading shows the needle as it was so much earlier.
  virtual Dual latency_s(Parameters) const { return {}; }

  // After settle: adds what is not known of the effect, as independent from leg to leg as makes the sum right.
  virtual void spread(const LegView&, const EffectMemory&, Spread&) const {}
  // Adds the variance of the offset in one reading, along the axes of {A}; neighbouring readings share the error.
  virtual void blur(const EffectMemory&, std::array<double, 3>& /*variance_mm2*/) const {}

  // Whether readings jump at the instant of one of its kinds, so that no derivative says where it is.
  virtual bool jumps(std::uint32_t /*kind*/) const { return false; }
  // Which parameters are fitted together: bit i for parameter i. More than one where the effect comes in kinds.
  virtual std::span<const std::uint32_t> variants() const;

 private:
  EffectDescription description_;
};

// Every effect there is, in the order in which they act.
std::span<const Effect* const> all_effects();
// Null if there is none of that name.
const Effect* find_effect(std::string_view name);

// First parameter outside its bounds, or not finite: index, or -1.
int find_parameter_violation(const Effect& effect, std::span<const double> values);

}  // namespace bevel::model
