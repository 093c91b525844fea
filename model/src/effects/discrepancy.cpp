// SPDX-License-Identifier: MIT
#include <bevel/model/effects/discrepancy.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include <bevel/error.hpp>

namespace bevel::model {
namespace {

using Component = DiscrepancyComponent;

constexpr double kCircleTolerance_rad = 1e-6;

constexpr std::array<const char*, kKnotsOfPart> kNames = {"a", "b", "c", "d"};

EffectDescription description(const DiscrepancyCurve& curve) {
  EffectDescription out{
      .name = "discrepancy", .meaning = "a discrepancy without a name", .covariate = curve.covariate, .parameters = {}};
  for (const char* name : kNames)
    out.parameters.push_back({.name = name, .lower = -1e3, .upper = 1e3, .none = 0, .starts = {0.0}});
  return out;
}

class Discrepancy final : public ComponentEffect {
 public:
  Discrepancy(DiscrepancyCurve curve, std::size_t first)
      : ComponentEffect(curve.component, description(curve)), curve_(std::move(curve)), first_(first) {}

  void settle(Parameters p, const LegView& leg, EffectMemory& memory) const override {
    ComponentEffect::settle(p, leg, memory);
    if (axis() >= 0) memory.slot[1].value = std_error(leg, memory);  // for blur
  }
  void spread(const LegView& leg, const EffectMemory& memory, Spread& variance) const override {
    static constexpr std::array<int, 8> kRow = {3, 4, 2, 5, 2, 5, 1, 0};  // of the body's twist, by component
    if (axis() >= 0) return;
    const bool by_turning = component() == Component::advance_turning || component() == Component::turning_turning;
    const double entry = by_turning ? leg.entry.rotation_rad : leg.entry.insertion_mm;
    const double from = by_turning ? leg.from.rotation_rad : leg.from.insertion_mm;
    const double to = by_turning ? leg.to.rotation_rad : leg.to.insertion_mm;
    const KnotWeights at = weights(leg, memory);
    const double error = std_error(at), step = std::abs(to - from);
    // Legs between the same two knots share their error: over a length h of base motion from one knot to the next it
    // adds up to error^2 h^2, and to no more than error^2 (all the way so far)^2 where the covariate stands still.
    const double together = std::min(length_of(at, leg, step), std::abs(from + to - 2 * entry));
    const double added = error * error * together * step;
    if (pulls()) {
      const Dual2 share = pull_in_body(leg, 1);
      for (std::size_t i = 0; i < 2; ++i) variance[3 + i] += added * share[i].value * share[i].value;
      return;
    }
    const int row = kRow.at(static_cast<std::size_t>(component()));
    variance[static_cast<std::size_t>(row)] += added;
    // Who is further in has bent further too.
    if (row == 2) variance[3] += added * leg.curvature_per_mm.value * leg.curvature_per_mm.value;
  }
  void blur(const EffectMemory& memory, std::array<double, 3>& variance_mm2) const override {
    if (axis() >= 0) variance_mm2[static_cast<std::size_t>(axis())] += memory.slot[1].value * memory.slot[1].value;
  }

 protected:
  Dual value_at(Parameters p, double place) const override {
    const KnotWeights at = weights_at(curve_.at, curve_.periodic, place);
    Dual sum;
    for (std::size_t i = 0; i < 2; ++i) {
      if (at.weight[i] == 0) continue;
      sum.value += at.weight[i] * curve_.values[at.knot[i]];
      if (at.knot[i] >= first_ && at.knot[i] < first_ + kKnotsOfPart) sum += p[at.knot[i] - first_] * at.weight[i];
    }
    return sum;
  }

 private:
  double std_error(const LegView& leg, const EffectMemory& memory) const {
    if (!adds_up(covariate())) return std_error(weights(leg, memory));
    double square = 0;
    for (std::size_t i = 0; i < kSpeedChanges; ++i) {
      const double one = std_error(weights_at(curve_.at, curve_.periodic, since_speed_change_s(i)));
      square += std::pow(leg.speed_changes_mm_s[i] * one, 2);
    }
    return std::sqrt(square);
  }
  KnotWeights weights(const LegView& leg, const EffectMemory& memory) const {
    return weights_at(curve_.at, curve_.periodic, place(leg, memory).value);
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
      case Covariate::withdrawn_mm:
        moved = std::abs(leg.base_insertion_mm());
        break;
      case Covariate::roll_rad:
      case Covariate::turned_rad:
        moved = std::abs(leg.base_rotation_rad());
        break;
      case Covariate::tip_x_mm:
      case Covariate::tip_y_mm:
      case Covariate::tip_xy_mm:
      case Covariate::tip_yx_mm:
        moved = std::abs(tip_direction(covariate())->dot(leg.R.block<2, 1>(0, 2)) * leg.base_insertion_mm());
        break;
      case Covariate::speed_mm_s:
      case Covariate::turn_rate_rad_s:
      case Covariate::since_speed_change_s:
        break;
    }
    return moved > 0 ? spacing * step / moved : kEndless;
  }

  DiscrepancyCurve curve_;
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

std::string find_fault(const DiscrepancyCurve& curve) {
  const std::size_t knots = curve.at.size();
  if (knots < 1 || knots > kMaxKnots)
    return text("knots has %.0f elements; allowed: from 1 to %.0f", static_cast<double>(knots),
                static_cast<double>(kMaxKnots));
  if (curve.periodic && curve.covariate != Covariate::roll_rad)
    return "periodic is true, but " + std::string(name_of(curve.covariate)) + " is no angle; allowed: with roll_rad";
  if (!goes_over(curve.component, curve.covariate))
    return "covariate is " + std::string(name_of(curve.covariate)) + ", but the component is " +
           std::string(info_of(curve.component).name) + "; allowed: x, y, z with it";
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
    throw ArgumentError("a discrepancy in " + std::string(info_of(curve.component).name) + " has a fault: " + fault);
  return std::make_shared<Discrepancy>(std::move(curve), first);
}

ActiveEffect active_discrepancy(const DiscrepancyCurve& curve) {
  ActiveEffect out;
  out.owned = make_discrepancy(curve);
  out.effect = out.owned.get();
  return out;
}

}  // namespace bevel::model
