#pragma once
// What a discrepancy is looked at against, from the base's motion alone.
#include "model/effects/effect.hpp"

namespace bevel::model {

// Follows the base from leg to leg. depth is the base's insertion; since_stop counts seconds from the moment at which
// insertion last ended (0 while inserting), since_reversal the insertion since the shaft last turned.
class CovariateTracker {
 public:
  explicit CovariateTracker(const BaseMotion& entry);
  // Taken up again: when the insertion last moved, and where the shaft last turned.
  CovariateTracker(double stopped_s, double turned_mm) : stopped_s_(stopped_s), turned_mm_(turned_mm) {}
  double stopped_s() const { return stopped_s_; }
  double turned_mm() const { return turned_mm_; }
  void advance(const BaseMotion& from, const BaseMotion& to);
  double operator[](Covariate covariate) const { return value_[static_cast<std::size_t>(covariate)]; }

 private:
  std::array<double, 7> value_{};  // in the order of Covariate
  double stopped_s_, turned_mm_;
};

}  // namespace bevel::model
