// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Consistency of each camera's innovations with the filter.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include <bevel/model/age.hpp>

namespace bevel::estimator {

/// Computes the normalised innovation squared of each camera, per axis, with an exponential window (Bar-Shalom, Li and
/// Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.4.2).
///
/// It is 1 for a consistent filter. A larger value means that the model is incomplete or that the errors of the camera
/// exceed the reported covariance.
class InnovationWatch {
 public:
  /// Constructs the statistic without measurements.
  /// @param window_s time constant of the window, s
  explicit InnovationWatch(double window_s = 3.0) : window_s_(window_s) {}
  /// Discards all measurements.
  void restart() { channels_.clear(); }

  /// Adds the result of one measurement when it is first applied, accepted or not. Allocates once for each channel. A
  /// value that is not finite is ignored.
  /// @param channel number of the source, for example of the camera
  /// @param utime time of the measurement, us
  /// @param mahalanobis2 squared innovation over its variance (Update::mahalanobis2)
  /// @param rank number of observed axes
  void see(std::int32_t channel, std::int64_t utime, double mahalanobis2, int rank) {
    if (!std::isfinite(mahalanobis2)) return;
    Channel& c = channels_[channel];
    const double since_s = c.utime == 0 ? 0.0 : std::max(model::age_s(utime, c.utime), 0.0);
    const double kept = std::exp(-since_s / window_s_);
    c.squares = kept * c.squares + mahalanobis2, c.axes = kept * c.axes + rank;
    c.utime = std::max(c.utime, utime);
  }

  /// Removes the channels without a measurement in the window.
  /// @param now_utime current time, us
  void forget_silent(std::int64_t now_utime) {
    std::erase_if(channels_, [&](const auto& c) { return model::age_s(now_utime, c.second.utime) > window_s_; });
  }

  /// Statistic of one channel.
  struct Channel {
    double squares = 0,      ///< sum of the squared innovations in the window
        axes = 0;            ///< sum of the ranks in the window
    std::int64_t utime = 0;  ///< time of the newest measurement, us
    /// Computes the normalised innovation squared per axis.
    /// @return squares over axes; 0 without measurements
    double ratio() const { return axes > 0 ? squares / axes : 0; }
    /// Tests whether the ratio exceeds that of one window in a thousand with white innovations: a chi-square quantile
    /// with `axes` degrees of freedom in the normal approximation.
    /// @return false for up to 30 axes
    bool is_too_large() const { return axes > kLeastAxes && ratio() > 1 + 3.1 * std::sqrt(2 / axes); }
  };
  /// Returns the statistics.
  /// @return statistic by number of the channel
  const std::map<std::int32_t, Channel>& channels() const { return channels_; }

 private:
  static constexpr double kLeastAxes = 30;
  double window_s_;
  std::map<std::int32_t, Channel> channels_;
};

}  // namespace bevel::estimator
