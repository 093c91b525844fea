// SPDX-License-Identifier: MIT
#include <bevel/estimator/needle_filter.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/propagate.hpp>
#include "measurement_update.hpp"

namespace bevel::estimator {
namespace {

constexpr double kLambda2Max = 0.9;                             // (24) with room: 1 - lambda2 stays away from zero
constexpr double kWheelbaseMin_mm = 2, kWheelbaseMax_mm = 990;  // of the model's (1, 1000), with room
constexpr double kBendingMin_mm = 0.2,  // as good as a shaft that does not bend: a swing of 0.1 um at k = 0.005 / mm
    kBendingMax_mm = 200;
constexpr double kVarianceFloor = 1e-14;
constexpr double kAtEntry_mm = 1.0;  // not inserted yet: within what an entry point is met by
constexpr std::int32_t kCamerasCounted = 4;
// Less has no finite inverse. What a bench can measure is bounded by the checked decode.
constexpr double kSmallestInformation = std::numeric_limits<double>::min();

double square(double x) { return x * x; }

SeenAxes seen_axes(const Eigen::Matrix3d& information) {
  SeenAxes seen;
  Eigen::Vector3d values = information.diagonal();
  // Cameras that look along an axis of {A}, and most do, need no search for eigenvectors.
  if (information(0, 1) == 0 && information(0, 2) == 0 && information(1, 2) == 0) {
    seen.axes.setIdentity();
    for (int i = 0; i < 2; ++i)  // ascending, by two passes of a bubble
      for (int j = 0; j < 2 - i; ++j)
        if (values[j] > values[j + 1]) {
          std::swap(values[j], values[j + 1]);
          seen.axes.col(j).swap(seen.axes.col(j + 1));
        }
  } else {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(information);
    values = eigen.eigenvalues();
    seen.axes = eigen.eigenvectors();
  }
  for (int i = 0; i < 3; ++i)
    if (values[i] > kRankTolerance * values[2] && values[i] >= kSmallestInformation) {
      seen.variance[i] = 1 / values[i];
      ++seen.rank;
    }
  return seen;
}

// Much of a measurement's information at once moves a state that is hardly known by more than its linearisation holds:
// a correction of tilt w and position v moves the tip by w x v / 2 in addition to v. The information is then
// applied in parts, each with kGrowth times the information of the one before, and linearised anew in between
// (recursive update filter: Zanetti 2012, IEEE TAC 57(2)). The first part corrects half of the error.
constexpr double kGrowth = 4;
constexpr int kMostParts = 16;
constexpr std::array<double, 3> kNoGate = {std::numeric_limits<double>::max(), std::numeric_limits<double>::max(),
                                           std::numeric_limits<double>::max()};

int parts_of(const FilterState& state, const SeenAxes& seen) {
  const double aside_mm2 = state.covariance.diagonal().head<3>().maxCoeff();
  const double tilt_rad2 = state.covariance.diagonal().segment<2>(3).maxCoeff();
  const double noise_mm2 = seen.variance[2];  // along the axis that is seen best
  if (!(0.25 * tilt_rad2 * aside_mm2 > noise_mm2)) return 1;
  return std::clamp(1 + static_cast<int>(std::ceil(std::log(aside_mm2 / noise_mm2) / std::log(kGrowth))), 1,
                    kMostParts);
}

}  // namespace

NeedleFilter::NeedleFilter(const EstimatorConfig& config)
    : config_(config),
      slip_(model::slip_parameters(config.prior.needle)),
      wheelbase_estimated_(config.prior.wheelbase_sd_mm > 0),
      stiff_(config.prior.bending_mm > 0),
      ten_states_(wheelbase_estimated_ || stiff_),
      coloured_(config.reading.correlated_share > 0),
      has_nuisance_(config.nuisance.any()),
      needle_(config.prior.needle, config.effects, wheelbase_estimated_ ? 10 : 9,
              {.curvature = 6, .lambda1 = 7, .lambda2 = 8, .wheelbase = wheelbase_estimated_ ? 9 : -1}) {
  for (int rank = 1; rank <= 3; ++rank)
    gate_[static_cast<std::size_t>(rank - 1)] =
        boost::math::quantile(boost::math::chi_squared(rank), config.gate.probability);
}

FilterState NeedleFilter::initial(double insertion_mm, double rotation_rad) const {
  const Prior& prior = config_.prior;
  FilterState state;
  state.curvature_per_mm = prior.needle.curvature_per_mm;
  state.lambda1_per_rad = prior.needle.lambda1_per_rad;
  state.lambda2 = prior.needle.lambda2;
  state.wheelbase_mm = prior.needle.wheelbase_mm;
  state.bending_mm = prior.bending_mm;
  state.tenth_variance = square(stiff_ ? prior.bending_sd_mm : prior.wheelbase_sd_mm);
  const double aside_mm2 = square(prior.position_sd_mm) + square(prior.variation.entry_point_mm);
  const double tilt_rad2 = square(prior.tilt_sd_rad) + square(prior.variation.entry_angle_rad);
  state.covariance.diagonal() << aside_mm2, aside_mm2, square(prior.position_sd_mm), tilt_rad2, tilt_rad2,
      square(prior.roll_sd_rad) + square(prior.variation.roll_rad), square(insertion_curvature_sd_per_mm(prior)),
      square(prior.lambda1_sd_per_rad), square(prior.lambda2_sd);
  begin_nuisance(state);
  if (config_.effects.empty()) return state;
  const model::AugmentedState entry = needle_.entry({0, insertion_mm, rotation_rad});
  state.pose = entry.pose;
  state.effects.entry = state.effects.base = entry.base;
  state.effects.history = entry.history;
  state.effects.tip_insertion_mm = insertion_mm;
  state.effects.tip_rotation_rad = rotation_rad;
  return state;
}

FilterState NeedleFilter::inserted(double insertion_mm, double rotation_rad) const {
  FilterState state = initial(insertion_mm, rotation_rad);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(rotation_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  state.pose.R = turned * state.pose.R;
  if (std::abs(insertion_mm) <= kAtEntry_mm) return state;
  state.pose.p_mm += insertion_mm * state.pose.R.col(2);
  widen_by_bend(state, insertion_mm);
  const ProcessNoise& noise = config_.process;
  state.covariance(5, 5) +=
      square(noise.roll_rad) * std::abs(insertion_mm) + square(noise.roll_per_sqrt_rad) * std::abs(rotation_rad);
  state.nuisance.inserted_mm = insertion_mm;
  state.covariance(5, 5) += square(config_.nuisance.windup_sd_rad * square(insertion_mm / 100));
  return state;
}

model::SlipParameters NeedleFilter::slip_of(const FilterState& state) const {
  model::SlipParameters slip = slip_;
  slip.lambda1_per_rad = state.lambda1_per_rad;
  slip.lambda2 = state.lambda2;
  if (wheelbase_estimated_) slip.wheelbase_mm = state.wheelbase_mm;
  return slip;
}

void NeedleFilter::predict(FilterState& state, double insertion_mm, double rotation_rad, double duration_s) const {
  if (coloured_) forget_shared(state, std::exp(-forgotten(insertion_mm, rotation_rad, duration_s)));
  if (!config_.effects.empty()) {
    const model::BaseMotion increment{duration_s, insertion_mm, rotation_rad};
    state.outside_model = !(wheelbase_estimated_ ? predict_with_effects<10>(state, increment)
                                                 : predict_with_effects<9>(state, increment));
    return;
  }
  predict_by(
      state, insertion_mm, rotation_rad, duration_s,
      [&](double by_mm, double by_rad) { predict_cutting(state, by_mm, by_rad); }, true);
}

template <class Cutting>
void NeedleFilter::predict_by(FilterState& state, double insertion_mm, double rotation_rad, double duration_s,
                              const Cutting& cutting, bool bend_known) const {
  if (!has_nuisance_) return follow(state, insertion_mm, rotation_rad, true, cutting, bend_known);
  const Eigen::Vector3d before_mm = state.pose.p_mm;
  const TipTurn turn = follow_windup(state, insertion_mm, rotation_rad);
  follow(state, insertion_mm, turn.rad, true, cutting, bend_known);
  spread_turn(state, turn.by_windup);
  if (duration_s > 0) state.nuisance.tip_velocity_mm_s = (state.pose.p_mm - before_mm) / duration_s;
}

void NeedleFilter::pass_gap(FilterState& state, double insertion_mm, double rotation_rad, double duration_s,
                            std::int64_t utime) const {
  if (!config_.effects.empty()) {
    predict(state, insertion_mm, rotation_rad, duration_s);
  } else {
    if (coloured_) forget_shared(state, std::exp(-forgotten(insertion_mm, rotation_rad, duration_s)));
    predict_by(
        state, insertion_mm, rotation_rad, duration_s,
        [&](double by_mm, double by_rad) {
          predict_cutting(state, 0, by_rad / 2);
          cut_straight(state, by_mm);
          predict_cutting(state, 0, by_rad / 2);
        },
        false);
  }
  widen_by_gap(state, insertion_mm, rotation_rad, duration_s);
  begin_reset(state, ResetCause::gap, utime);
}

void NeedleFilter::predict_cutting(FilterState& state, double insertion_mm, double rotation_rad) const {
  if (insertion_mm == 0 && rotation_rad == 0) return;
  if (stiff_) return predict_stiff(state, insertion_mm, rotation_rad);
  wheelbase_estimated_ ? predict_plain<10>(state, insertion_mm, rotation_rad)
                       : predict_plain<9>(state, insertion_mm, rotation_rad);
}

void NeedleFilter::predict_mean(FilterState& state, double insertion_mm, double rotation_rad, double duration_s) const {
  if (!config_.effects.empty()) return predict(state, insertion_mm, rotation_rad, duration_s);
  if (has_nuisance_) rotation_rad = follow_windup(state, insertion_mm, rotation_rad).rad;
  follow(state, insertion_mm, rotation_rad, false,
         [&](double by_mm, double by_rad) { state.outside_model = !mean_cutting(state, by_mm, by_rad); });
}

bool NeedleFilter::mean_cutting(FilterState& state, double insertion_mm, double rotation_rad) const {
  if (stiff_) return move_stiff(state, insertion_mm, rotation_rad);
  const model::StepInput input{insertion_mm, rotation_rad, {state.curvature_per_mm, 0}};
  return model::advance(state.pose, input, slip_of(state));
}

// Part by part: what was cut before is passed through, and the rest is cut. Turning in the channel turns the bevel
// alone: it is turned after the part, which begins with the bevel as the channel has it so far.
template <class Cutting>
void NeedleFilter::follow(FilterState& state, double insertion_mm, double rotation_rad, bool with_covariance,
                          const Cutting& cutting, bool bend_known) const {
  if (insertion_mm == 0 && rotation_rad == 0) return;
  if (!config_.through_channel) return cutting(insertion_mm, rotation_rad);
  Channel& channel = state.channel;
  const double target_mm = channel.inserted_mm() + insertion_mm;
  bool outside = false, first = true;
  while (first || channel.inserted_mm() < target_mm || channel.inserted_mm() > target_mm) {
    const Channel::Part part = channel.next(target_mm);
    // Of new tissue all at once, and by the increment itself: no sum of it has been rounded.
    const bool all = first && part.to_mm == target_mm;
    const double by_mm = all ? insertion_mm : part.insertion_mm;
    const double by_rad = all || insertion_mm == 0 ? rotation_rad : rotation_rad * (part.insertion_mm / insertion_mm);
    if (!part.cut_before) {
      cutting(by_mm, by_rad);
      outside = outside || state.outside_model;
    } else {
      outside = !draw_through(state, part, with_covariance) || outside;
      if (by_rad != 0) {
        cutting(0, by_rad);
        outside = outside || state.outside_model;
      }
    }
    channel.pass(part, by_rad, bend_known);
    first = false;
  }
  state.outside_model = outside;
}

template <int kSize>
void NeedleFilter::predict_plain(FilterState& state, double insertion_mm, double rotation_rad) const {
  model::NeedleJacobian jacobian;
  const model::StepInput input{insertion_mm, rotation_rad, {state.curvature_per_mm, 0}};
  const bool by_midpoint = takes_midpoint(config_, insertion_mm, rotation_rad);
  state.outside_model = by_midpoint ? !model::advance_by_midpoint(state.pose, input, slip_of(state), jacobian)
                                    : !model::advance(state.pose, input, slip_of(state), jacobian);
  if (state.outside_model) return;
  if (coloured_ || has_nuisance_) carry_shared<kSize>(state, jacobian.pose, jacobian.needle.leftCols<kSize - 6>());
  const auto move_covariance = [&](Covariance<kSize>& P) {
    propagate<kSize>(P, jacobian.pose, jacobian.needle.leftCols<kSize - 6>());
    P.diagonal() += process_variance<kSize>(P, insertion_mm, rotation_rad);
  };
  if constexpr (kSize == 9) {
    move_covariance(state.covariance);
  } else {
    Covariance<kSize> P = covariance_of<kSize>(state);
    move_covariance(P);
    set_covariance<kSize>(state, P);
  }
}

template <int kSize>
Error<kSize> NeedleFilter::process_variance(const Covariance<kSize>& covariance, double insertion_mm,
                                            double rotation_rad) const {
  const ProcessNoise& noise = config_.process;
  Error<kSize> added = Error<kSize>::Zero();  // ell is the needle's: it does not walk
  added.template head<9>() << Eigen::Vector3d::Constant(square(noise.position_mm)), square(noise.tilt_rad),
      square(noise.tilt_rad), square(noise.roll_rad), square(noise.curvature_per_mm), square(noise.lambda1_per_rad),
      square(noise.lambda2);
  added *= std::abs(insertion_mm);
  added[5] += square(noise.roll_per_sqrt_rad) * std::abs(rotation_rad);
  // A parameter that the prior holds fixed (standard deviation zero) stays fixed: no walk is added to it.
  for (int i = 6; i < 9; ++i)
    if (covariance(i, i) == 0) added[i] = 0;
  return added;
}
template Error<9> NeedleFilter::process_variance<9>(const Covariance<9>&, double, double) const;
template Error<10> NeedleFilter::process_variance<10>(const Covariance<10>&, double, double) const;

Update NeedleFilter::update(FilterState& state, const model::TipMeasurement& measurement) const {
  if (has_nuisance_) return update_sized<kAllStates>(state, measurement);
  if (coloured_) return ten_states_ ? update_sized<16>(state, measurement) : update_sized<15>(state, measurement);
  return ten_states_ ? update_sized<10>(state, measurement) : update_sized<9>(state, measurement);
}

template <int kSize>
Update NeedleFilter::update_sized(FilterState& state, const model::TipMeasurement& measurement) const {
  SeenAxes seen = seen_axes(measurement.information_per_mm2);
  if (seen.rank == 0) return {};  // sees nothing: no rejection either
  const auto camera = static_cast<std::size_t>(std::clamp<std::int32_t>(measurement.camera, 0, kCamerasCounted - 1));
  std::uint8_t& camera_rejects = state.camera_rejects_in_row.at(camera);
  std::int64_t& camera_utime = state.camera_utime.at(camera);
  if (is_forgotten(camera_utime, measurement.utime)) camera_rejects = 0;
  if (is_forgotten(state.reading_utime, measurement.utime)) state.rejects_in_row = 0;
  camera_utime = std::max(camera_utime, measurement.utime);
  state.reading_utime = std::max(state.reading_utime, measurement.utime);
  if constexpr (kHasShared<kSize>) {
    seen.coloured = config_.reading.correlated_share * seen.variance;
    seen.variance -= seen.coloured;
    seen.first_error = measurement.camera == 0 ? 0 : 3;
  }
  const auto apply_once = [&](const std::array<double, 3>& gate) -> Update {
    if constexpr (kSize == kAllStates) {
      Eigen::Matrix<double, 3, 10> by_state = Eigen::Matrix<double, 3, 10>::Zero();
      by_state.leftCols<3>() = state.pose.R;
      Eigen::Vector3d at_mm = state.pose.p_mm;
      if (stiff_ && pressing(state) < 1) at_mm = drawn_back_tip(state, by_state);
      ByNuisance by_nuisance;
      const Eigen::Vector3d seen_mm = seen_by_camera(state, measurement.camera, at_mm, by_nuisance);
      return update_all(state, by_state, by_nuisance, seen, measurement.position_mm - seen_mm, gate);
    } else {
      if constexpr (kOwn<kSize> == 10)
        if (stiff_ && pressing(state) < 1) {
          Eigen::Matrix<double, 3, 10> by_state;
          const Eigen::Vector3d at_mm = drawn_back_tip(state, by_state);
          return update_seen<kSize, 10>(state, by_state, seen, measurement.position_mm - at_mm, gate);
        }
      if (config_.effects.empty())
        return update_seen<kSize, 3>(state, state.pose.R, seen, measurement.position_mm - state.pose.p_mm, gate);
      Eigen::Vector3d blur_mm2;
      const model::TipReading at = reading(state, &blur_mm2);
      seen.shared = seen.axes.cwiseAbs2().transpose() * blur_mm2;
      return update_seen<kSize, kOwn<kSize>>(state, at.D, seen, measurement.position_mm - at.position_mm, gate);
    }
  };
  const auto apply = [&]() -> Update {
    const int parts = parts_of(state, seen);
    if (parts == 1) return apply_once(gate_);
    const FilterState before = state;
    const Update whole = apply_once(gate_);
    if (!whole.accepted) return whole;
    state = before;
    const Eigen::Vector3d variance = seen.variance;
    const double all = (std::pow(kGrowth, parts) - 1) / (kGrowth - 1);
    for (int i = 0; i < parts; ++i) {
      seen.variance = variance * (all / std::pow(kGrowth, i));
      apply_once(kNoGate);
    }
    seen.variance = variance;
    return whole;
  };
  Update result = apply();
  if (result.accepted) {
    state.measurement_utime = measurement.utime;
    state.rejects_in_row = 0;
    camera_rejects = 0;
    keep_in_domain<kSize>(state);
    if (bends_to_the_other_side(state)) {
      declare_reset(state, result.innovation.norm(), measurement.utime);
      if (apply().accepted) state.measurement_utime = measurement.utime;
      keep_in_domain<kSize>(state);
      result.reset = true;
    }
    return result;
  }
  if (camera_rejects < std::numeric_limits<std::uint8_t>::max()) ++camera_rejects;
  if (++state.rejects_in_row < config_.gate.rejects_before_reset) return result;
  declare_reset(state, result.innovation.norm(), measurement.utime);
  const Update reached = apply();  // the reset begins with what was measured, or it would be followed by another
  result.reset = true;
  if (reached.accepted) state.measurement_utime = measurement.utime;
  return result;
}

double NeedleFilter::side_of_bend() const {
  const double k = config_.prior.needle.curvature_per_mm;
  return k == 0 ? 0 : std::copysign(1.0, k);
}

// Moves the parameters back into the valid set of Section III.A along the covariance, so that what is correlated with
// them moves too; the covariance itself is kept (a bound that is reached must not make the filter confident).
template <int kSize>
void NeedleFilter::keep_in_domain(FilterState& state) const {
  const auto move_by = [&state](const Error<kSize>& normal, double excess) {
    const Error<kSize> Pa = covariance_of<kSize>(state) * normal;
    const double variance = normal.dot(Pa);
    if (!(variance > 0)) return;
    move<kSize>(state, -Pa * (excess / variance));
  };
  if (kOwn<kSize> == 10 && stiff_) {
    const double inside_mm = std::clamp(state.bending_mm, kBendingMin_mm, kBendingMax_mm);
    if (state.bending_mm != inside_mm) move_by(Error<kSize>::Unit(kOwn<kSize> - 1), state.bending_mm - inside_mm);
    state.bending_mm = std::clamp(state.bending_mm, kBendingMin_mm, kBendingMax_mm);
  } else if constexpr (kOwn<kSize> == 10) {
    const double inside_mm = std::clamp(state.wheelbase_mm, kWheelbaseMin_mm, kWheelbaseMax_mm);
    if (state.wheelbase_mm != inside_mm) move_by(Error<kSize>::Unit(9), state.wheelbase_mm - inside_mm);
  }
  // The side that the needle bends to is the bevel's, which the pose has: k keeps the prior's sign.
  const double side = side_of_bend();
  const auto keep_side = [&] {
    if (side != 0) state.curvature_per_mm = side * std::max(side * state.curvature_per_mm, kStraight_per_mm);
  };
  if (side * state.curvature_per_mm < kStraight_per_mm && side != 0)
    move_by(side * Error<kSize>::Unit(6), side * state.curvature_per_mm - kStraight_per_mm);
  keep_side();
  if constexpr (kSize == kAllStates)
    if (state.nuisance.mean[kWindup] < 0)
      move_by(Error<kSize>::Unit(kFiltered<kSize> + kWindup), state.nuisance.mean[kWindup]);
  if (state.lambda1_per_rad == 0 && state.lambda2 == 0) return;
  if (state.lambda2 > kLambda2Max) move_by(Error<kSize>::Unit(8), state.lambda2 - kLambda2Max);
  // (26), linearised at the present lambda2; the set is convex, so twice is enough for small excesses.
  for (int i = 0; i < 2; ++i) {
    const double bound = square(state.lambda2) / (2 * std::numbers::pi) + 1e-6;
    if (state.lambda1_per_rad >= bound) break;
    Error<kSize> normal = Error<kSize>::Zero();
    normal[7] = 1;
    normal[8] = -state.lambda2 / std::numbers::pi;
    move_by(normal, state.lambda1_per_rad - bound);
  }
  // Whatever the covariance allowed, the state ends inside.
  keep_side();
  state.lambda2 = std::min(state.lambda2, kLambda2Max);
  state.lambda1_per_rad = std::max(state.lambda1_per_rad, square(state.lambda2) / (2 * std::numbers::pi) + 1e-9);
  if (kOwn<kSize> == 10 && !stiff_)
    state.wheelbase_mm = std::clamp(state.wheelbase_mm, kWheelbaseMin_mm, kWheelbaseMax_mm);
  for (int i = 0; i < 9; ++i)
    if (state.covariance(i, i) != 0) state.covariance(i, i) = std::max(state.covariance(i, i), kVarianceFloor);
}
template void NeedleFilter::keep_in_domain<9>(FilterState&) const;
template void NeedleFilter::keep_in_domain<10>(FilterState&) const;
template void NeedleFilter::keep_in_domain<15>(FilterState&) const;
template void NeedleFilter::keep_in_domain<16>(FilterState&) const;
template void NeedleFilter::keep_in_domain<kAllStates>(FilterState&) const;

}  // namespace bevel::estimator
