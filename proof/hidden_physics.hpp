// SPDX-License-Identifier: MIT
#pragma once
// Everything that a trial may conceal, in one structure with neutral defaults, and the catalogue from which trials
// draw.
//
// Ids and parameter names are those that verdict.json uses. The forms are this room's own: nothing here comes from the
// programs that are being tried. Each has a plain form, read from the definition of the effect, and a physical one in
// which edges are round, teeth give and friction is spread along the shaft; `departure` goes from the one (0) to the
// other (1).
#include <array>
#include <map>
#include <string>
#include <vector>

#include "proof/random.hpp"
#include "proof/script.hpp"

namespace bevel::proof {

struct HiddenPhysics {
  double departure = 1.0;  // 0 plain forms, 1 physical forms
  // Drive train
  double rotation_backlash_rad = 0;
  double windup_lag_at_100mm_rad = 0;
  double insertion_backlash_mm = 0;
  double insertion_ratio = 1;
  double lost_rotation_rad = 0;
  double lost_insertion_mm = 0;
  std::array<double, kRecordings> lost_at_s{};  // 0: not in this recording
  double bevel_offset_rad = 0;
  // Tissue and needle
  double rate_exponent = 0;
  double layer_depth_mm = 0;
  double layer_ratio = 1;
  double curvature_per_100mm = 0;
  double drilling_mm_per_rad = 0;
  double flip_length_mm = 0;
  double relaxation_mm = 0;
  double relaxation_tau_s = 1;
  double relaxation_build_mm = 3;
  double puncture_depth_mm = 0;
  double indentation_mm = 0;
  double stick_slip_mm = 0;
  double motion_mm = 0;
  double motion_hz = 0.25;
  double motion_direction_rad = 0;
  std::array<double, kRecordings> motion_phase_rad{};
  double bias_x_per_mm = 0;
  double bias_y_per_mm = 0;
  double entry_about_x_rad = 0;
  double entry_about_y_rad = 0;
  double curvature_change = 0;  // of the needle itself, between two groups: k times 1 + this
  double lambda1_change_per_rad = 0;
  double other_slip = 0;  // not 0: slip in the bevel plane although the model file says isotropic
  // Camera
  double latency_s = 0;
  double camera_ratio = 1;
  double camera_about_x_rad = 0;
  double refraction = 0;
  double refraction_centre_mm = 0;
  // On no list
  double slip_growth_per_s = 0;         // slow_slip: the shaft slips in its feeder, ever more
  double curvature_drift_per_s = 0;     // curvature_drift: the bevel dulls while it cuts
  double roll_friction_rad = 0;         // roll_friction: the tip's roll is led to preferred directions
  double screw_mm_per_rad = 0;          // screw: turning the shaft also feeds it
  double self_rotation_rad_per_mm = 0;  // self_rotation: the cut turns the tip
  double first_stick_slip_mm = 0;       // stick_slip of the first edition: holds, then jumps, but not when fed fast
  double camera_hysteresis_mm = 0;      // camera_hysteresis: the view sags with the tip's depth, and lags
  double camera_drift_mm_per_s = 0;     // camera_drift: the stand moves
  double fibre_share = 0;               // fibres: curvature alternates with depth
  double fibre_period_mm = 20;
  double winding_per_rad = 0;     // winding: tissue winds onto the shaft
  double side_per_mm = 0;         // side_gradient: tissue is stiffer to one side
  double side_direction_rad = 0;  // of that side, from x to y
  double creep_at_100mm_mm = 0;   // axial_creep: friction presses the shaft together, at rest it recovers
  // On no list, of the fourth edition
  double bow_mm = 0;                // free_shaft_bow: the shaft bows between its feeder and the entry
  double chuck_slip_at_100mm = 0;   // chuck_slip: the shaft slips in its chuck, the more the deeper it is turned
  double interface_rad = 0;         // oblique_interface: where two tissues meet askew the tip is led aside
  double interface_depth_mm = 0;    // on the insertion axis
  double interface_toward_rad = 0;  // from x to y: where the interface lies deeper, and the tip is led
  double reloading_share = 0;       // reloading: at rest tissue relaxes, the tip's load has to be cut up again
  double reloading_tau_s = 2;
  double reloading_length_mm = 8;
  double perspective_per_mm = 0;  // perspective: what comes nearer to a camera reads larger
  double perspective_centre_mm = 0;
  double sway_mm = 0;  // stand_sway: starts and stops shake the camera's stand; at a step of 10 mm/s
  double sway_hz = 2;
};

// One thing concealed, as the truth says it.
struct ConcealedEffect {
  std::string name;  // an id of the list, or "unknown"
  std::string kind;  // of an unknown one, else empty
  std::map<std::string, double> parameters;
  std::map<std::string, std::vector<double>> per_recording;  // at_s, phase_rad
};

struct ParameterRange {
  const char* name;
  double HiddenPhysics::*slot;
  double low;  // what the field reports
  double high;
  bool either_sign;
  bool is_size;    // scaled with the effect; a shape (a depth, a time constant) is not
  double neutral;  // value at which a size is no effect
};

struct EffectKind {
  const char* name;
  bool listed;  // false: `name` is the kind of an unknown effect
  std::vector<ParameterRange> parameters;
  double least_factor = 0.003;  // made smaller than this, of what is drawn, it would no longer be what it is called
};

// Of the distribution: the first is that of the campaigns up to the ninth. With the second stick_slip is on the list,
// and others take its place off it; with the third a beam's stiff shaft is, as tip_swing; the fourth has six more that
// are not.
inline constexpr int kEditions = 4;
inline constexpr int kBeamIsListed = 3;  // from this edition on
const std::vector<EffectKind>& catalogue(int edition = kEditions);
// What else may change between two groups of recordings: the needle's own parameters.
const std::vector<EffectKind>& needle_changes();
const EffectKind& kind_of(const ConcealedEffect& effect);  // throws DomainError for a name it does not hold

// Sizes as the field reports them; instants and phases for recordings of these durations.
ConcealedEffect draw_effect(const EffectKind& kind, Random& random, const std::vector<AxisMotion>& motions);
// The same effect with its sizes' distances from neutral multiplied by `factor`.
ConcealedEffect scaled(const ConcealedEffect& effect, double factor);
HiddenPhysics physics_of(const std::vector<ConcealedEffect>& effects, double departure);

}  // namespace bevel::proof
