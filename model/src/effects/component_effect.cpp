// SPDX-License-Identifier: MIT
#include <bevel/model/effects/component_effect.hpp>

#include <cmath>

namespace bevel::model {
namespace {

using Component = DiscrepancyComponent;

constexpr double kStep_mm = 1e-3;  // for a slope by differences: far below any length on which a tissue changes

constexpr std::array<DiscrepancyComponentInfo, 13> kComponents = {
    {{Component::curvature_bevel, "curvature_bevel", "curvature toward the bevel", "1/mm", 0.05},
     {Component::curvature_across, "curvature_across", "curvature across the bevel", "1/mm", 0.05},
     {Component::advance, "advance", "advance of the tip", "mm per mm", 5},
     {Component::turning, "turning", "turning of the tip", "rad per mm", 5},
     {Component::advance_turning, "advance_turning", "advance of the tip with turning", "mm per rad", 50},
     {Component::turning_turning, "turning_turning", "turning of the tip with turning", "rad per rad", 5},
     {Component::drift_bevel, "drift_bevel", "sideways drift toward the bevel", "mm per mm", 5},
     {Component::drift_across, "drift_across", "sideways drift across the bevel", "mm per mm", 5},
     {Component::pull_x, "pull_x", "sideways pull along x", "1/mm", 0.05},
     {Component::pull_y, "pull_y", "sideways pull along y", "1/mm", 0.05},
     {Component::x, "x", "reading along x", "mm", 100},
     {Component::y, "y", "reading along y", "mm", 100},
     {Component::z, "z", "reading along z", "mm", 100}}};

}  // namespace

std::span<const DiscrepancyComponentInfo> discrepancy_components() { return kComponents; }

const DiscrepancyComponentInfo& info_of(DiscrepancyComponent component) {
  return kComponents.at(static_cast<std::size_t>(component));
}

std::string_view unit_of(DiscrepancyComponent component, Covariate covariate) {
  return adds_up(covariate) ? "mm per mm/s" : info_of(component).unit;
}

std::optional<DiscrepancyComponent> find_discrepancy_component(std::string_view name) {
  for (const auto& info : kComponents)
    if (info.name == name) return info.component;
  return std::nullopt;
}

void ComponentEffect::axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
                           Dual& rotation_rad) const {
  switch (component_) {
    case Component::advance:
      insertion_mm += summed(p, leg, memory, leg.base_insertion_mm());
      break;
    case Component::turning:
      rotation_rad += summed(p, leg, memory, std::abs(leg.base_insertion_mm()));
      break;
    case Component::advance_turning:
      insertion_mm += summed(p, leg, memory, leg.base_rotation_rad());
      break;
    case Component::turning_turning:
      rotation_rad += summed(p, leg, memory, leg.base_rotation_rad());
      break;
    default:
      break;
  }
}

void ComponentEffect::curvature(Parameters p, const LegView& leg, EffectMemory& memory, Dual2& kappa_per_mm) const {
  if (component_ == Component::curvature_bevel) kappa_per_mm[0] += value(p, leg, memory);
  if (component_ == Component::curvature_across) kappa_per_mm[1] += value(p, leg, memory);
  if (!pulls()) return;
  const Dual2 pull = pull_in_body(leg, value(p, leg, memory));
  for (std::size_t i = 0; i < 2; ++i) kappa_per_mm[i] += pull[i];
}

Dual2 ComponentEffect::pull_in_body(const LegView& leg, const Dual& v) const {
  return leg.curvature_toward(component_ == Component::pull_x ? Dual2{v, Dual(0)} : Dual2{Dual(0), v});
}

void ComponentEffect::settle(Parameters p, const LegView& leg, EffectMemory& memory) const {
  if (drifts()) {
    const Dual drift = value(p, leg, memory) * leg.insertion_mm;
    // Toward the bevel is body -y for k > 0.
    const Dual2 world = component_ == Component::drift_bevel ? leg.lateral_in_world({Dual(), -drift})
                                                             : leg.lateral_in_world({drift, Dual()});
    for (std::size_t i = 0; i < 2; ++i) memory.slot[i] += world[i];
  } else if (axis() >= 0) {
    memory.slot[0] = value(p, leg, memory);
  }
}

void ComponentEffect::offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/,
                             Dual3& position_mm) const {
  if (drifts())
    for (std::size_t i = 0; i < 2; ++i) position_mm[i] += memory.slot[i];
  else if (axis() >= 0)
    position_mm[static_cast<std::size_t>(axis())] += memory.slot[0];
}

CovariateTracker ComponentEffect::tracked(const LegView& leg, const EffectMemory& memory) const {
  CovariateTracker tracker = memory.phase == 0
                                 ? CovariateTracker(leg.entry)
                                 : CovariateTracker(leg.entry, {memory.number[0], memory.number[1], memory.number[2],
                                                                memory.number[3], memory.number[4]});
  tracker.advance(leg.from, leg.to);
  return tracker;
}

Dual ComponentEffect::place_of(const CovariateTracker& tracker, const LegView& leg) const {
  if (const auto along = tip_direction(covariate()))
    return leg.tip_side_mm[0] * along->x() + leg.tip_side_mm[1] * along->y();
  return tracker[covariate()];
}

Dual ComponentEffect::place(const LegView& leg, const EffectMemory& memory) const {
  return place_of(tracked(leg, memory), leg);
}

Dual ComponentEffect::value(Parameters p, const LegView& leg, EffectMemory& memory) const {
  if (adds_up(covariate())) {
    Dual sum;
    for (std::size_t i = 0; i < kSpeedChanges; ++i)
      sum += leg.speed_changes_mm_s[i] * value_at(p, since_speed_change_s(i));
    return sum;
  }
  const CovariateTracker tracker = tracked(leg, memory);
  memory.phase = 1;
  const CovariateTracker::History& so_far = tracker.history();
  memory.number = {so_far.moved_s, so_far.turned_mm, so_far.deepest_mm, so_far.changed_s, so_far.speed_mm_s};
  const Dual at = place_of(tracker, leg);
  Dual out = value_at(p, at.value);
  // A subclass knows its value at a number and not its slope there.
  if (at.moves())
    out += (value_at(p, at.value + kStep_mm).value - value_at(p, at.value - kStep_mm).value) / (2 * kStep_mm) *
           (at - at.value);
  return out;
}

// So much per mm or rad of the base, over all legs so far.
const Dual& ComponentEffect::summed(Parameters p, const LegView& leg, EffectMemory& memory, double base) const {
  memory.slot[0] += value(p, leg, memory) * base;
  return memory.slot[0];
}

}  // namespace bevel::model
