// SPDX-License-Identifier: MIT
#pragma once
// Where the base was over the last while: by how much its speed changed, and how long ago.
#include <array>
#include <cstddef>

#include <bevel/model/effects/effect.hpp>

namespace bevel::model {

// Positions at ticks of its own, linear between them and to where it is now; before the entry it stood there.
class BaseHistory {
 public:
  explicit BaseHistory(const BaseMotion& entry = {}) : last_s_(entry.time_s), now_(entry) {
    insertion_mm_.fill(entry.insertion_mm);
  }
  void advance(const BaseMotion& to);
  // The changes of a speed that is a mean over kSpeedChange_s: at i that from the mean before (i + 1) kSpeedChange_s
  // ago to the mean after it.
  SpeedChanges speed_changes_mm_s() const;

 private:
  static constexpr double kTick_s = 0.25 * kSpeedChange_s;
  static constexpr std::size_t kTicks = 4 * (kSpeedChanges + 1) + 2;

  double insertion_mm(double before_s) const;

  std::array<double, kTicks> insertion_mm_{};  // at the tick at last_s_, and at those before it
  double last_s_;
  BaseMotion now_;
};

}  // namespace bevel::model
