#include "diagnosis/mismatch/corrections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace bevel::diagnosis {
namespace {

using model::Covariate;
using model::Dual;
using model::Dual2;
using model::Dual3;
using model::EffectMemory;
using model::LegView;
using model::Parameters;

constexpr int kKnots = 4;
using Knots = std::array<double, kKnots>;
constexpr double kMoving_mm_s = 0.05;
constexpr double kTurning_rad_s = 0.02;

enum class Component {
  curvature_bevel,
  curvature_across,
  advance,
  turning,
  advance_turning,
  turning_turning,
  drift_bevel,
  drift_across,
  x,
  y,
  z
};

struct ComponentInfo {
  Component component;
  const char* name;
  const char* unit;
  double start;  // a size that would show
};
constexpr std::array<ComponentInfo, 11> kComponents = {
    {{Component::curvature_bevel, "curvature toward the bevel", "1/mm", 2e-4},
     {Component::curvature_across, "curvature across the bevel", "1/mm", 2e-4},
     {Component::advance, "advance of the tip", "mm per mm", 0.01},
     {Component::turning, "turning of the tip", "rad per mm", 0.003},
     {Component::advance_turning, "advance of the tip with turning", "mm per rad", 0.03},
     {Component::turning_turning, "turning of the tip with turning", "rad per rad", 0.01},
     {Component::drift_bevel, "sideways drift toward the bevel", "mm per mm", 0.003},
     {Component::drift_across, "sideways drift across the bevel", "mm per mm", 0.003},
     {Component::x, "reading along x", "mm", 0.1},
     {Component::y, "reading along y", "mm", 0.1},
     {Component::z, "reading along z", "mm", 0.1}}};
constexpr std::array kCovariates = {Covariate::time_s,          Covariate::depth_mm,     Covariate::speed_mm_s,
                                    Covariate::turn_rate_rad_s, Covariate::since_stop_s, Covariate::since_reversal_mm,
                                    Covariate::roll_rad};

constexpr std::array<const char*, kKnots> kKnotNames = {"knot1", "knot2", "knot3", "knot4"};

model::EffectDescription description(const std::string& name, const ComponentInfo& component, Covariate covariate) {
  model::EffectDescription out{
      .name = name, .meaning = "an effect that is not in the library", .covariate = covariate, .parameters = {}};
  for (const char* knot : kKnotNames)
    out.parameters.push_back({.name = knot, .lower = -1e3, .upper = 1e3, .none = 0, .starts = {component.start}});
  return out;
}

class CorrectionEffect final : public model::Effect {
 public:
  CorrectionEffect(const std::string& name, const ComponentInfo& component, Covariate covariate, const Knots& knots)
      : Effect(description(name, component, covariate)), info_(component), knots_(knots) {}

  const ComponentInfo& info() const { return info_; }
  const Knots& knots() const { return knots_; }

  void axes(Parameters p, const LegView& leg, EffectMemory& memory, Dual& insertion_mm,
            Dual& rotation_rad) const override {
    switch (info_.component) {
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
    if (info_.component == Component::curvature_bevel) kappa_per_mm[0] += line(p, covariate_of(leg, memory));
    if (info_.component == Component::curvature_across) kappa_per_mm[1] += line(p, covariate_of(leg, memory));
  }
  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override {
    if (info_.component == Component::drift_bevel || info_.component == Component::drift_across) {
      const Dual drift = line(p, covariate_of(leg, memory)) * leg.insertion_mm;
      // Toward the bevel is body -y for k > 0.
      const Dual2 world = info_.component == Component::drift_bevel ? leg.lateral_in_world({Dual(), -drift})
                                                                    : leg.lateral_in_world({drift, Dual()});
      for (std::size_t i = 0; i < 2; ++i) memory.slot[i] += world[i];
    } else if (axis() >= 0) {
      memory.slot[0] = line(p, covariate_of(leg, memory));
    }
  }
  void offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/, Dual3& position_mm) const override {
    if (info_.component == Component::drift_bevel || info_.component == Component::drift_across)
      for (std::size_t i = 0; i < 2; ++i) position_mm[i] += memory.slot[i];
    else if (axis() >= 0)
      position_mm[static_cast<std::size_t>(axis())] += memory.slot[0];
  }

