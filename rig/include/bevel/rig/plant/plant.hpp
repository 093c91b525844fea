// SPDX-License-Identifier: MIT
#pragma once
// The needle in its tissue, as the simulated rig moves it: axis increments in, tip and shaft out. Two of them: the
// model that everything else believes in, and mechanics that it does not.
#include <vector>

#include <bevel/model/beam/beam_plant.hpp>
#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/effects/variation.hpp>

namespace bevel::rig {

class Plant {
 public:
  virtual ~Plant() = default;
  // Moves the base by these increments within dt_s.
  virtual void advance(double insertion_mm, double rotation_rad, double dt_s) = 0;
  virtual model::Pose tip() const = 0;
  // Axis of the shaft in {A}, drawn when it is asked for, from the entry point to the tip, at least two points once the
  // needle is in.
  virtual std::vector<Eigen::Vector3d> shaft_mm() const = 0;
  // k and lambda as they are, and what effects make of the cameras' pictures.
  virtual const model::AugmentedNeedle& model() const = 0;
};

// What a kinematic needle finds where it was before. kept: the channel that it has cut; drawn back, and inserted again,
// it goes through that, to its front. forgotten: uncut tissue; drawn back it is the model run backwards with the bevel
// as it stands, which is another path once the shaft was turned, and inserted again it cuts anew.
enum class Cut { kept, forgotten };

// The extended bicycle itself, with what a model file's effects make of it: the shaft lies where the tip has passed.
// What a camera makes of it is not in here.
class KinematicPlant : public Plant {
 public:
  // roll_rad: of the bevel at the start; own: what this insertion has of its own. The cut is kept without effects only:
  // theirs are defined for tips that cut wherever they are. Throws ArgumentError for more effects than a model
  // holds.
  explicit KinematicPlant(const model::NeedleParameters& needle, std::vector<model::ActiveEffect> effects = {},
                          double roll_rad = 0, const model::OwnValues& own = {}, Cut cut = Cut::forgotten);
  void advance(double insertion_mm, double rotation_rad, double dt_s) override;
  model::Pose tip() const override { return tip_; }
  std::vector<Eigen::Vector3d> shaft_mm() const override;
  const model::AugmentedNeedle& model() const override { return needle_; }

 private:
  void cut_to(const model::BaseMotion& to);
  void follow_cut(const model::BaseMotion& to);
  void keep();
  void follow_path();

  model::AugmentedNeedle needle_;
  model::AugmentedState state_;
  // Where the tip has cut, the last at the front: by inserted length, a tenth of a millimetre apart at least.
  struct Passed {
    double insertion_mm, rotation_rad;
    model::Pose pose;
  };
  std::vector<Passed> cut_;
  bool keeps_cut_;
  model::Pose tip_;                       // with its elastic offset
  std::vector<Eigen::Vector3d> path_mm_;  // where the tip has passed; last point is the tip, without offset
  std::vector<double> path_depth_mm_;     // inserted length at each point
};

// A beam in elastic tissue (model/src/beam): no bicycle is its truth. Its guide stands as it stands, so that where
// insertions differ in the entry, or the bevel's roll at the start is not zero, the whole of its path is turned.
class BeamNeedle : public Plant {
 public:
  // effects: those of cameras act, others have no part in it. Throws as model::BeamPlantConfig::validate().
  explicit BeamNeedle(const model::BeamPlantConfig& config, std::vector<model::ActiveEffect> effects = {},
                      double roll_rad = 0, const model::OwnValues& own = {});
  // What would be fed or drawn beyond the room for it stays outside. The beam is solved for each half millimetre, each
  // fiftieth of a radian and each 5 ms, whichever comes first.
  void advance(double insertion_mm, double rotation_rad, double dt_s) override;
  model::Pose tip() const override { return tip_; }
  std::vector<Eigen::Vector3d> shaft_mm() const override;
  const model::AugmentedNeedle& model() const override { return needle_; }

 private:
  void solve();

  model::BeamPlant beam_;
  double room_mm_;
  model::AugmentedNeedle needle_;
  model::Pose entry_, tip_;
  double due_insertion_mm_ = 0, due_rotation_rad_ = 0, due_s_ = 0;  // not solved for yet
};

// The bicycle that a beam is deep in uniform tissue: k = F / (EI lambda), lambda^4 = modulus / (4 EI); no slip law.
model::NeedleParameters bicycle_of(const model::BeamPlantConfig& config);

// The shaft as it appears to the camera that looks along x, the one that effects of a camera concern.
std::vector<Eigen::Vector3d> shaft_seen_along_x(const Plant& plant);

}  // namespace bevel::rig
