// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Effect in one component of the tip's motion or of the measurement, as a function v of one covariate c.
///
/// Over a leg the actuator moves by ds mm and dR rad (frames: bevel/model/kinematics.hpp). c is evaluated at the end of
/// the leg; a tip position is evaluated at its start.
///
/// | component | equation |
/// | --- | --- |
/// | curvature_bevel | kappa_x += v |
/// | curvature_across | kappa_y += v |
/// | advance | ds_tip += v ds |
/// | advance_turning | ds_tip += v dR |
/// | turning | dR_tip += v abs(ds) |
/// | turning_turning | dR_tip += v dR |
/// | drift_bevel | the tip moves by v ds_tip toward body -y |
/// | drift_across | the tip moves by v ds_tip toward body x |
/// | pull_x, pull_y | the heading turns by v ds_tip toward +x, +y of {A}, independent of the bevel |
/// | x, y, z | the measurement changes by v |
///
/// Over Covariate::since_speed_change_s, v is the response to a change of the actuator velocity by 1 mm/s. A
/// measurement changes by the sum of all responses, which is the output of a linear filter (Pillonetto and De Nicolao
/// 2010, Automatica 46). Only the components x, y and z allow this covariate.
///
/// A subclass states v: a curve (discrepancy.hpp), or an equation that bevel-diagnose proposed
/// (docs/adding-an-effect.md).
#include <optional>

#include <bevel/model/effects/covariates.hpp>

namespace bevel::model {

/// Components of the tip's motion (up to pull_y) and of the measurement (x, y, z).
enum class DiscrepancyComponent {
  curvature_bevel,   ///< curvature toward the bevel, 1/mm
  curvature_across,  ///< curvature across the bevel, 1/mm
  advance,           ///< advance of the tip, mm per mm of insertion
  turning,           ///< rotation of the tip, rad per mm of insertion
  advance_turning,   ///< advance of the tip, mm per rad of rotation
  turning_turning,   ///< rotation of the tip, rad per rad of rotation
  drift_bevel,       ///< lateral drift toward the bevel, mm per mm
  drift_across,      ///< lateral drift across the bevel, mm per mm
  pull_x,            ///< turn of the heading toward +x of {A}, 1/mm
  pull_y,            ///< turn of the heading toward +y of {A}, 1/mm
  x,                 ///< measurement along x of {A}, mm
  y,                 ///< measurement along y of {A}, mm
  z                  ///< measurement along z of {A}, mm
};

/// Properties of a component.
struct DiscrepancyComponentInfo {
  DiscrepancyComponent component;  ///< component
  std::string_view name;           ///< identifier; part of the format of model.toml
  std::string_view meaning;        ///< description for a report
  std::string_view unit;           ///< unit of the values
  double largest;                  ///< largest allowed magnitude of a value, in that unit
};
/// Lists the properties of all components.
/// @return one element per component in the order of the enumeration; static storage
std::span<const DiscrepancyComponentInfo> discrepancy_components();
/// Returns the properties of a component.
/// @param component component
/// @return the properties; static storage
const DiscrepancyComponentInfo& info_of(DiscrepancyComponent component);
/// Returns the unit of v for a component and a covariate.
/// @param component component
/// @param covariate covariate
/// @return "mm per mm/s" for Covariate::since_speed_change_s, otherwise DiscrepancyComponentInfo::unit
std::string_view unit_of(DiscrepancyComponent component, Covariate covariate);
/// Checks whether a component is one of the measurement.
/// @param component component
/// @return true for x, y and z
inline bool is_reading(DiscrepancyComponent component) { return component >= DiscrepancyComponent::x; }
/// Checks whether a component can depend on a covariate.
/// @param component component
/// @param covariate covariate
/// @return false for a component of the motion over Covariate::since_speed_change_s, otherwise true
inline bool goes_over(DiscrepancyComponent component, Covariate covariate) {
  return is_reading(component) || !adds_up(covariate);
}
/// Finds a component by its name.
/// @param name identifier, for example "pull_x"
/// @return the component; empty if no component has that name
std::optional<DiscrepancyComponent> find_discrepancy_component(std::string_view name);

/// Effect in one component as a function of one covariate. A subclass implements value_at().
class ComponentEffect : public Effect {
 public:
  /// Stores the component and the description.
  /// @param component component that the effect changes
  /// @param description static properties; its covariate is the argument of v
  ComponentEffect(DiscrepancyComponent component, EffectDescription description)
      : Effect(std::move(description)), component_(component) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& rotation_rad) const override;
  void curvature(Parameters p, const LegView& leg, EffectMemory& memory, Dual2& kappa_per_mm) const override;
  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override;
  void offset(Parameters p, const EffectMemory& memory, double time_s, Dual3& position_mm) const override;

 protected:
  /// Evaluates v.
  /// @param p parameters of the effect
  /// @param place value of the covariate, in its unit
  /// @return v in the unit of unit_of(), with sensitivities to the parameters only
  virtual Dual value_at(Parameters p, double place) const = 0;

  /// @return the component that the effect changes
  DiscrepancyComponent component() const { return component_; }
  /// @return true for drift_bevel and drift_across
  bool drifts() const {
    return component_ == DiscrepancyComponent::drift_bevel || component_ == DiscrepancyComponent::drift_across;
  }
  /// @return true for pull_x and pull_y
  bool pulls() const {
    return component_ == DiscrepancyComponent::pull_x || component_ == DiscrepancyComponent::pull_y;
  }
  /// Computes the curvature of a pull.
  /// @param leg leg
  /// @param v turn of the heading toward the axis of the component in {A}, 1/mm
  /// @return (kappa_x, kappa_y) in {B}, 1/mm
  Dual2 pull_in_body(const LegView& leg, const Dual& v) const;
  /// Returns the axis of the measurement. An effect in x, y or z stores v in EffectMemory::slot[0].
  /// @return 0, 1 or 2 for x, y or z; -1 for a component of the motion
  int axis() const {
    return is_reading(component_) ? static_cast<int>(component_) - static_cast<int>(DiscrepancyComponent::x) : -1;
  }
  /// Evaluates the covariate for a leg. The result is the same before and after value() for that leg.
  /// @param leg leg
  /// @param memory memory of this effect
  /// @return value of the covariate, in its unit
  Dual place(const LegView& leg, const EffectMemory& memory) const;

 private:
  Dual place_of(const CovariateTracker& tracker, const LegView& leg) const;
  CovariateTracker tracked(const LegView& leg, const EffectMemory& memory) const;
  Dual value(Parameters p, const LegView& leg, EffectMemory& memory) const;
  const Dual& summed(Parameters p, const LegView& leg, EffectMemory& memory, double base) const;

  DiscrepancyComponent component_;
};

}  // namespace bevel::model
