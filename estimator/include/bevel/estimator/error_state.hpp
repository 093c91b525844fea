// SPDX-License-Identifier: MIT
#pragma once
// The error of a FilterState as a vector of nine, or of ten with ell, and its covariance as one matrix. With the errors
// that readings share behind them they are fifteen or sixteen; the nuisance states, where there are any, come last.
#include <bevel/estimator/needle_filter.hpp>

namespace bevel::estimator {

inline constexpr double kStraight_per_mm = 1e-5;  // radius 100 m: less is no bend over any insertion

template <int kSize>
using Error = Eigen::Matrix<double, kSize, 1>;
template <int kSize>
using Covariance = Eigen::Matrix<double, kSize, kSize>;

// With the nuisance states, which come last, all are carried, in use or not: what is not has no variance, or is not
// seen.
inline constexpr int kAllStates = 10 + kSharedErrors + kNuisance;
template <int kSize>
inline constexpr int kFiltered = kSize == kAllStates ? kSize - kNuisance : kSize;
template <int kSize>
inline constexpr bool kHasShared = kFiltered<kSize> > 10;
// Of the state itself.
template <int kSize>
inline constexpr int kOwn = kHasShared<kSize> ? kFiltered<kSize> - kSharedErrors : kFiltered<kSize>;

inline const Matrix9d& get_covariance(const FilterState& state, std::integral_constant<int, 9>) {
  return state.covariance;
}
inline Covariance<10> get_covariance(const FilterState& state, std::integral_constant<int, 10>) {
  Covariance<10> P;
  P << state.covariance, state.tenth_covariance, state.tenth_covariance.transpose(), state.tenth_variance;
  return P;
}
template <int kSize>
Covariance<kSize> get_covariance(const FilterState& state, std::integral_constant<int, kSize>) {
  const auto& with_state = state.shared.with_state.topRows<kOwn<kSize>>();
  Covariance<kSize> P;
  P << get_covariance(state, std::integral_constant<int, kOwn<kSize>>()), with_state, with_state.transpose(),
      state.shared.covariance;
  return P;
}
// Of all (filter_nuisance.cpp).
Covariance<kAllStates> get_covariance(const FilterState& state, std::integral_constant<int, kAllStates>);
void set_all_covariance(FilterState& state, const Covariance<kAllStates>& P);
// The state's own matrix where that is all of it, a copy otherwise.
template <int kSize>
decltype(auto) covariance_of(const FilterState& state) {
  return get_covariance(state, std::integral_constant<int, kSize>());
}

template <int kSize>
void set_covariance(FilterState& state, const Covariance<kSize>& P) {
  if constexpr (kSize == kAllStates) return set_all_covariance(state, P);
  state.covariance = P.template topLeftCorner<9, 9>();
  if constexpr (kOwn<kSize> == 10) {
    state.tenth_covariance = P.template block<9, 1>(0, 9);
    state.tenth_variance = P(9, 9);
  }
  constexpr int kStates = kOwn<kSize>;
  if constexpr (kHasShared<kSize>) {
    state.shared.with_state.topRows<kStates>() = P.template block<kStates, kSharedErrors>(0, kStates);
    state.shared.covariance = P.template block<kSharedErrors, kSharedErrors>(kStates, kStates);
  }
}

// Moves the estimate by an error in its body frame; the covariance stays.
template <int kSize>
void move(FilterState& state, const Error<kSize>& error) {
  state.pose = state.pose * model::exp_se3(error.template head<6>());
  state.curvature_per_mm += error[6];
  state.lambda1_per_rad += error[7];
  state.lambda2 += error[8];
  if constexpr (kOwn<kSize> == 10) (state.bending_mm > 0 ? state.bending_mm : state.wheelbase_mm) += error[9];
  if constexpr (kHasShared<kSize>) state.shared.mean += error.template segment<kSharedErrors>(kOwn<kSize>);
  if constexpr (kSize == kAllStates) {
    const auto by = error.template tail<kNuisance>();
    state.nuisance.mean += by;
    state.nuisance.lag_rad += state.nuisance.lag_by_windup * by[kWindup];
  }
}

// The error by which `from` is moved to `to`.
template <int kSize>
Error<kSize> difference(const FilterState& from, const FilterState& to) {
  Error<kSize> error;
  error.template head<9>() << model::log_se3(from.pose.inverse() * to.pose),
      to.curvature_per_mm - from.curvature_per_mm, to.lambda1_per_rad - from.lambda1_per_rad, to.lambda2 - from.lambda2;
  if constexpr (kSize == 10)  // one of the two is the same in both
    error[9] = to.wheelbase_mm - from.wheelbase_mm + to.bending_mm - from.bending_mm;
  return error;
}

}  // namespace bevel::estimator
