// SPDX-License-Identifier: MIT
#include <bevel/model/effects/augmented_needle.hpp>

#include <algorithm>
#include <string>

#include <bevel/error.hpp>

namespace bevel::model {
namespace {

constexpr double kSmallTilt2 = 1e-12;  // rad^2: below, two terms of the series are exact

std::size_t registry_index(const Effect* effect) {
  const auto all = all_effects();
  return static_cast<std::size_t>(std::find(all.begin(), all.end(), effect) - all.begin());
}

Dual3 to_dual(const Eigen::Vector3d& vector, const PointColumns& D) {
  Dual3 out;
  for (int i = 0; i < 3; ++i) {
    auto& x = out[static_cast<std::size_t>(i)];
    x.value = vector[i];
    if (D.cols() > 0) x.slopes().head(D.cols()) = D.row(i).transpose().array();
  }
  return out;
}

void from_dual(const Dual3& dual, Eigen::Vector3d& vector, PointColumns& D) {
  for (int i = 0; i < 3; ++i) {
    const auto& x = dual[static_cast<std::size_t>(i)];
    vector[i] = x.value;
    if (D.cols() > 0) D.row(i) = x.slope().head(D.cols()).matrix().transpose();
  }
}

// e3 turned by the rotation vector (x, y, 0).
Dual3 tilted(const Dual2& tilt_rad) {
  const Dual square = tilt_rad[0] * tilt_rad[0] + tilt_rad[1] * tilt_rad[1];
  if (square.value < kSmallTilt2) {
    const Dual sinc = 1.0 - square / 6.0;
    return {sinc * tilt_rad[1], -(sinc * tilt_rad[0]), 1.0 - 0.5 * square};
  }
  const Dual angle = sqrt(square);
  const Dual sinc = sin(angle) / angle;
  return {sinc * tilt_rad[1], -(sinc * tilt_rad[0]), cos(angle)};
}

}  // namespace

AugmentedNeedle::AugmentedNeedle(const NeedleParameters& needle, std::vector<ActiveEffect> effects, int columns,
                                 const NeedleColumns& needle_columns)
    : needle_(needle), effects_(std::move(effects)), columns_(columns), needle_columns_(needle_columns) {
  if (effects_.size() > kMaxEffects)
    throw ArgumentError("a model has " + std::to_string(effects_.size()) + " effects; at most " +
                        std::to_string(kMaxEffects) + " are supported");
  if (columns < 0 || columns > kMaxColumns)
    throw ArgumentError(std::to_string(columns) + " sensitivities asked; 0 to " + std::to_string(kMaxColumns) +
                        " are supported");
  std::stable_sort(effects_.begin(), effects_.end(), [](const ActiveEffect& a, const ActiveEffect& b) {
    return registry_index(a.effect) < registry_index(b.effect);
  });
  for (const auto& active : effects_) active.effect->change_needle(needle_);
  keeps_history_ =
      std::ranges::any_of(effects_, [](const ActiveEffect& one) { return adds_up(one.effect->covariate()); });
  slip_ = slip_parameters(needle_);
}

void AugmentedNeedle::set_needle(double curvature_per_mm, double lambda1_per_rad, double lambda2, double wheelbase_mm) {
  needle_.curvature_per_mm = curvature_per_mm;
  slip_.lambda1_per_rad = needle_.lambda1_per_rad = lambda1_per_rad;
  slip_.lambda2 = needle_.lambda2 = lambda2;
  slip_.wheelbase_mm = needle_.wheelbase_mm = wheelbase_mm;
}

AugmentedState AugmentedNeedle::entry(const BaseMotion& base) const {
  AugmentedState state;
  state.entry = state.base = base;
  state.history = BaseHistory(base);
  state.D.setZero(6, columns_);
  EntryPose pose;
  for (const auto& active : effects_) active.effect->enter(parameters(active), pose);
  const NeedleColumns& own = needle_columns_;
  if (own.tilt_x >= 0) pose.tilt_x_rad.slopes()[own.tilt_x] += 1;
  if (own.tilt_y >= 0) pose.tilt_y_rad.slopes()[own.tilt_y] += 1;
  if (own.roll >= 0) pose.roll_rad.slopes()[own.roll] += 1;
  const Eigen::Vector3d tilt(pose.tilt_x_rad.value, pose.tilt_y_rad.value, 0);
  if (!effects_.empty() || own.tilt_x >= 0 || own.tilt_y >= 0 || own.roll >= 0) {
    const Eigen::Matrix3d unroll = exp_so3({0, 0, -pose.roll_rad.value});
    state.pose.R = exp_so3(tilt) * unroll.transpose();
    const Eigen::Matrix<double, 3, 2> by_tilt = (unroll * right_jacobian_so3(tilt)).leftCols<2>();
    state.D.bottomRows<3>() = by_tilt.col(0) * pose.tilt_x_rad.slope().head(columns_).matrix().transpose() +
                              by_tilt.col(1) * pose.tilt_y_rad.slope().head(columns_).matrix().transpose();
    state.D.row(5) += pose.roll_rad.slope().head(columns_).matrix().transpose();
  }
  if (own.entry_x >= 0) state.D.col(own.entry_x).head<3>() += state.pose.R.row(0).transpose();
  if (own.entry_y >= 0) state.D.col(own.entry_y).head<3>() += state.pose.R.row(1).transpose();
  state.tip_insertion_mm = base.insertion_mm;
  state.tip_rotation_rad = base.rotation_rad;
  return state;
}

bool AugmentedNeedle::advance(AugmentedState& state, const BaseMotion& to, Spread* spread) const {
  return effects_.empty() ? advance_plain(state, to) : advance_with_effects(state, to, spread);
}

bool AugmentedNeedle::integrate(AugmentedState& state, const StepInput& input, StepJacobian& J) const {
  if (columns_ == 0) return model::advance(state.pose, input, slip_);
  if (!model::advance(state.pose, input, slip_, J)) return false;
  const BodyColumns before = state.D;
  // Where the tip was does not matter to where it turns.
  state.D.topRows<3>().noalias() = J.pose.topRows<3>().lazyProduct(before);
  state.D.bottomRows<3>().noalias() = J.pose.bottomRightCorner<3, 3>().lazyProduct(before.bottomRows<3>());
  if (needle_columns_.lambda1 >= 0) state.D.col(needle_columns_.lambda1) += J.slip.col(0);
  if (needle_columns_.lambda2 >= 0) state.D.col(needle_columns_.lambda2) += J.slip.col(1);
  if (needle_columns_.wheelbase >= 0) state.D.col(needle_columns_.wheelbase) += J.slip.col(2);
  return true;
}

bool AugmentedNeedle::advance_plain(AugmentedState& state, const BaseMotion& to) const {
  StepJacobian J;
  if (!integrate(state,
                 {to.insertion_mm - state.base.insertion_mm,
                  to.rotation_rad - state.base.rotation_rad,
                  {needle_.curvature_per_mm, 0}},
                 J))
    return false;
  if (needle_columns_.curvature >= 0) state.D.col(needle_columns_.curvature) += J.input.col(2);
  state.base = to;
  state.tip_insertion_mm.value = to.insertion_mm;
  state.tip_rotation_rad.value = to.rotation_rad;
  return true;
}

bool AugmentedNeedle::advance_with_effects(AugmentedState& state, const BaseMotion& to, Spread* spread) const {
  auto& memory = state.memory;
  LegView leg;
  leg.entry = state.entry;
  leg.from = state.base;
  leg.to = to;
  leg.R = state.pose.R;
  leg.R_moves = columns_ > 0;
  const std::array<Dual*, 3> tip_mm = {&leg.tip_side_mm[0], &leg.tip_side_mm[1], &leg.tip_depth_mm};
  for (int i = 0; i < 3; ++i) tip_mm[static_cast<std::size_t>(i)]->value = state.pose.p_mm[i];
  leg.heading_z.value = state.pose.R(2, 2);
  if (leg.R_moves) {
    for (int i = 0; i < 3; ++i) leg.R_body.row(i) = kNoSlope.matrix().transpose();
    leg.R_body.leftCols(columns_) = state.D.bottomRows<3>();
    for (int i = 0; i < 3; ++i)
      tip_mm[static_cast<std::size_t>(i)]->slopes().head(columns_) =
          state.pose.R.row(i).lazyProduct(state.D.topRows<3>()).transpose().array();
    // n = R^T z_A; its z moves by (n x delta)_z.
    leg.heading_z.slopes() =
        (state.pose.R(2, 0) * leg.R_body.row(1) - state.pose.R(2, 1) * leg.R_body.row(0)).transpose().array();
  }
  leg.curvature_per_mm = Dual::unknown(needle_.curvature_per_mm, needle_columns_.curvature);
  leg.tip_rotation_rad = state.tip_rotation_rad;

  Dual insertion_mm(to.insertion_mm);
  Dual rotation_rad(to.rotation_rad);
  for (std::size_t i = 0; i < effects_.size(); ++i)
    effects_[i].effect->axes(parameters(effects_[i]), leg, memory[i], insertion_mm, rotation_rad);
  leg.insertion_mm = insertion_mm - state.tip_insertion_mm;
  leg.rotation_rad = rotation_rad - state.tip_rotation_rad;
  Dual2 kappa = {leg.curvature_per_mm, Dual()};
  for (std::size_t i = 0; i < effects_.size(); ++i)
    effects_[i].effect->curvature(parameters(effects_[i]), leg, memory[i], kappa);

  StepJacobian J;
  if (!integrate(state, {leg.insertion_mm.value, leg.rotation_rad.value, {kappa[0].value, kappa[1].value}}, J))
    return false;
  if (columns_ > 0) {
    Eigen::Matrix<double, 4, Eigen::Dynamic, Eigen::RowMajor, 4, kMaxColumns> inputs(4, columns_);
    inputs.row(0) = leg.insertion_mm.slope().head(columns_).matrix().transpose();
    inputs.row(1) = leg.rotation_rad.slope().head(columns_).matrix().transpose();
    inputs.row(2) = kappa[0].slope().head(columns_).matrix().transpose();
    inputs.row(3) = kappa[1].slope().head(columns_).matrix().transpose();
    state.D.noalias() += J.input.lazyProduct(inputs);
  }
  if (keeps_history_) {
    state.history.advance(to);
    leg.speed_changes_mm_s = state.history.speed_changes_mm_s();
  }
  for (std::size_t i = 0; i < effects_.size(); ++i) effects_[i].effect->settle(parameters(effects_[i]), leg, memory[i]);
  if (spread != nullptr)
    for (std::size_t i = 0; i < effects_.size(); ++i) effects_[i].effect->spread(leg, memory[i], *spread);
  state.base = to;
  state.tip_insertion_mm = insertion_mm;
  state.tip_rotation_rad = rotation_rad;
  return true;
}

void AugmentedNeedle::point(const AugmentedState& state, TipReading& reading) const {
  reading.position_mm = state.pose.p_mm;
  reading.D.resize(3, columns_);
  reading.D.noalias() = state.pose.R.lazyProduct(state.D.topRows<3>());
  if (effects_.empty()) return;
  Dual3 p = to_dual(reading.position_mm, reading.D);
  for (std::size_t i = 0; i < effects_.size(); ++i)
    effects_[i].effect->offset(parameters(effects_[i]), state.memory[i], state.base.time_s, p);
  from_dual(p, reading.position_mm, reading.D);
}

void AugmentedNeedle::through_cameras(TipReading& reading) const {
  if (effects_.empty()) return;
  Dual3 p = to_dual(reading.position_mm, reading.D);
  for (const auto& active : effects_) active.effect->camera(parameters(active), p);
  from_dual(p, reading.position_mm, reading.D);
}

void AugmentedNeedle::heading(const AugmentedState& state, HeadingReading& reading) const {
  Dual2 tilt_rad;
  for (std::size_t i = 0; i < effects_.size(); ++i)
    effects_[i].effect->sensor(parameters(effects_[i]), state.memory[i], tilt_rad);
  const Dual3 in_body = tilted(tilt_rad);
  const Eigen::Vector3d body(in_body[0].value, in_body[1].value, in_body[2].value);
  reading.direction = state.pose.R * body;
  reading.D.resize(3, columns_);
  if (columns_ == 0) return;
  PointColumns moved(3, columns_);
  for (int i = 0; i < 3; ++i)
    moved.row(i) = in_body[static_cast<std::size_t>(i)].slope().head(columns_).matrix().transpose();
  moved.noalias() -= hat(body).lazyProduct(state.D.bottomRows<3>());
  reading.D.noalias() = state.pose.R.lazyProduct(moved);
}

void AugmentedNeedle::through_frame(HeadingReading& reading) const {
  if (effects_.empty()) return;
  Dual3 direction = to_dual(reading.direction, reading.D);
  for (const auto& active : effects_) active.effect->frame(parameters(active), direction);
  from_dual(direction, reading.direction, reading.D);
}

std::array<double, 3> AugmentedNeedle::blur_mm2(const AugmentedState& state) const {
  std::array<double, 3> variance_mm2{};
  for (std::size_t i = 0; i < effects_.size(); ++i) effects_[i].effect->blur(state.memory[i], variance_mm2);
  return variance_mm2;
}

Dual AugmentedNeedle::latency_s() const {
  Dual sum;
  for (const auto& active : effects_) sum += active.effect->latency_s(parameters(active));
  return sum;
}

bool AugmentedNeedle::is_sudden() const {
  return std::ranges::any_of(effects_, [](const ActiveEffect& one) { return one.effect->sudden(); });
}

}  // namespace bevel::model
