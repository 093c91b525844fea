// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Error of a FilterState as a vector, and its covariance as one matrix.
///
/// The number of error states is 9, or 10 with ell or a bending length. The shared errors of the measurements follow
/// (15 or 16 states), and then the nuisance states (kAllStates).
#include <bevel/estimator/needle_filter.hpp>

namespace bevel::estimator {

/// Curvature below which a needle is straight, 1/mm: a radius of 100 m.
inline constexpr double kStraight_per_mm = 1e-5;

/// Error of a state, in the units of Vector9d, then mm for the tenth, standard deviations, and the nuisance states.
/// @tparam kSize number of error states
template <int kSize>
using Error = Eigen::Matrix<double, kSize, 1>;
/// Covariance of an Error.
/// @tparam kSize number of error states
template <int kSize>
using Covariance = Eigen::Matrix<double, kSize, kSize>;

/// Number of error states with nuisance states: all kinds, in use or not. An unused state has no variance, or no
/// influence on a measurement.
inline constexpr int kAllStates = 10 + kSharedErrors + kNuisance;
/// Number of error states without the nuisance states.
/// @tparam kSize number of error states
template <int kSize>
inline constexpr int kFiltered = kSize == kAllStates ? kSize - kNuisance : kSize;
/// Whether the error has the shared errors of the measurements.
/// @tparam kSize number of error states
template <int kSize>
inline constexpr bool kHasShared = kFiltered<kSize> > 10;
/// Number of error states of the needle itself, 9 or 10.
/// @tparam kSize number of error states
template <int kSize>
inline constexpr int kOwn = kHasShared<kSize> ? kFiltered<kSize> - kSharedErrors : kFiltered<kSize>;

/// Returns the covariance of nine states.
/// @param state state of the filter
/// @return its own matrix, shape (9, 9)
inline const Matrix9d& get_covariance(const FilterState& state, std::integral_constant<int, 9>) {
  return state.covariance;
}
/// Assembles the covariance of ten states.
/// @param state state of the filter
/// @return copy, shape (10, 10)
inline Covariance<10> get_covariance(const FilterState& state, std::integral_constant<int, 10>) {
  Covariance<10> P;
  P << state.covariance, state.tenth_covariance, state.tenth_covariance.transpose(), state.tenth_variance;
  return P;
}
/// Assembles the covariance of the state with the shared errors.
/// @tparam kSize 15 or 16
/// @param state state of the filter
/// @return copy, shape (kSize, kSize)
template <int kSize>
Covariance<kSize> get_covariance(const FilterState& state, std::integral_constant<int, kSize>) {
  const auto& with_state = state.shared.with_state.topRows<kOwn<kSize>>();
  Covariance<kSize> P;
  P << get_covariance(state, std::integral_constant<int, kOwn<kSize>>()), with_state, with_state.transpose(),
      state.shared.covariance;
  return P;
}
/// Assembles the covariance of all states (filter_nuisance.cpp).
/// @param state state of the filter
/// @return copy, shape (kAllStates, kAllStates)
Covariance<kAllStates> get_covariance(const FilterState& state, std::integral_constant<int, kAllStates>);
/// Writes the covariance of all states to the parts of a state (filter_nuisance.cpp).
/// @param state state of the filter
/// @param P covariance, shape (kAllStates, kAllStates)
void set_all_covariance(FilterState& state, const Covariance<kAllStates>& P);
/// Returns the covariance of a state for a number of error states.
/// @tparam kSize number of error states
/// @param state state of the filter
/// @return a reference to the state's own matrix for nine states, otherwise a copy; shape (kSize, kSize)
template <int kSize>
decltype(auto) covariance_of(const FilterState& state) {
  return get_covariance(state, std::integral_constant<int, kSize>());
}

/// Writes a covariance to the parts of a state.
/// @tparam kSize number of error states
/// @param state state of the filter
/// @param P covariance, shape (kSize, kSize)
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

/// Moves the mean by an error in its body frame. The covariance does not change.
/// @tparam kSize number of error states
/// @param state state before and after
/// @param error error to add, shape (kSize)
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

/// Computes the error by which move() takes one state to another.
/// @tparam kSize number of error states, 9 or 10
/// @param from first state
/// @param to second state
/// @return error in the body frame of \p from, shape (kSize)
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
