#pragma once
// Can the needle still get there? Predicted with the extended model.
#include "controller/steering_law.hpp"

namespace bevel::controller {

struct Reach {
  double miss_mm = 0;      // closest approach of the best constant inputs
  double roll_rad = 0;     // turn of the bevel that achieves it
  double duty = 0;         // share of the insertion without spinning: 1 is full curvature, 0 a straight line
  bool reachable = false;  // miss within `tolerance_mm`
};

// Best over a turn of the bevel (in place, then kept) and a duty of spinning (which scales the curvature): the set of
// constant inputs. A target whose miss is above the tolerance lies outside the set that the needle reaches. The search
// ends at the first inputs that miss by no more than enough_mm: most often the first, where the answer is yes or no.
Reach predict_reach(const model::Pose& tip, const model::NeedleParameters& needle, const Eigen::Vector3d& target_mm,
                    double tolerance_mm, double enough_mm = 0);

}  // namespace bevel::controller