 private:
  int axis() const {
    return info_.component >= Component::x ? static_cast<int>(info_.component) - static_cast<int>(Component::x) : -1;
  }
  // So much per mm or rad of the base, over all legs so far.
  const Dual& summed(Parameters p, const LegView& leg, EffectMemory& memory, double base) const {
    memory.slot[0] += line(p, covariate_of(leg, memory)) * base;
    return memory.slot[0];
  }
  // slot[2] keeps where the tip last stopped or last turned.
  double covariate_of(const LegView& leg, EffectMemory& memory) const {
    double& since = memory.slot[2].value;
    switch (covariate()) {
      case Covariate::time_s:
        return leg.to.time_s;
      case Covariate::depth_mm:
        return leg.to.insertion_mm;
      case Covariate::speed_mm_s:
        return leg.speed_mm_s();
      case Covariate::turn_rate_rad_s:
        return leg.turn_rate_rad_s();
      case Covariate::since_stop_s:
        if (leg.speed_mm_s() > kMoving_mm_s) since = leg.to.time_s;
        return leg.to.time_s - since;
      case Covariate::since_reversal_mm:
        if (leg.turn_rate_rad_s() > kTurning_rad_s) since = leg.to.insertion_mm;
        return leg.to.insertion_mm - since;
      case Covariate::roll_rad:
        return leg.to.rotation_rad;
    }
    return 0;
  }
  // The broken line through the knots, flat outside; round the circle for the roll.
  Dual line(Parameters p, double x) const {
    if (covariate() == Covariate::roll_rad) {
      const double turns = x / (2 * std::numbers::pi);
      const double u = (turns - std::floor(turns)) * kKnots;
      const auto i = std::min<std::size_t>(static_cast<std::size_t>(u), kKnots - 1);
      const double share = u - static_cast<double>(i);
      return p[i] * (1 - share) + p[(i + 1) % kKnots] * share;
    }
    if (x <= knots_.front()) return p[0];
    for (std::size_t i = 1; i < kKnots; ++i)
      if (x <= knots_[i]) {
        const double share = (x - knots_[i - 1]) / (knots_[i] - knots_[i - 1]);
        return p[i - 1] * (1 - share) + p[i] * share;
      }
    return p[kKnots - 1];
  }

  ComponentInfo info_;
  Knots knots_;
};

// Evenly over the middle 98 % of what the covariate takes; false if it hardly varies.
bool find_knots(const RecordedCase& recorded, Covariate covariate, Knots& knots) {
  std::vector<double> values;
  for (const auto& recording : recorded.recordings)
    for (const auto& at : find_covariates(recording.motion)) values.push_back(at[covariate]);
  std::sort(values.begin(), values.end());
  const double low = values[values.size() / 100];
  const double high = values[values.size() - 1 - values.size() / 100];
  if (covariate == Covariate::roll_rad) {
    if (high - low < 0.2) return false;
    for (std::size_t i = 0; i < kKnots; ++i) knots[i] = 2 * std::numbers::pi * static_cast<double>(i) / kKnots;
    return true;
  }
  if (!(high - low > 0.05)) return false;
  for (std::size_t i = 0; i < kKnots; ++i) knots[i] = low + (high - low) * static_cast<double>(i) / (kKnots - 1);
  return true;
}

}  // namespace

CorrectionLibrary::CorrectionLibrary(const RecordedCase& recorded) {
  for (const Covariate covariate : kCovariates) {
    Knots knots{};
    if (!find_knots(recorded, covariate, knots)) continue;
    for (const auto& component : kComponents) {
      names_.push_back("correction of the " + std::string(component.name) + " by " +
                       std::string(model::name_of(covariate)));
      effects_.push_back(std::make_unique<CorrectionEffect>(names_.back(), component, covariate, knots));
    }
  }
}

std::vector<Member> CorrectionLibrary::members() const {
  std::vector<Member> members;
  for (const auto& effect : effects_) members.push_back({effect.get(), ~0U});
  return members;
}

Correction CorrectionLibrary::describe(const Fit& fit, std::size_t member) const {
  const auto& effect = dynamic_cast<const CorrectionEffect&>(*fit.hypothesis.set()[member].effect);
  const Eigen::MatrixXd covariance = fit.covariance();
  Correction out;
  out.component = effect.info().name;
  out.unit = effect.info().unit;
  out.covariate = model::name_of(effect.covariate());
  for (std::size_t i = 0; i < kKnots; ++i) {
    const int unknown = fit.hypothesis.find(member, i);
    out.at.push_back(effect.knots()[i]);
    out.values.push_back(fit.values[unknown]);
    out.std_errors.push_back(std::sqrt(covariance(unknown, unknown)));
  }
  return out;
}

bool is_correction(const Member& member) { return dynamic_cast<const CorrectionEffect*>(member.effect) != nullptr; }

}  // namespace bevel::diagnosis
