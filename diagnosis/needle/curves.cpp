#include "diagnosis/needle/curves.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "diagnosis/needle/covariates.hpp"

namespace bevel::diagnosis {
namespace {

using model::Covariate;
using model::Dual;
using model::Dual2;
using model::Dual3;
using model::EffectMemory;
using model::LegView;
using model::Parameters;

constexpr int kValues = 8;                // of a curve
constexpr double kLeastVariation = 0.05;  // of a covariate, in its unit
constexpr double kLeastRoll_rad = 0.2;

struct ComponentInfo {
  Component component;
  const char* name;
  const char* unit;
};
constexpr std::array<ComponentInfo, 11> kComponents = {
    {{Component::curvature_bevel, "curvature toward the bevel", "1/mm"},
     {Component::curvature_across, "curvature across the bevel", "1/mm"},
     {Component::advance, "advance of the tip", "mm per mm"},
     {Component::turning, "turning of the tip", "rad per mm"},
     {Component::advance_turning, "advance of the tip with turning", "mm per rad"},
     {Component::turning_turning, "turning of the tip with turning", "rad per rad"},
     {Component::drift_bevel, "sideways drift toward the bevel", "mm per mm"},
     {Component::drift_across, "sideways drift across the bevel", "mm per mm"},
     {Component::x, "reading along x", "mm"},
     {Component::y, "reading along y", "mm"},
     {Component::z, "reading along z", "mm"}}};
constexpr std::array kCovariates = {Covariate::time_s,          Covariate::depth_mm,     Covariate::speed_mm_s,
                                    Covariate::turn_rate_rad_s, Covariate::since_stop_s, Covariate::since_reversal_mm,
                                    Covariate::roll_rad};
constexpr std::array<const char*, kValuesOfPart> kNames = {"a", "b", "c", "d"};

model::EffectDescription description(Covariate covariate) {
  model::EffectDescription out{
      .name = "discrepancy", .meaning = "a discrepancy without a name", .covariate = covariate, .parameters = {}};
  for (const char* name : kNames)
    out.parameters.push_back({.name = name, .lower = -1e3, .upper = 1e3, .none = 0, .starts = {0.0}});
  return out;
}

class CurvePart final : public model::Effect {
 public:
  CurvePart(const NeedleCurve& curve, std::size_t first)
      : Effect(description(curve.covariate)), component_(curve.component), curve_(curve.curve), first_(first) {}

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& rotation_rad) const override {
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
  void curvature(Parameters p, const LegView& leg, EffectMemory& memory, Dual2& kappa_per_mm) const override {
    if (component_ == Component::curvature_bevel) kappa_per_mm[0] += value(p, leg, memory);
    if (component_ == Component::curvature_across) kappa_per_mm[1] += value(p, leg, memory);
  }
  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override {
    if (component_ == Component::drift_bevel || component_ == Component::drift_across) {
      const Dual drift = value(p, leg, memory) * leg.insertion_mm;
      // Toward the bevel is body -y for k > 0.
      const Dual2 world = component_ == Component::drift_bevel ? leg.lateral_in_world({Dual(), -drift})
                                                               : leg.lateral_in_world({drift, Dual()});
      for (std::size_t i = 0; i < 2; ++i) memory.slot[i] += world[i];
    } else if (axis() >= 0) {
      memory.slot[0] = value(p, leg, memory);
    }
  }
  void offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/, Dual3& position_mm) const override {
    if (component_ == Component::drift_bevel || component_ == Component::drift_across)
      for (std::size_t i = 0; i < 2; ++i) position_mm[i] += memory.slot[i];
    else if (axis() >= 0)
      position_mm[static_cast<std::size_t>(axis())] += memory.slot[0];
  }

