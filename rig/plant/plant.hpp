#pragma once
// The needle in its tissue, as the simulated rig moves it: axis increments in, tip and shaft out.
#include <vector>

#include "model/kinematics.hpp"

namespace bevel::rig {

class Plant {
 public:
  virtual ~Plant() = default;
  // Moves the base by these increments within dt_s.
  virtual void advance(double insertion_mm, double rotation_rad, double dt_s) = 0;
  virtual model::Pose tip() const = 0;
  // Axis of the shaft in {A} from the entry point to the tip, at least two points once the needle is in.
  virtual const std::vector<Eigen::Vector3d>& shaft_mm() const = 0;
};

// The extended bicycle itself: the shaft lies where the tip has passed. Retraction draws the tip back along that path.
class KinematicPlant : public Plant {
 public:
  explicit KinematicPlant(const model::NeedleParameters& needle);
  void advance(double insertion_mm, double rotation_rad, double dt_s) override;
  model::Pose tip() const override { return pose_; }
  const std::vector<Eigen::Vector3d>& shaft_mm() const override { return shaft_mm_; }
  const model::NeedleParameters& needle() const { return needle_; }

 private:
  model::NeedleParameters needle_;
  model::Pose pose_;
  std::vector<Eigen::Vector3d> shaft_mm_;  // last point is the tip
  std::vector<double> shaft_depth_mm_;     // inserted length at each point
  double inserted_mm_ = 0;
};

}  // namespace bevel::rig
