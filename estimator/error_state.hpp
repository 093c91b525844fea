#pragma once
// The error of a FilterState as a vector of nine, or of ten with ell, and its covariance as one matrix. With the errors
// that readings share behind them they are fifteen or sixteen.
#include "estimator/needle_filter.hpp"

namespace bevel::estimator {

template <int kSize>
using Error = Eigen::Matrix<double, kSize, 1>;
template <int kSize>
using Covariance = Eigen::Matrix<double, kSize, kSize>;

// Of the state itself.
template <int kSize>
inline constexpr int kOwn = kSize > 10 ? kSize - kSharedErrors : kSize;

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
// The state's own matrix where that is all of it, a copy otherwise.
template <int kSize>
decltype(auto) covariance_of(const FilterState& state) {
  return get_covariance(state, std::integral_constant<int, kSize>());
}

template <int kSize>
void set_covariance(FilterState& state, const Covariance<kSize>& P) {
  state.covariance = P.template topLeftCorner<9, 9>();
  if constexpr (kOwn<kSize> == 10) {
    state.tenth_covariance = P.template topRightCorner<9, 1>();
    state.tenth_variance = P(9, 9);
  }
  if constexpr (kSize > 10) {
    state.shared.with_state.topRows<kOwn<kSize>>() = P.template topRightCorner<kOwn<kSize>, kSharedErrors>();
    state.shared.covariance = P.template bottomRightCorner<kSharedErrors, kSharedErrors>();
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
  if constexpr (kSize > 10) state.shared.mean += error.template tail<kSharedErrors>();
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
