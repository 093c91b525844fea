// SPDX-License-Identifier: MIT
#pragma once
#include <bevel/diagnosis/inference/likelihood.hpp>

namespace bevel::inference {

// Of one instant, all else at the mode: by an integral over it.
struct InstantPosterior {
  double mean_s = 0, sd_s = 0;
  double low_s = 0, high_s = 0;  // 95 %
  double width_s = 0;            // integral of the likelihood over the instant, relative to that at the mode
};
InstantPosterior instant_posterior(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                                   std::size_t recording, std::size_t local);

}  // namespace bevel::inference
