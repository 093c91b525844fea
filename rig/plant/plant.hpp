#pragma once
// The needle in its tissue, as the simulated rig moves it: axis increments in, tip and shaft out.
#include <vector>

#include "model/effects/augmented_needle.hpp"
#include "model/effects/variation.hpp"

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

// The extended bicycle itself, with what a model file's effects make of it: the shaft lies where the tip has passed.
// Retraction draws the tip back along that path. What a camera makes of it is not in here.
class KinematicPlant : public Plant {
 public:
  // roll_rad: of the bevel at the start; own: what this insertion has of its own. Throws std::invalid_argument for more
  // effects than a model holds.
  explicit KinematicPlant(const model::NeedleParameters& needle, std::vector<model::ActiveEffect> effects = {},
                          double roll_rad = 0, const model::OwnValues& own = {});
  void advance(double insertion_mm, double rotation_rad, double dt_s) override;
  model::Pose tip() const override { return tip_; }
  const std::vector<Eigen::Vector3d>& shaft_mm() const override { return shaft_mm_; }
  const model::AugmentedNeedle& model() const { return needle_; }

 private:
  void follow_path();

  model::AugmentedNeedle needle_;
  model::AugmentedState state_;
  model::Pose tip_;                       // with its elastic offset
  std::vector<Eigen::Vector3d> path_mm_;  // where the tip has passed; last point is the tip, without offset
  std::vector<double> path_depth_mm_;     // inserted length at each point
  std::vector<Eigen::Vector3d> shaft_mm_;
};

// The shaft as it appears to the camera that looks along x, the one that effects of a camera concern.
std::vector<Eigen::Vector3d> shaft_seen_along_x(const KinematicPlant& plant);

}  // namespace bevel::rig
