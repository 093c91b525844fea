// SPDX-License-Identifier: MIT
#pragma once
// Torsion of the shaft: tissue friction, a constant torque m per mm of inserted length, against the shaft's stiffness
// GJ. Where the whole length slips, the torque at depth z is m (L - z) and the tip lags the base by W = m L^2 / (2 GJ).
// After a reversal the slipping zone grows from the base and reaches the tip just when the base has turned back by 2 W;
// until then the tip stands still. So the tip's roll follows the base's through a dead band of half-width W (a play
// operator), exactly; W grows with the square of the inserted length. (Friction along z, which shares the same Coulomb
// force while the needle is fed and lets it unwind, is left out: the lag here is the worst case.) Reed et al., IEEE
// RA-M 2009.
#include <algorithm>

namespace bevel::model {

class Windup {
 public:
  explicit Windup(double lag_at_100mm_rad) : lag_at_100mm_rad_(lag_at_100mm_rad) {}

  // Half-width of the dead band, rad.
  [[nodiscard]] double lag_rad(double inserted_mm) const {
    const double share = std::max(inserted_mm, 0.0) / 100.0;
    return lag_at_100mm_rad_ * share * share;
  }

  // Both ends' roll about the shaft, rad, right-handed about the needle's heading. Returns the tip's.
  double follow(double base_roll_rad, double inserted_mm) {
    const double lag = lag_rad(inserted_mm);
    tip_roll_rad_ = std::clamp(tip_roll_rad_, base_roll_rad - lag, base_roll_rad + lag);
    return tip_roll_rad_;
  }

  [[nodiscard]] double tip_roll_rad() const { return tip_roll_rad_; }

 private:
  double lag_at_100mm_rad_;
  double tip_roll_rad_ = 0.0;
};

}  // namespace bevel::model