 private:
  int axis() const {
    return component_ >= Component::x ? static_cast<int>(component_) - static_cast<int>(Component::x) : -1;
  }
  // So much per mm or rad of the base, over all legs so far.
  const Dual& summed(Parameters p, const LegView& leg, EffectMemory& memory, double base) const {
    memory.slot[0] += value(p, leg, memory) * base;
    return memory.slot[0];
  }
  // slot[2] keeps what the covariate needs to remember.
  Dual value(Parameters p, const LegView& leg, EffectMemory& memory) const {
    // Kept in the third slot: its slope is no derivative here.
    double& stopped_s = memory.slot[2].value;
    double& turned_mm = memory.slot[2].slope[0];
    CovariateTracker tracker = memory.phase == 0 ? CovariateTracker(leg.entry) : CovariateTracker(stopped_s, turned_mm);
    tracker.advance(leg.from, leg.to);
    memory.phase = 1;
    stopped_s = tracker.stopped_s();
    turned_mm = tracker.turned_mm();
    const Eigen::VectorXd weights = weights_at(curve_, tracker[covariate()]);
    Dual sum;
    for (std::size_t i = 0; i < kValuesOfPart && first_ + i < curve_.at.size(); ++i)
      if (const double weight = weights[static_cast<Eigen::Index>(first_ + i)]; weight != 0) sum += p[i] * weight;
    return sum;
  }

  Component component_;
  inference::Curve curve_;
  std::size_t first_;
};

// Evenly over the middle 98 % of what the covariate takes; false if it hardly varies.
bool find_places(const std::vector<const model::Motion*>& motions, Covariate covariate, inference::Curve& curve) {
  std::vector<double> values;
  for (const model::Motion* motion : motions) {
    CovariateTracker tracker(motion->nodes.front());
    for (std::size_t i = 1; i < motion->nodes.size(); ++i) {
      tracker.advance(motion->nodes[i - 1], motion->nodes[i]);
      values.push_back(tracker[covariate]);
    }
  }
  std::sort(values.begin(), values.end());
  const double low = values[values.size() / 100];
  const double high = values[values.size() - 1 - values.size() / 100];
  curve.periodic = covariate == Covariate::roll_rad;
  if (!(high - low > (curve.periodic ? kLeastRoll_rad : kLeastVariation))) return false;
  for (int i = 0; i < kValues; ++i)
    curve.at.push_back(curve.periodic ? 2 * std::numbers::pi * i / kValues : low + (high - low) * i / (kValues - 1));
  return true;
}

}  // namespace

std::vector<NeedleCurve> find_curves(const std::vector<const model::Motion*>& motions) {
  std::vector<NeedleCurve> out;
  for (const Covariate covariate : kCovariates) {
    inference::Curve curve;
    if (!find_places(motions, covariate, curve)) continue;
    curve.covariate = model::name_of(covariate);
    for (const auto& info : kComponents) {
      curve.component = info.name;
      curve.unit = info.unit;
      out.push_back({info.component, covariate, curve});
    }
  }
  return out;
}

Eigen::VectorXd weights_at(const inference::Curve& curve, double x) {
  const std::size_t n = curve.at.size();
  Eigen::VectorXd out = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n));
  const auto at = [&](std::size_t i) -> double& { return out[static_cast<Eigen::Index>(i)]; };
  if (curve.periodic) {
    const double turns = x / (2 * std::numbers::pi);
    const double u = (turns - std::floor(turns)) * static_cast<double>(n);
    const auto i = std::min(static_cast<std::size_t>(u), n - 1);
    const double share = u - static_cast<double>(i);
    at(i) += 1 - share;
    at((i + 1) % n) += share;
  } else if (x <= curve.at.front()) {
    at(0) = 1;
  } else if (x >= curve.at.back()) {
    at(n - 1) = 1;
  } else {
    std::size_t i = 1;
    while (x > curve.at[i]) ++i;
    const double share = (x - curve.at[i - 1]) / (curve.at[i] - curve.at[i - 1]);
    at(i - 1) = 1 - share;
    at(i) = share;
  }
  return out;
}

std::unique_ptr<model::Effect> make_curve_part(const NeedleCurve& curve, std::size_t first) {
  return std::make_unique<CurvePart>(curve, first);
}

}  // namespace bevel::diagnosis
