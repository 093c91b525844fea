#include "model/effects/discrepancy.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "model/effects/covariates.hpp"

namespace bevel::model {
namespace {

using Component = DiscrepancyComponent;

constexpr double kCircleTolerance_rad = 1e-6;

constexpr std::array<DiscrepancyComponentInfo, 11> kComponents = {
    {{Component::curvature_bevel, "curvature_bevel", "curvature toward the bevel", "1/mm", 0.05},
     {Component::curvature_across, "curvature_across", "curvature across the bevel", "1/mm", 0.05},
     {Component::advance, "advance", "advance of the tip", "mm per mm", 5},
     {Component::turning, "turning", "turning of the tip", "rad per mm", 5},
     {Component::advance_turning, "advance_turning", "advance of the tip with turning", "mm per rad", 50},
     {Component::turning_turning, "turning_turning", "turning of the tip with turning", "rad per rad", 5},
     {Component::drift_bevel, "drift_bevel", "sideways drift toward the bevel", "mm per mm", 5},
     {Component::drift_across, "drift_across", "sideways drift across the bevel", "mm per mm", 5},
     {Component::x, "x", "reading along x", "mm", 100},
     {Component::y, "y", "reading along y", "mm", 100},
     {Component::z, "z", "reading along z", "mm", 100}}};

constexpr std::array<const char*, kKnotsOfPart> kNames = {"a", "b", "c", "d"};

EffectDescription description(const DiscrepancyCurve& curve) {
  EffectDescription out{
      .name = "discrepancy", .meaning = "a discrepancy without a name", .covariate = curve.covariate, .parameters = {}};
  for (const char* name : kNames)
    out.parameters.push_back({.name = name, .lower = -1e3, .upper = 1e3, .none = 0, .starts = {0.0}});
  return out;
}

class Discrepancy final : public Effect {
 public:
  Discrepancy(DiscrepancyCurve curve, std::size_t first)
      : Effect(description(curve)), curve_(std::move(curve)), component_(curve_.component), first_(first) {}

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
    if (drifts()) {
      const Dual drift = value(p, leg, memory) * leg.insertion_mm;
      // Toward the bevel is body -y for k > 0.
      const Dual2 world = component_ == Component::drift_bevel ? leg.lateral_in_world({Dual(), -drift})
                                                               : leg.lateral_in_world({drift, Dual()});
      for (std::size_t i = 0; i < 2; ++i) memory.slot[i] += world[i];
    } else if (axis() >= 0) {
      memory.slot[0] = value(p, leg, memory);
      memory.slot[1].value = std_error(place(leg, memory));  // for blur
    }
  }
  void offset(Parameters /*p*/, const EffectMemory& memory, double /*time_s*/, Dual3& position_mm) const override {
    if (drifts())
      for (std::size_t i = 0; i < 2; ++i) position_mm[i] += memory.slot[i];
    else if (axis() >= 0)
      position_mm[static_cast<std::size_t>(axis())] += memory.slot[0];
  }
  void spread(const LegView& leg, const EffectMemory& memory, Spread& variance) const override {
    static constexpr std::array<int, 8> kRow = {3, 4, 2, 5, 2, 5, 1, 0};  // of the body's twist, by component
    if (axis() >= 0) return;
    const bool by_turning = component_ == Component::advance_turning || component_ == Component::turning_turning;
    const double entry = by_turning ? leg.entry.rotation_rad : leg.entry.insertion_mm;
    const double from = by_turning ? leg.from.rotation_rad : leg.from.insertion_mm;
    const double to = by_turning ? leg.to.rotation_rad : leg.to.insertion_mm;
    const KnotWeights at = place(leg, memory);
    const double error = std_error(at), step = std::abs(to - from);
    // Legs between the same two knots share their error: over a length h of base motion from one knot to the next it
    // adds up to error^2 h^2, and to no more than error^2 (all the way so far)^2 where the covariate stands still.
    const double together = std::min(length_of(at, leg, step), std::abs(from + to - 2 * entry));
    const double added = error * error * together * step;
    const int row = kRow.at(static_cast<std::size_t>(component_));
    variance[static_cast<std::size_t>(row)] += added;
    // Who is further in has bent further too.
    if (row == 2) variance[3] += added * leg.curvature_per_mm.value * leg.curvature_per_mm.value;
  }
  void blur(const EffectMemory& memory, std::array<double, 3>& variance_mm2) const override {
    if (axis() >= 0) variance_mm2[static_cast<std::size_t>(axis())] += memory.slot[1].value * memory.slot[1].value;
  }

