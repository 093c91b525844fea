// SPDX-License-Identifier: MIT
#pragma once
// What a discrepancy is looked at against, and what a reading was taken at: from the base's motion alone, but for where
// the tip is.
#include <bevel/model/effects/effect.hpp>

namespace bevel::model {

// depth is the base's insertion; since_stop counts seconds from the moment at which insertion last ended (0 while
// inserting), since_reversal the insertion since the shaft last turned; turned is the shaft's turning since the entry,
// turns counted; withdrawn how far the base is drawn back from the deepest that it was; since_speed_change counts
// seconds from the last change of its speed. tip_x to tip_yx: where the
// tip is along that direction of {A} (tip_direction); not a number until somebody who knows puts it in.
struct Covariates {
  std::array<double, kCovariates> value{};
  double operator[](Covariate covariate) const { return value[static_cast<std::size_t>(covariate)]; }
  double& operator[](Covariate covariate) { return value[static_cast<std::size_t>(covariate)]; }
};

// Follows the base from leg to leg.
class CovariateTracker {
 public:
  // What of an insertion so far the next leg needs to know.
  struct History {
    double moved_s = 0;    // when the insertion last moved
    double turned_mm = 0;  // where the shaft last turned
    double deepest_mm = 0;
    double changed_s = 0;   // when its speed last changed, and
    double speed_mm_s = 0;  // what it has been since
  };
  explicit CovariateTracker(const BaseMotion& entry)
      : CovariateTracker(entry, {entry.time_s, entry.insertion_mm, entry.insertion_mm, entry.time_s}) {
    advance(entry, entry);
  }
  // Taken up again: the covariates are known after the next leg.
  CovariateTracker(const BaseMotion& entry, const History& history)
      : entry_turned_rad_(entry.rotation_rad), history_(history) {}
  void advance(const BaseMotion& from, const BaseMotion& to);
  const History& history() const { return history_; }
  const Covariates& now() const { return now_; }
  double operator[](Covariate covariate) const { return now_[covariate]; }

 private:
  double entry_turned_rad_;
  History history_;
  Covariates now_;
};

// Where a point is along such a direction; not a number where a coordinate that matters is none.
double place_along(const Eigen::Vector2d& direction, const Eigen::Vector3d& point_mm);

// One per node of a motion, of which the first is the entry.
std::vector<Covariates> find_covariates(std::span<const BaseMotion> nodes);

}  // namespace bevel::model
