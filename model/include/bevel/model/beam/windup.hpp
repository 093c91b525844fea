// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Torsional wind-up of the shaft. Tissue friction acts as a constant torque m per mm of inserted length against the
/// torsional stiffness GJ.
///
/// If the whole length slips, the torque at depth z is m (L - z), and the tip lags the needle base by
/// W = m L^2 / (2 GJ). After a reversal the slipping zone grows from the needle base. It reaches the tip when the
/// needle base has rotated back by 2 W; until then the tip does not rotate. The roll of the tip therefore follows that
/// of the needle base exactly through a play operator of half-width W. W grows with the square of the inserted length.
///
/// Limit: friction along z shares the same Coulomb force during insertion and lets the shaft unwind. The model omits
/// it, so the lag is the worst case. Source: Reed, Okamura and Cowan, IEEE RA-M 2009.
#include <algorithm>

namespace bevel::model {

/// Play operator between the rolls of needle base and tip.
class Windup {
 public:
  /// Starts with the tip unrolled.
  /// @param lag_at_100mm_rad half-width of the dead band at 100 mm inserted, rad, >= 0; 0: rigid shaft
  explicit Windup(double lag_at_100mm_rad) : lag_at_100mm_rad_(lag_at_100mm_rad) {}

  /// Computes the half-width of the dead band.
  /// @param inserted_mm inserted length, mm; a negative length counts as 0
  /// @return the half-width W, rad
  [[nodiscard]] double lag_rad(double inserted_mm) const {
    const double share = std::max(inserted_mm, 0.0) / 100.0;
    return lag_at_100mm_rad_ * share * share;
  }

  /// Updates the roll of the tip. Rolls are right-handed about the heading.
  /// @param base_roll_rad roll of the needle base, rad
  /// @param inserted_mm inserted length, mm
  /// @return the roll of the tip, rad
  double follow(double base_roll_rad, double inserted_mm) {
    const double lag = lag_rad(inserted_mm);
    tip_roll_rad_ = std::clamp(tip_roll_rad_, base_roll_rad - lag, base_roll_rad + lag);
    return tip_roll_rad_;
  }

  /// @return the roll of the tip after the last update, rad
  [[nodiscard]] double tip_roll_rad() const { return tip_roll_rad_; }

 private:
  double lag_at_100mm_rad_;
  double tip_roll_rad_ = 0.0;
};

}  // namespace bevel::model
