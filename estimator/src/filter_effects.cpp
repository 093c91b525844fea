// SPDX-License-Identifier: MIT
// The filter's propagation and measurement with the effects of a model file.
#include <cmath>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/propagate.hpp>

namespace bevel::estimator {

model::AugmentedState NeedleFilter::augmented(const FilterState& state) const {
  const EffectState& effects = state.effects;
  model::AugmentedState augmented;
  augmented.pose = state.pose;
  // Sensitivities of one step: by the error of the pose before it, and by the parameters.
  augmented.D.setIdentity(6, wheelbase_estimated_ ? 10 : 9);
  augmented.entry = effects.entry;
  augmented.base = effects.base;
  augmented.history = effects.history;
  augmented.tip_insertion_mm = effects.tip_insertion_mm;
  augmented.tip_rotation_rad = effects.tip_rotation_rad;
  for (std::size_t i = 0; i < config_.effects.size(); ++i) {
    for (std::size_t k = 0; k < model::EffectMemory::kSlots; ++k) augmented.memory[i].slot[k] = effects.slot[i][k];
    augmented.memory[i].number = effects.number[i];
    augmented.memory[i].phase = effects.phase[i];
  }
  return augmented;
}

template <int kSize>
bool NeedleFilter::predict_with_effects(FilterState& state, const model::BaseMotion& increment) const {
  if (increment.insertion_mm == 0 && increment.rotation_rad == 0 && increment.time_s == 0) return true;
  const model::BaseMotion& base = state.effects.base;
  model::AugmentedState moved = augmented(state);
  needle_.set_needle(state.curvature_per_mm, state.lambda1_per_rad, state.lambda2, slip_of(state).wheelbase_mm);
  model::Spread spread{};
  if (!needle_.advance(moved,
                       {base.time_s + increment.time_s, base.insertion_mm + increment.insertion_mm,
                        base.rotation_rad + increment.rotation_rad},
                       &spread))
    return false;
  Covariance<kSize> P = covariance_of<kSize>(state);
  propagate<kSize>(P, moved.D.leftCols<6>(), moved.D.middleCols<kSize - 6>(6));
  if (coloured_) carry_shared<kSize>(state, moved.D.leftCols<6>(), moved.D.middleCols<kSize - 6>(6));
  P.diagonal() += process_variance<kSize>(P, increment.insertion_mm, increment.rotation_rad);
  for (int i = 0; i < 6; ++i) P(i, i) += spread.at(static_cast<std::size_t>(i));
  set_covariance<kSize>(state, P);
  state.pose = moved.pose;
  EffectState& effects = state.effects;
  effects.base = moved.base;
  effects.history = moved.history;
  effects.tip_insertion_mm = moved.tip_insertion_mm.value;
  effects.tip_rotation_rad = moved.tip_rotation_rad.value;
  for (std::size_t i = 0; i < config_.effects.size(); ++i) {
    for (std::size_t k = 0; k < model::EffectMemory::kSlots; ++k) effects.slot[i][k] = moved.memory[i].slot[k].value;
    effects.number[i] = moved.memory[i].number;
    effects.phase[i] = moved.memory[i].phase;
  }
  return true;
}
template bool NeedleFilter::predict_with_effects<9>(FilterState&, const model::BaseMotion&) const;
template bool NeedleFilter::predict_with_effects<10>(FilterState&, const model::BaseMotion&) const;

model::TipReading NeedleFilter::reading(const FilterState& state, Eigen::Vector3d* blur_mm2) const {
  model::TipReading at;
  const model::AugmentedState here = augmented(state);
  needle_.point(here, at);
  if (blur_mm2 != nullptr) *blur_mm2 = Eigen::Vector3d::Map(needle_.blur_mm2(here).data());
  needle_.through_cameras(at);
  return at;
}

Eigen::Vector3d NeedleFilter::seen_position_mm(const FilterState& state) const {
  return config_.effects.empty() ? tip_pose(state).p_mm : reading(state).position_mm;
}

std::int64_t NeedleFilter::latency_us() const {
  return config_.effects.empty() ? 0 : std::llround(1e6 * needle_.latency_s().value);
}

}  // namespace bevel::estimator
