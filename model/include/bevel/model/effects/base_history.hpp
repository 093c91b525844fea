// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Recent history of the insertion axis: size and age of the changes of its velocity.
#include <array>
#include <cstddef>

#include <bevel/model/effects/effect.hpp>

namespace bevel::model {

/// Ring of past actuator positions at fixed ticks of 25 ms. Positions between ticks are interpolated linearly. Before
/// the entry the actuator is stationary.
class BaseHistory {
 public:
  /// Starts the history at the entry.
  /// @param entry actuator motion at the entry
  explicit BaseHistory(const BaseMotion& entry = {}) : last_s_(entry.time_s), now_(entry) {
    insertion_mm_.fill(entry.insertion_mm);
  }
  /// Appends one leg at constant rates.
  /// @param to actuator motion at the end of the leg, not before the previous one
  void advance(const BaseMotion& to);
  /// Computes the changes of the insertion velocity, which is averaged over kSpeedChange_s.
  /// @return element i: mean velocity after the time (i + 1) kSpeedChange_s ago minus the mean before it, mm/s
  SpeedChanges speed_changes_mm_s() const;

 private:
  static constexpr double kTick_s = 0.25 * kSpeedChange_s;
  static constexpr std::size_t kTicks = 4 * (kSpeedChanges + 1) + 2;

  double insertion_mm(double before_s) const;

  std::array<double, kTicks> insertion_mm_{};  // at the tick at last_s_ and at the preceding ticks
  double last_s_;
  BaseMotion now_;
};

}  // namespace bevel::model
