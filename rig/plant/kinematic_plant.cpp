#include "rig/plant/plant.hpp"

namespace bevel::rig {
namespace {
constexpr double kShaftSpacing_mm = 1.0;
}

KinematicPlant::KinematicPlant(const model::NeedleParameters& needle) : needle_(needle) {
  shaft_mm_ = {Eigen::Vector3d(0, 0, -1), pose_.p_mm};
  shaft_depth_mm_ = {-1, 0};
}

void KinematicPlant::advance(double insertion_mm, double rotation_rad, double /*dt_s*/) {
  // Outside the domain of the slip law the tip stays: the rig has no needle that bends past 90 degrees.
  if (!model::advance(pose_, {insertion_mm, rotation_rad, {needle_.curvature_per_mm, 0}},
                      model::slip_parameters(needle_)))
    return;
  pose_.R = model::orthonormalised(pose_.R);
  inserted_mm_ += insertion_mm;
  while (shaft_mm_.size() > 2 && shaft_depth_mm_[shaft_depth_mm_.size() - 2] >= inserted_mm_) {
    shaft_mm_.pop_back();
    shaft_depth_mm_.pop_back();
  }
  if (inserted_mm_ - shaft_depth_mm_[shaft_depth_mm_.size() - 2] > kShaftSpacing_mm) {
    shaft_mm_.push_back(pose_.p_mm);
    shaft_depth_mm_.push_back(inserted_mm_);
  }
  shaft_mm_.back() = pose_.p_mm;
  shaft_depth_mm_.back() = inserted_mm_;
}

}  // namespace bevel::rig
