// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/line_location.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::camera {
namespace {

/// Darkness at the pixels -reach ... reach, and a line of the lens's blur laid into it.
class Across {
 public:
  Across(const std::vector<double>& dark, double blur_px)
      : reach_(static_cast<int>(dark.size() / 2)), middle_(dark.data() + reach_), blur_px_(blur_px) {}

  struct Fit {
    double height = 0.0;
    double squares = 0.0;  ///< sum of shape^2
    double slopes = 0.0;   ///< sum of (d shape / d offset)^2
  };
  Fit fit_at(double offset_px) const {
    Fit fit;
    for (int k = -reach_; k <= reach_; ++k) {
      const double g = shape(k, offset_px), slope = slope_of(k, offset_px);
      fit.height += g * dark_at(k), fit.squares += g * g, fit.slopes += slope * slope;
    }
    fit.height /= fit.squares;
    return fit;
  }

  /// Autocovariance of what the line leaves over, up to the first lag that has none.
  std::vector<double> left_over(double offset_px, double height) const {
    std::vector<double> left;
    for (int k = -reach_; k <= reach_; ++k) left.push_back(dark_at(k) - height * shape(k, offset_px));
    std::vector<double> covariance;
    for (size_t lag = 0; lag < left.size() / 2; ++lag) {
      double product = lag == 0 ? 1e-6 : 0.0;
      for (size_t i = 0; i + lag < left.size(); ++i) product += left[i] * left[i + lag];
      if (product <= 0.0) break;
      covariance.push_back(product / (static_cast<double>(left.size()) - 2.0));  // height and offset were fitted
    }
    return covariance;
  }

  /// Variance that such noise gives the offset. A shade that is wider than the line gives little. An autocovariance
  /// that is cut off need not be one, and a sum that is not positive says nothing: then the noise is taken for white.
  double variance_px2(double offset_px, const Fit& fit, const std::vector<double>& covariance) const {
    double sum = 0.0, white = 0.0;
    for (size_t lag = 0; lag < covariance.size(); ++lag) {
      for (int k = -reach_; k + static_cast<int>(lag) <= reach_; ++k)
        sum += (lag == 0 ? 1.0 : 2.0) * covariance[lag] * slope_of(k, offset_px) *
               slope_of(k + static_cast<int>(lag), offset_px);
      if (lag == 0) white = sum;
    }
    return (sum > 0.0 ? sum : white) / (fit.height * fit.height * fit.slopes * fit.slopes);
  }

 private:
  double dark_at(int k) const { return middle_[k]; }
  double shape(int k, double offset_px) const {
    const double z = (k - offset_px) / blur_px_;
    return std::exp(-0.5 * z * z);
  }
  double slope_of(int k, double offset_px) const {
    return shape(k, offset_px) * (k - offset_px) / (blur_px_ * blur_px_);
  }

  int reach_;
  const double* middle_;  // of the darkness across, which reaches as far to either side
  double blur_px_;
};

}  // namespace

LineLocation locate_line(const std::vector<double>& dark, double blur_px, double prior_sd_px) {
  LineLocation line;
  const int reach = static_cast<int>(dark.size() / 2);
  if (reach < 3 || dark.size() % 2 == 0 || !(blur_px > 0.0) || !(prior_sd_px > 0.0)) return line;
  const Across across(dark, blur_px);
  constexpr double step_px = 0.5;
  const int steps = static_cast<int>(std::min(2.0 * prior_sd_px, reach - 1.0) / step_px);
  const auto best_of = [&](const auto& value) {
    double best = 0.0, at = std::nan("");
    for (int i = -steps; i <= steps; ++i) {
      const double here = value(i * step_px);
      if (here > best) best = here, at = i * step_px;
    }
    return at;
  };
  // What of the squares a line explains; then the same in units of the noise it leaves, with the prior.
  const auto explained = [&](double offset_px) {
    const Across::Fit fit = across.fit_at(offset_px);
    return fit.height > 0.0 ? fit.height * fit.height * fit.squares : 0.0;
  };
  const double first = best_of(explained);
  if (!std::isfinite(first)) return line;
  const double noise_gray2 = across.left_over(first, across.fit_at(first).height).front();
  const auto posterior = [&](double offset_px) {
    const double z = offset_px / prior_sd_px;
    return 0.5 * explained(offset_px) / noise_gray2 - 0.5 * z * z;
  };
  double at = best_of(posterior);
  if (!std::isfinite(at)) return line;
  for (int halvings = 0; halvings < 5; ++halvings) {  // to 0.03 pixels
    const double step = std::ldexp(step_px, -halvings);
    const double left = posterior(at - step), middle = posterior(at), right = posterior(at + step);
    const double bend = left - 2.0 * middle + right;
    if (bend < 0.0) at += std::clamp(0.5 * (left - right) / bend, -1.0, 1.0) * step;
  }
  const Across::Fit fit = across.fit_at(at);
  if (!(fit.height > 0.0)) return line;
  const double by_noise_px2 = across.variance_px2(at, fit, across.left_over(at, fit.height));
  const double likely_px2 = prior_sd_px * prior_sd_px;
  line.found = true;
  line.offset_px = at;
  line.height = fit.height;
  line.variance_px2 = by_noise_px2 * likely_px2 / (by_noise_px2 + likely_px2);
  return line;
}

}  // namespace bevel::camera
