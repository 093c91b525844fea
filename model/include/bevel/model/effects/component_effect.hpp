// SPDX-License-Identifier: MIT
#pragma once
// An effect in one component of the tip's motion or of the reading, as a function v of one covariate c. Over a leg in
// which the base moves by ds mm and dR rad (frames: bevel/model/kinematics.hpp), c at its end, but the tip's place at
// its start:
//   curvature_bevel  kappa_x += v     curvature_across  kappa_y += v
//   advance          ds_tip += v ds   advance_turning   ds_tip += v dR
//   turning          dR_tip += v |ds| turning_turning   dR_tip += v dR
//   drift_bevel, drift_across         the tip is carried aside by v ds_tip, toward body -y, toward body x
//   pull_x, pull_y   the heading turns toward +x_A, +y_A by v ds_tip, wherever the bevel points
//   x, y, z          the reading is off by v
// Over the time since a change of the base's speed v is what a change by 1 mm/s brings, and a reading is off by what
// all of them still do: the response of a linear filter (Pillonetto and De Nicolao 2010, Automatica 46). Only readings
// are.
//
// A subclass states v: a curve (discrepancy.hpp), or an equation that bevel-diagnose proposed
// (docs/adding-an-effect.md).
#include <optional>

#include <bevel/model/effects/covariates.hpp>

namespace bevel::model {

enum class DiscrepancyComponent {
  curvature_bevel,
  curvature_across,
  advance,
  turning,
  advance_turning,
  turning_turning,
  drift_bevel,
  drift_across,
  pull_x,
  pull_y,
  x,
  y,
  z
};

struct DiscrepancyComponentInfo {
  DiscrepancyComponent component;
  std::string_view name;     // a contract: model.toml
  std::string_view meaning;  // for a report
  std::string_view unit;     // of the values
  double largest;            // magnitude of a value; beyond it is a mistake
};
// In the order of the enumeration.
std::span<const DiscrepancyComponentInfo> discrepancy_components();
const DiscrepancyComponentInfo& info_of(DiscrepancyComponent component);
// Of v over such a covariate.
std::string_view unit_of(DiscrepancyComponent component, Covariate covariate);
inline bool is_reading(DiscrepancyComponent component) { return component >= DiscrepancyComponent::x; }
// Whether there is such an effect.
inline bool goes_over(DiscrepancyComponent component, Covariate covariate) {
  return is_reading(component) || !adds_up(covariate);
}
// Nothing if there is none of that name.
std::optional<DiscrepancyComponent> find_discrepancy_component(std::string_view name);

class ComponentEffect : public Effect {
 public:
  // The covariate is the description's.
  ComponentEffect(DiscrepancyComponent component, EffectDescription description)
      : Effect(std::move(description)), component_(component) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& rotation_rad) const override;
  void curvature(Parameters p, const LegView& leg, EffectMemory& memory, Dual2& kappa_per_mm) const override;
  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override;
  void offset(Parameters p, const EffectMemory& memory, double time_s, Dual3& position_mm) const override;

 protected:
  // v, in the component's unit, at a place of the covariate, in its unit.
  virtual Dual value_at(Parameters p, double place) const = 0;

  DiscrepancyComponent component() const { return component_; }
  bool drifts() const {
    return component_ == DiscrepancyComponent::drift_bevel || component_ == DiscrepancyComponent::drift_across;
  }
  bool pulls() const {
    return component_ == DiscrepancyComponent::pull_x || component_ == DiscrepancyComponent::pull_y;
  }
  // Curvature in {B} of a pull of v.
  Dual2 pull_in_body(const LegView& leg, const Dual& v) const;
  // Of the reading, 0 to 2; -1 where the component is one of the motion. Such an effect keeps v in its first slot.
  int axis() const {
    return is_reading(component_) ? static_cast<int>(component_) - static_cast<int>(DiscrepancyComponent::x) : -1;
  }
  // Of the covariate. Before or after value(): the same leg twice changes nothing.
  Dual place(const LegView& leg, const EffectMemory& memory) const;

 private:
  Dual place_of(const CovariateTracker& tracker, const LegView& leg) const;
  CovariateTracker tracked(const LegView& leg, const EffectMemory& memory) const;
  Dual value(Parameters p, const LegView& leg, EffectMemory& memory) const;
  const Dual& summed(Parameters p, const LegView& leg, EffectMemory& memory, double base) const;

  DiscrepancyComponent component_;
};

}  // namespace bevel::model
