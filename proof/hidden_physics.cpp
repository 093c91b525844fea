// SPDX-License-Identifier: MIT
#include "proof/hidden_physics.hpp"

#include <algorithm>
#include <numbers>

#include <bevel/error.hpp>

namespace bevel::proof {
namespace {

using namespace std::string_literals;
using P = HiddenPhysics;

ParameterRange size(const char* name, double P::*slot, double low, double high) {
  return {name, slot, low, high, false, true, 0};
}
ParameterRange signed_size(const char* name, double P::*slot, double low, double high) {
  return {name, slot, low, high, true, true, 0};
}
ParameterRange ratio(const char* name, double P::*slot, double low, double high) {
  return {name, slot, low, high, false, true, 1};
}
ParameterRange shape(const char* name, double P::*slot, double low, double high) {
  return {name, slot, low, high, false, false, 0};
}

std::vector<EffectKind> make_catalogue(int edition) {
  std::vector<EffectKind> all{
      {"rotation_backlash", true, {size("width_rad", &P::rotation_backlash_rad, 0.1, 0.6)}},
      {"torsional_windup", true, {size("lag_at_100mm_rad", &P::windup_lag_at_100mm_rad, 0.2, 0.9)}},
      {"insertion_backlash", true, {size("width_mm", &P::insertion_backlash_mm, 0.5, 2)}},
      {"insertion_scale", true, {ratio("ratio", &P::insertion_ratio, 0.85, 0.98)}},
      {"lost_steps", true, {signed_size("rotation_rad", &P::lost_rotation_rad, 0.3, 1.5)}},
      {"rate_dependence", true, {size("exponent", &P::rate_exponent, 0.05, 0.35)}},
      {"layer",
       true,
       {shape("depth_mm", &P::layer_depth_mm, 15, 45), ratio("curvature_ratio", &P::layer_ratio, 0.5, 1.8)}},
      {"depth_dependence", true, {signed_size("per_100mm", &P::curvature_per_100mm, 0.3, 0.8)}},
      {"drilling", true, {size("coefficient_mm_per_rad", &P::drilling_mm_per_rad, 0.5, 3)}},
      {"flip_transient", true, {size("length_mm", &P::flip_length_mm, 3, 14)}},
      {"relaxation",
       true,
       {size("amplitude_mm", &P::relaxation_mm, 0.5, 2), shape("tau_s", &P::relaxation_tau_s, 0.8, 8),
        shape("build_mm", &P::relaxation_build_mm, 2, 8)}},
      {"puncture",
       true,
       {shape("depth_mm", &P::puncture_depth_mm, 8, 40), size("indentation_mm", &P::indentation_mm, 1, 5)}},
      {"tissue_motion",
       true,
       {size("amplitude_mm", &P::motion_mm, 0.3, 3), shape("frequency_hz", &P::motion_hz, 0.18, 0.4),
        shape("direction_rad", &P::motion_direction_rad, 0, std::numbers::pi)}},
      {"lateral_bias",
       true,
       {signed_size("x_per_mm", &P::bias_x_per_mm, 0.0003, 0.0015),
        signed_size("y_per_mm", &P::bias_y_per_mm, 0.0003, 0.0015)}},
      {"bevel_offset", true, {signed_size("roll_rad", &P::bevel_offset_rad, 0.08, 0.6)}},
      {"entry_angle",
       true,
       {signed_size("about_x_rad", &P::entry_about_x_rad, 0.02, 0.06),
        signed_size("about_y_rad", &P::entry_about_y_rad, 0.02, 0.06)}},
      {"camera_latency", true, {size("latency_s", &P::latency_s, 0.03, 0.2)}},
      {"camera_scale", true, {ratio("ratio", &P::camera_ratio, 0.95, 1.05)}},
      {"camera_rotation", true, {signed_size("about_x_rad", &P::camera_about_x_rad, 0.01, 0.05)}},
      {"refraction",
       true,
       {size("coefficient", &P::refraction, 0.01, 0.04), shape("centre_mm", &P::refraction_centre_mm, 20, 50)}},
      {"slip_direction", true, {{"", &P::other_slip, 1, 1, false, false, 0}}},
      {"slow_slip", false, {size("growth_per_s", &P::slip_growth_per_s, 0.005, 0.04)}},
      {"curvature_drift", false, {signed_size("drift_per_s", &P::curvature_drift_per_s, 0.02, 0.08)}},
      {"roll_friction", false, {size("pull_rad", &P::roll_friction_rad, 0.15, 0.5)}},
      {"screw", false, {signed_size("lead_mm_per_rad", &P::screw_mm_per_rad, 0.1, 0.5)}},
      {"self_rotation", false, {signed_size("rate_rad_per_mm", &P::self_rotation_rad_per_mm, 0.003, 0.02)}},
      {"stick_slip", false, {size("jump_mm", &P::first_stick_slip_mm, 0.6, 2.5)}},
      {"camera_hysteresis", false, {signed_size("sag_mm", &P::camera_hysteresis_mm, 0.3, 1.5)}},
      {"camera_drift", false, {signed_size("rate_mm_per_s", &P::camera_drift_mm_per_s, 0.03, 0.2)}},
      {"fibres", false, {size("share", &P::fibre_share, 0.3, 0.9), shape("period_mm", &P::fibre_period_mm, 16, 30)}},
  };
  if (edition == 1) return all;
  const auto first = std::ranges::find_if(all, [](const EffectKind& kind) { return kind.name == "stick_slip"s; });
  // A jump of less than a third of a millimetre is, in these recordings, a play of that width.
  *first = {"stick_slip", true, {size("jump_mm", &P::stick_slip_mm, 0.6, 2.5)}, 0.5};
  all.insert(all.end(), {{"winding", false, {size("share_per_rad", &P::winding_per_rad, 0.05, 0.2)}},
                         {"side_gradient",
                          false,
                          {size("share_per_mm", &P::side_per_mm, 0.04, 0.12),
                           shape("direction_rad", &P::side_direction_rad, 0, 2 * std::numbers::pi)}},
                         {"axial_creep", false, {size("lag_at_100mm_mm", &P::creep_at_100mm_mm, 1.5, 5)}}});
  if (edition < 4) return all;
  all.insert(
      all.end(),
      {{"free_shaft_bow", false, {size("shortening_mm", &P::bow_mm, 0.6, 2.2)}},
       {"chuck_slip", false, {size("share_at_100mm", &P::chuck_slip_at_100mm, 0.08, 0.3)}},
       {"oblique_interface",
        false,
        {size("deflection_rad", &P::interface_rad, 0.015, 0.06), shape("depth_mm", &P::interface_depth_mm, 12, 40),
         shape("toward_rad", &P::interface_toward_rad, 0, 2 * std::numbers::pi)}},
       {"reloading",
        false,
        {size("share", &P::reloading_share, 0.3, 0.65), shape("tau_s", &P::reloading_tau_s, 0.8, 5),
         shape("length_mm", &P::reloading_length_mm, 6, 20)}},
       {"perspective",
        false,
        {signed_size("per_mm", &P::perspective_per_mm, 0.002, 0.005),
         shape("centre_mm", &P::perspective_centre_mm, 20, 50)}},
       {"stand_sway", false, {size("sway_mm", &P::sway_mm, 0.2, 0.8), shape("frequency_hz", &P::sway_hz, 1.2, 3)}}});
  return all;
}

double draw(const ParameterRange& range, Random& random) {
  const double value = random.uniform(range.low, range.high);
  return range.either_sign ? random.sign() * value : value;
}

// Between two fifths and four fifths of a recording: late enough to have depth, early enough to be seen.
std::vector<double> draw_instants(Random& random, const std::vector<AxisMotion>& motions) {
  std::vector<double> at_s(motions.size(), 0.0);
  for (std::size_t i = 0; i < at_s.size(); ++i)
    if (random.chance(0.45)) at_s[i] = random.uniform(0.2, 0.6) * motions[i].duration_s();
  if (std::ranges::all_of(at_s, [](double t) { return t == 0.0; })) at_s[3] = 0.35 * motions[3].duration_s();
  return at_s;
}

}  // namespace

const std::vector<EffectKind>& catalogue(int edition) {
  static const std::array<std::vector<EffectKind>, kEditions> all{make_catalogue(1), make_catalogue(2),
                                                                  make_catalogue(3), make_catalogue(4)};
  return all.at(static_cast<std::size_t>(edition - 1));
}

const std::vector<EffectKind>& needle_changes() {
  static const std::vector<EffectKind> all{
      {"curvature_per_mm", true, {signed_size("change_relative", &P::curvature_change, 0.1, 0.4)}},
      {"lambda1_per_rad", true, {size("change_per_rad", &P::lambda1_change_per_rad, 0.1, 0.4)}}};
  return all;
}

const EffectKind& kind_of(const ConcealedEffect& effect) {
  const std::string& wanted = effect.kind.empty() ? effect.name : effect.kind;
  for (const EffectKind& kind : needle_changes())
    if (kind.name == wanted) return kind;
  for (int edition = kEditions; edition > 0; --edition)
    for (const EffectKind& kind : catalogue(edition))
      if (kind.name == wanted && kind.listed == effect.kind.empty()) return kind;
  throw DomainError("effect \"" + wanted + "\" is not in the catalogue of the trial");
}

ConcealedEffect draw_effect(const EffectKind& kind, Random& random, const std::vector<AxisMotion>& motions) {
  ConcealedEffect effect{kind.listed ? kind.name : "unknown", kind.listed ? "" : kind.name, {}, {}};
  for (const ParameterRange& range : kind.parameters)
    if (range.name[0] != '\0') effect.parameters[range.name] = draw(range, random);
  if (effect.name == "layer" && std::abs(effect.parameters["curvature_ratio"] - 1) < 0.12)
    effect.parameters["curvature_ratio"] = 1 + 0.2 * random.sign();
  if (effect.name == "camera_scale" && std::abs(effect.parameters["ratio"] - 1) < 0.008)
    effect.parameters["ratio"] = 1 + 0.012 * random.sign();
  if (effect.name == "lost_steps") {
    effect.per_recording["at_s"] = draw_instants(random, motions);
    if (random.chance(0.3)) effect.parameters = {{"insertion_mm", random.sign() * random.uniform(0.8, 3)}};
  }
  if (effect.name == "tissue_motion") {
    std::vector<double>& phases = effect.per_recording["phase_rad"];
    for (std::size_t i = 0; i < motions.size(); ++i) phases.push_back(random.uniform(0, 2 * std::numbers::pi));
  }
  return effect;
}

ConcealedEffect scaled(const ConcealedEffect& effect, double factor) {
  ConcealedEffect result = effect;
  for (auto& [name, value] : result.parameters) {
    if (effect.name == "lost_steps") value *= factor;  // of either axis
    for (const ParameterRange& range : kind_of(effect).parameters)
      if (effect.name != "lost_steps" && range.is_size && name == range.name)
        value = range.neutral + factor * (value - range.neutral);
  }
  return result;
}

HiddenPhysics physics_of(const std::vector<ConcealedEffect>& effects, double departure) {
  HiddenPhysics physics;
  physics.departure = departure;
  for (const ConcealedEffect& effect : effects) {
    for (const ParameterRange& range : kind_of(effect).parameters) {
      const auto value = effect.parameters.find(range.name);
      if (value != effect.parameters.end()) physics.*range.slot = value->second;
    }
    if (effect.name == "slip_direction") physics.other_slip = 1;
    if (effect.name == "lost_steps") {
      const auto insertion = effect.parameters.find("insertion_mm");
      if (insertion != effect.parameters.end()) physics.lost_insertion_mm = insertion->second;
      std::ranges::copy(effect.per_recording.at("at_s"), physics.lost_at_s.begin());
    }
    if (effect.name == "tissue_motion")
      std::ranges::copy(effect.per_recording.at("phase_rad"), physics.motion_phase_rad.begin());
  }
  return physics;
}

}  // namespace bevel::proof
