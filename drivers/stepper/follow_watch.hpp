// Whether an axis goes where it is told: over the last quarter of a second, its way against the integral of the
// commanded rate. What it is behind (or ahead) may be what the allowed lag in time makes of the largest rate in that
// time, and a little more. Pure.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace bevel::stepper {

class FollowWatch {
 public:
  // period_ns: of the calls.
  FollowWatch(std::int64_t allowed_lag_ns, std::int64_t period_ns)
      : allowed_s_(static_cast<double>(allowed_lag_ns) * 1e-9),
        window_(std::clamp<std::size_t>(static_cast<std::size_t>(kWindow_ns / std::max<std::int64_t>(period_ns, 1)), 2,
                                        kRoom)) {}

  void begin(std::int64_t now_ns) {
    now_ns_ = now_ns;
    count_ = 0;
    told_ = share_ = 0;
  }

  // Each cycle: the rate commanded until now, and where the axis is, mm or rad. Above 1: it does not follow.
  double lag_share(std::int64_t now_ns, double commanded_unit_s, double position_unit) {
    told_ += commanded_unit_s * static_cast<double>(now_ns - now_ns_) * 1e-9;
    now_ns_ = now_ns;
    at(count_++) = {told_, position_unit, std::abs(commanded_unit_s)};
    const std::size_t size = std::min(count_, window_);
    const Sample& oldest = at(count_ - size);
    double fastest = 0;
    for (std::size_t i = count_ - size; i < count_; ++i) fastest = std::max(fastest, at(i).rate);
    const double behind = (told_ - oldest.told) - (position_unit - oldest.position);
    share_ = std::abs(behind) / (allowed_s_ * fastest + kLeast_unit);
    return share_;
  }
  double newest_share() const { return share_; }

 private:
  static constexpr std::int64_t kWindow_ns = 250'000'000;  // longer than any lag that is allowed
  static constexpr std::size_t kRoom = 256;
  static constexpr double kLeast_unit = 0.05;  // mm or rad: steps, play, an encoder's noise

  struct Sample {
    double told = 0;  // integral of the commanded rate
    double position = 0;
    double rate = 0;
  };
  Sample& at(std::size_t i) { return samples_[i % kRoom]; }

  double allowed_s_;
  std::size_t window_;
  std::array<Sample, kRoom> samples_{};
  std::size_t count_ = 0;
  std::int64_t now_ns_ = 0;
  double told_ = 0;
  double share_ = 0;
};

}  // namespace bevel::stepper
