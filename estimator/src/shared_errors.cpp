// SPDX-License-Identifier: MIT
// The filter's states for errors that neighbouring readings of a camera share (ReadingNoise): coloured measurement
// noise by augmentation (Bryson and Johansen 1965, IEEE TAC 10(1)), so that the covariance knows that frames are alike.
//
// Of a reading with information W the error is sqrt(share) W^(-1/2) u + white, u of unit variance along the axes of
// {A}, one for each camera; between readings exp(-forgotten) of u is left, and it is filled up to unit variance again.
// Its correlation with the state lets a second reading say only what the first has not.
#include <cmath>

#include <bevel/estimator/error_state.hpp>

namespace bevel::estimator {

double NeedleFilter::forgotten(double insertion_mm, double rotation_rad, double duration_s) const {
  const ReadingNoise& noise = config_.reading;
  const auto by = [](double way, double over) { return over > 0 ? std::abs(way) / over : 0.0; };
  return by(insertion_mm, noise.correlation_mm) + by(rotation_rad, noise.correlation_rad) +
         by(duration_s, noise.correlation_s);
}

// Of a constant in first-order Gauss-Markov noise a reading adds (1 - rho)^2 / (1 - rho^2) = tanh(x / 2), where
// rho = exp(-x).
double NeedleFilter::worth(double forgotten_since) const {
  const double share = config_.reading.correlated_share;
  if (!(share > 0)) return 1;
  const double fresh = std::tanh(forgotten_since / 2);
  return fresh / ((1 - share) * fresh + share);
}

void NeedleFilter::forget_shared(FilterState& state, double left) const {
  if (left == 1) return;
  SharedErrors& shared = state.shared;
  shared.mean *= left;
  shared.with_state *= left;
  state.nuisance.with_shared *= left;
  shared.covariance *= left * left;
  shared.covariance.diagonal().array() += 1 - left * left;
}

template <int kSize>
void NeedleFilter::carry_shared(FilterState& state, const model::Matrix6d& Phi,
                                const Eigen::Matrix<double, 6, kSize - 6>& G) const {
  const auto carry = [&](auto& with_state) {
    const auto moved = Phi.lazyProduct(with_state.template topRows<6>()).eval();
    with_state.template topRows<6>() = moved + G.lazyProduct(with_state.template middleRows<kSize - 6>(6));
  };
  if (coloured_) carry(state.shared.with_state);
  if (has_nuisance_) carry(state.nuisance.with_state);
}
template void NeedleFilter::carry_shared<9>(FilterState&, const model::Matrix6d&,
                                            const Eigen::Matrix<double, 6, 3>&) const;
template void NeedleFilter::carry_shared<10>(FilterState&, const model::Matrix6d&,
                                             const Eigen::Matrix<double, 6, 4>&) const;

}  // namespace bevel::estimator