 private:
  bool drifts() const { return component_ == Component::drift_bevel || component_ == Component::drift_across; }
  int axis() const {
    return component_ >= Component::x ? static_cast<int>(component_) - static_cast<int>(Component::x) : -1;
  }
  // So much per mm or rad of the base, over all legs so far.
  const Dual& summed(Parameters p, const LegView& leg, EffectMemory& memory, double base) const {
    memory.slot[0] += value(p, leg, memory) * base;
    return memory.slot[0];
  }
  // The third slot keeps what the covariate needs to remember, of which no covariate needs both.
  CovariateTracker tracked(const LegView& leg, const EffectMemory& memory) const {
    const double kept = memory.slot[2].value;
    CovariateTracker tracker = memory.phase == 0 ? CovariateTracker(leg.entry) : CovariateTracker(kept, kept);
    tracker.advance(leg.from, leg.to);
    return tracker;
  }
  // Before or after value(): the same leg twice changes nothing.
  KnotWeights place(const LegView& leg, const EffectMemory& memory) const {
    return weights_at(curve_.at, curve_.periodic, tracked(leg, memory)[covariate()]);
  }
  double std_error(const KnotWeights& at) const {
    return at.weight[0] * curve_.std_errors[at.knot[0]] + at.weight[1] * curve_.std_errors[at.knot[1]];
  }
  // Base motion from one knot to the next, where a leg of so much moves the covariate as this one does.
  double length_of(const KnotWeights& at, const LegView& leg, double step) const {
    constexpr double kEndless = std::numeric_limits<double>::infinity();
    if (at.knot[0] == at.knot[1]) return kEndless;
    const double spacing = curve_.periodic ? 2 * std::numbers::pi / static_cast<double>(curve_.at.size())
                                           : curve_.at[at.knot[1]] - curve_.at[at.knot[0]];
    double moved = 0;
    switch (covariate()) {
      case Covariate::time_s:
      case Covariate::since_stop_s:
        moved = leg.duration_s();
        break;
      case Covariate::depth_mm:
      case Covariate::since_reversal_mm:
        moved = std::abs(leg.base_insertion_mm());
        break;
      case Covariate::roll_rad:
        moved = std::abs(leg.base_rotation_rad());
        break;
      case Covariate::speed_mm_s:
      case Covariate::turn_rate_rad_s:
        break;
    }
    return moved > 0 ? spacing * step / moved : kEndless;
  }
  Dual value(Parameters p, const LegView& leg, EffectMemory& memory) const {
    const CovariateTracker tracker = tracked(leg, memory);
    memory.phase = 1;
    memory.slot[2].value = covariate() == Covariate::since_stop_s ? tracker.stopped_s() : tracker.turned_mm();
    const KnotWeights at = weights_at(curve_.at, curve_.periodic, tracker[covariate()]);
    Dual sum;
    for (std::size_t i = 0; i < 2; ++i) {
      if (at.weight[i] == 0) continue;
      sum.value += at.weight[i] * curve_.values[at.knot[i]];
      if (at.knot[i] >= first_ && at.knot[i] < first_ + kKnotsOfPart) sum += p[at.knot[i] - first_] * at.weight[i];
    }
    return sum;
  }

