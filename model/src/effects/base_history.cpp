// SPDX-License-Identifier: MIT
#include <bevel/model/effects/base_history.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::model {

void BaseHistory::advance(const BaseMotion& to) {
  const double dt_s = to.time_s - now_.time_s;
  if (to.time_s - last_s_ > kTick_s * static_cast<double>(kTicks)) {  // all that it remembers is of this leg
    const double skipped = std::floor((to.time_s - last_s_) / kTick_s) - static_cast<double>(kTicks);
    last_s_ += skipped * kTick_s;
  }
  while (last_s_ + kTick_s <= to.time_s) {
    last_s_ += kTick_s;
    const double share = dt_s > 0 ? std::clamp((last_s_ - now_.time_s) / dt_s, 0.0, 1.0) : 1;
    std::shift_right(insertion_mm_.begin(), insertion_mm_.end(), 1);
    insertion_mm_.front() = now_.insertion_mm + share * (to.insertion_mm - now_.insertion_mm);
  }
  now_ = to;
}

double BaseHistory::insertion_mm(double before_s) const {
  const double since_tick_s = now_.time_s - last_s_;
  if (before_s < since_tick_s) {
    const double share = before_s / since_tick_s;
    return now_.insertion_mm + share * (insertion_mm_.front() - now_.insertion_mm);
  }
  const double ticks = (before_s - since_tick_s) / kTick_s;
  const auto i = std::min(static_cast<std::size_t>(ticks), kTicks - 2);
  return insertion_mm_[i] + (ticks - static_cast<double>(i)) * (insertion_mm_[i + 1] - insertion_mm_[i]);
}

SpeedChanges BaseHistory::speed_changes_mm_s() const {
  SpeedChanges out;
  double ahead_mm = now_.insertion_mm, here_mm = insertion_mm(since_speed_change_s(0));
  for (std::size_t i = 0; i < kSpeedChanges; ++i) {
    const double behind_mm = insertion_mm(since_speed_change_s(i + 1));
    out[i] = (ahead_mm - 2 * here_mm + behind_mm) / kSpeedChange_s;
    ahead_mm = here_mm, here_mm = behind_mm;
  }
  return out;
}

}  // namespace bevel::model
