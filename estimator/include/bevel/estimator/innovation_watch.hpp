// SPDX-License-Identifier: MIT
#pragma once
// By how much the readings of each camera have been farther off of late than the filter expects: squared innovations
// over their variance, per axis, over the last seconds (normalised innovation squared: Bar-Shalom, Li, Kirubarajan,
// Estimation with Applications to Tracking and Navigation, 2001, section 5.4.2). One where filter and needle agree,
// above where the model lacks something or the camera is worse than it says.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

#include <bevel/model/age.hpp>

namespace bevel::estimator {

class InnovationWatch {
 public:
  explicit InnovationWatch(double window_s = 3.0) : window_s_(window_s) {}
  void restart() { channels_.clear(); }

  // Of one reading as it was first judged, accepted or not. Allocates once for each channel.
  void see(std::int32_t channel, std::int64_t utime, double mahalanobis2, int rank) {
    if (!std::isfinite(mahalanobis2)) return;
    Channel& c = channels_[channel];
    const double since_s = c.utime == 0 ? 0.0 : std::max(model::age_s(utime, c.utime), 0.0);
    const double kept = std::exp(-since_s / window_s_);
    c.squares = kept * c.squares + mahalanobis2, c.axes = kept * c.axes + rank;
    c.utime = std::max(c.utime, utime);
  }

  /// Drops the cameras that were silent for the whole window: nothing is known of them now.
  void forget_silent(std::int64_t now_utime) {
    std::erase_if(channels_, [&](const auto& c) { return model::age_s(now_utime, c.second.utime) > window_s_; });
  }

  struct Channel {
    double squares = 0, axes = 0;  // in the window
    std::int64_t utime = 0;
    double ratio() const { return axes > 0 ? squares / axes : 0; }
    // More than one window in a thousand of white innovations has: a chi-square of `axes`, by its normal limit.
    bool is_too_large() const { return axes > kLeastAxes && ratio() > 1 + 3.1 * std::sqrt(2 / axes); }
  };
  const std::map<std::int32_t, Channel>& channels() const { return channels_; }

 private:
  static constexpr double kLeastAxes = 30;
  double window_s_;
  std::map<std::int32_t, Channel> channels_;
};

}  // namespace bevel::estimator