  DiscrepancyCurve curve_;
  Component component_;
  std::size_t first_;
};

std::string text(const char* format, double a, double b = 0, double c = 0) {
  std::array<char, 160> out{};
  std::snprintf(out.data(), out.size(), format, a, b, c);
  return out.data();
}

std::string fault_of_knots(const DiscrepancyCurve& curve) {
  const auto n = static_cast<double>(curve.at.size());
  for (std::size_t i = 0; i < curve.at.size(); ++i) {
    if (!std::isfinite(curve.at[i])) return text("knots: element %.0f is not finite", static_cast<double>(i));
    if (i > 0 && !(curve.at[i] > curve.at[i - 1]))
      return text("knots: element %.0f = %.9g does not lie above the one before, %.9g; they have to ascend",
                  static_cast<double>(i), curve.at[i], curve.at[i - 1]);
    const double even = 2 * std::numbers::pi * static_cast<double>(i) / n;
    if (curve.periodic && !(std::abs(curve.at[i] - even) < kCircleTolerance_rad))
      return text("knots: element %.0f = %.9g is not allowed; those of a periodic curve divide the circle: %.9g",
                  static_cast<double>(i), curve.at[i], even);
  }
  return "";
}

std::string fault_of_column(const char* name, const std::vector<double>& column, std::size_t knots, double lowest,
                            double highest) {
  if (column.size() != knots)
    return std::string(name) + text(" has %.0f elements; allowed: %.0f, one a knot", static_cast<double>(column.size()),
                                    static_cast<double>(knots));
  for (std::size_t i = 0; i < knots; ++i)
    if (!(column[i] >= lowest && column[i] <= highest))
      return std::string(name) + text(": element %.0f = %.9g is not allowed; ", static_cast<double>(i), column[i]) +
             text("allowed: from %.9g to %.9g", lowest, highest);
  return "";
}

}  // namespace

std::span<const DiscrepancyComponentInfo> discrepancy_components() { return kComponents; }

const DiscrepancyComponentInfo& info_of(DiscrepancyComponent component) {
  return kComponents.at(static_cast<std::size_t>(component));
}

std::optional<DiscrepancyComponent> find_discrepancy_component(std::string_view name) {
  for (const auto& info : kComponents)
    if (info.name == name) return info.component;
  return std::nullopt;
}

std::string find_fault(const DiscrepancyCurve& curve) {
  const std::size_t knots = curve.at.size();
  if (knots < 1 || knots > kMaxKnots)
    return text("knots has %.0f elements; allowed: from 1 to %.0f", static_cast<double>(knots),
                static_cast<double>(kMaxKnots));
  if (curve.periodic && curve.covariate != Covariate::roll_rad)
    return "periodic is true, but " + std::string(name_of(curve.covariate)) + " is no angle; allowed: with roll_rad";
  if (auto fault = fault_of_knots(curve); !fault.empty()) return fault;
  const double largest = info_of(curve.component).largest;
  if (auto fault = fault_of_column("values", curve.values, knots, -largest, largest); !fault.empty()) return fault;
  return fault_of_column("std_errors", curve.std_errors, knots, 0, largest);
}

KnotWeights weights_at(std::span<const double> at, bool periodic, double place) {
  const std::size_t n = at.size();
  if (periodic) {
    const double turns = place / (2 * std::numbers::pi);
    const double u = (turns - std::floor(turns)) * static_cast<double>(n);
    const auto i = std::min(static_cast<std::size_t>(u), n - 1);
    const double share = u - static_cast<double>(i);
    return {{i, (i + 1) % n}, {1 - share, share}};
  }
  if (place <= at.front()) return {{0, 0}, {1, 0}};
  if (place >= at.back()) return {{n - 1, n - 1}, {1, 0}};
  std::size_t i = 1;
  while (place > at[i]) ++i;
  const double share = (place - at[i - 1]) / (at[i] - at[i - 1]);
  return {{i - 1, i}, {1 - share, share}};
}

std::shared_ptr<const Effect> make_discrepancy(DiscrepancyCurve curve, std::size_t first) {
  if (const std::string fault = find_fault(curve); !fault.empty())
    throw std::invalid_argument("a discrepancy in " + std::string(info_of(curve.component).name) +
                                " has a fault: " + fault);
  return std::make_shared<Discrepancy>(std::move(curve), first);
}

ActiveEffect active_discrepancy(const DiscrepancyCurve& curve) {
  ActiveEffect out;
  out.owned = make_discrepancy(curve);
  out.effect = out.owned.get();
  return out;
}

}  // namespace bevel::model
