// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/needle/curves.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <bevel/model/effects/covariates.hpp>

namespace bevel::diagnosis {
namespace {

using model::Covariate;

constexpr int kValues = 12;  // of a curve
// A path is followed with its derivatives by all of them.
static_assert(kValues <= model::kMaxColumns && model::kSpeedChanges <= model::kMaxColumns);
constexpr double kLeastVariation = 0.05;  // of a covariate, in its unit
constexpr double kLeastRoll_rad = 0.2;

// Ascending.
std::vector<double> values_of(const std::vector<std::vector<model::Covariates>>& recordings, Covariate covariate) {
  std::vector<double> values;
  for (const auto& nodes : recordings)
    for (std::size_t i = 1; i < nodes.size(); ++i) values.push_back(nodes[i][covariate]);
  std::sort(values.begin(), values.end());
  return values;
}

std::vector<double> values_of(const std::vector<Eigen::Vector3d>& seen_mm, const Eigen::Vector2d& along) {
  std::vector<double> values;
  for (const auto& tip_mm : seen_mm)
    if (const double at = model::place_along(along, tip_mm); std::isfinite(at)) values.push_back(at);
  std::sort(values.begin(), values.end());
  return values;
}

// The roll says the same as the turning since the entry: all begin at one roll, and none turns more than once.
bool within_a_turn(const std::vector<std::vector<model::Covariates>>& recordings) {
  const auto roll = values_of(recordings, Covariate::roll_rad), turned = values_of(recordings, Covariate::turned_rad);
  const double begin = roll.front() - turned.front();
  return roll.back() - roll.front() <= 2 * std::numbers::pi && std::ranges::all_of(recordings, [&](const auto& nodes) {
           return std::abs(nodes.front()[Covariate::roll_rad] - begin) < kLeastRoll_rad;
         });
}

// After a change of speed, as far as is remembered.
std::vector<double> places_after_a_change() {
  std::vector<double> out;
  for (std::size_t i = 0; i < model::kSpeedChanges; ++i) out.push_back(model::since_speed_change_s(i));
  return out;
}

// Evenly over the middle 98 % of what the covariate takes (values, ascending); false if it hardly varies.
bool find_places(const std::vector<double>& values, Covariate covariate, inference::Curve& curve) {
  if (values.empty()) return false;
  const double low = values[values.size() / 100];
  const double high = values[values.size() - 1 - values.size() / 100];
  curve.periodic = covariate == Covariate::roll_rad;
  if (!(high - low > (curve.periodic ? kLeastRoll_rad : kLeastVariation))) return false;
  for (int i = 0; i < kValues; ++i)
    curve.at.push_back(curve.periodic ? 2 * std::numbers::pi * i / kValues : low + (high - low) * i / (kValues - 1));
  return true;
}

class CurveEffect final : public model::ComponentEffect {
 public:
  CurveEffect(const NeedleCurve& curve, const Eigen::VectorXd& values, int first_column)
      : ComponentEffect(curve.component, {.name = "discrepancy",
                                          .meaning = "a discrepancy without a name",
                                          .covariate = curve.covariate,
                                          .parameters = {}}),
        at_(curve.curve.at),
        periodic_(curve.curve.periodic) {
    for (const double value : values)
      values_.push_back(model::Dual::unknown(value, first_column < 0 ? -1 : first_column++));
  }

 protected:
  model::Dual value_at(model::Parameters, double place) const override {
    const model::KnotWeights weights = model::weights_at(at_, periodic_, place);
    model::Dual sum;
    for (std::size_t i = 0; i < 2; ++i) sum += values_[weights.knot[i]] * weights.weight[i];
    return sum;
  }

 private:
  std::vector<double> at_;
  std::vector<model::Dual> values_;
  bool periodic_;
};

}  // namespace

std::vector<NeedleCurve> find_curves(const std::vector<const model::Motion*>& motions,
                                     const std::vector<Eigen::Vector3d>& seen_mm) {
  std::vector<NeedleCurve> out;
  std::vector<std::vector<model::Covariates>> recordings;
  for (const model::Motion* motion : motions) recordings.push_back(model::find_covariates(motion->nodes));
  const bool roll_says = within_a_turn(recordings);
  const auto values = [&](Covariate covariate) {
    const auto along = model::tip_direction(covariate);
    return along ? values_of(seen_mm, *along) : values_of(recordings, covariate);
  };
  for (const Covariate covariate : model::all_covariates()) {
    inference::Curve curve;
    if (model::adds_up(covariate))
      curve.at = places_after_a_change();
    else if ((covariate == Covariate::turned_rad && roll_says) || !find_places(values(covariate), covariate, curve))
      continue;
    curve.covariate = model::name_of(covariate);
    for (const auto& info : model::discrepancy_components()) {
      if (!model::goes_over(info.component, covariate)) continue;
      curve.component = info.meaning;
      curve.unit = model::unit_of(info.component, covariate);
      out.push_back({info.component, covariate, curve});
    }
  }
  return out;
}

Eigen::VectorXd weights_at(const inference::Curve& curve, double x) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(curve.at.size()));
  const model::KnotWeights weights = model::weights_at(curve.at, curve.periodic, x);
  for (std::size_t i = 0; i < 2; ++i) out[static_cast<Eigen::Index>(weights.knot[i])] += weights.weight[i];
  return out;
}

model::DiscrepancyCurve to_model(const NeedleCurve& curve, std::vector<double> values, std::vector<double> std_errors) {
  return {.component = curve.component,
          .covariate = curve.covariate,
          .at = curve.curve.at,
          .values = std::move(values),
          .std_errors = std::move(std_errors),
          .periodic = curve.curve.periodic};
}

std::shared_ptr<const model::Effect> make_curve(const NeedleCurve& curve, const Eigen::VectorXd& values,
                                                int first_column) {
  return std::make_shared<CurveEffect>(curve, values, first_column);
}

std::shared_ptr<const model::Effect> make_curve_part(const NeedleCurve& curve, std::size_t first) {
  const std::vector<double> zero(curve.curve.at.size(), 0.0);
  return model::make_discrepancy(to_model(curve, zero, zero), first);
}

}  // namespace bevel::diagnosis
