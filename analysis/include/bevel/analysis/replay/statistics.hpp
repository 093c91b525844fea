// SPDX-License-Identifier: MIT
#pragma once
// What innovations say about a filter: size against their own covariance, whiteness, and the camera's own noise.
#include <cstdint>
#include <vector>

#include <bevel/diagnosis/statistics/ljung_box.hpp>

namespace bevel::analysis {

// A mean of squared unit normals with the band in which it lies 95 times in 100.
struct ChiSquareMean {
  double sum = 0;
  std::int64_t degrees = 0;

  void add(double squares, std::int64_t count) { sum += squares, degrees += count; }
  double mean() const { return degrees > 0 ? sum / static_cast<double>(degrees) : 0; }
  double lowest() const;   // 2.5 %
  double highest() const;  // 97.5 %
  bool in_band() const { return mean() >= lowest() && mean() <= highest(); }
};

// Over `lags`, or a quarter of the series where that is fewer.
using diagnosis::LjungBox;
LjungBox ljung_box(const std::vector<double>& series, int lags = 20);

// First-order autoregressive noise of one camera axis, n_k = rho n_(k-1) + white, per frame number.
struct NoiseColour {
  double sd_mm = 0;  // of the noise itself, not of its white part; 0: not enough data
  double rho = 0;
};

// One reading of one axis; `frame` counts frames, so that a dropped one leaves a gap.
struct AxisSample {
  std::int64_t frame = 0;
  double insertion_mm = 0;  // of the base at that time
  double value_mm = 0;
};

// From second differences over 1 to 10 frames, taken over the insertion, where a smooth path cancels: no needle model
// takes part, so that a model is judged against noise that it has not had a hand in. Variances leave out
// what lies beyond three standard deviations. Recordings of one axis of one camera; sd_mm is 0 where there are fewer
// than 30.
NoiseColour measure_noise(const std::vector<std::vector<AxisSample>>& recordings);

// u_k = e_k - rho^g e_(k-1) over a gap of g frames, divided by its standard deviation if e is that noise plus an error
// of the given variance which hardly changes from frame to frame.
struct Innovation {
  std::int64_t frame = 0;
  double value_mm = 0;
  double state_variance_mm2 = 0;  // of the predicted position along the axis
};
std::vector<double> whiten(const std::vector<Innovation>& innovations, const NoiseColour& noise);

}  // namespace bevel::analysis
