// SPDX-License-Identifier: MIT
#pragma once
/// \file
/// The needle in its tissue, as the simulated rig moves it: axis increments in, tip and shaft out. There are two
/// plants: the model that the rest of the software assumes, and beam mechanics that it does not.
#include <vector>

#include <bevel/model/beam/beam_plant.hpp>
#include <bevel/model/effects/augmented_needle.hpp>
#include <bevel/model/effects/variation.hpp>

namespace bevel::rig {

/// Interface of a simulated needle in tissue. Lengths in mm, frame {A}.
class Plant {
 public:
  virtual ~Plant() = default;
  /// Moves the axes.
  /// @param insertion_mm increment of the insertion axis, mm
  /// @param rotation_rad increment of the rotation axis, rad
  /// @param dt_s         duration of the motion, s
  virtual void advance(double insertion_mm, double rotation_rad, double dt_s) = 0;
  /// @return true pose of the tip in {A}, mm
  virtual model::Pose tip() const = 0;
  /// Computes the axis of the shaft at the present time.
  /// @return points in {A}, mm, from the entry point to the tip; at least two once the needle is inserted
  virtual std::vector<Eigen::Vector3d> shaft_mm() const = 0;
  /// @return model with the true curvature and lambda, and with the effects on the cameras' images
  virtual const model::AugmentedNeedle& model() const = 0;
};

/// Path of a kinematic needle through tissue that it has already passed.
///
/// kept: the needle follows the channel that it has cut. Retracted and inserted again, it moves along the channel up to
/// its front.
/// forgotten: the tissue counts as uncut. A retraction integrates the model backwards with the present bevel direction,
/// which is another path once the shaft was rotated; a second insertion cuts a new path.
enum class Cut {
  kept,      ///< the needle follows its channel
  forgotten  ///< the tissue counts as uncut
};

/// The extended bicycle model with the effects of a model file. The shaft lies where the tip has passed. Effects on
/// camera images are not applied here.
class KinematicPlant : public Plant {
 public:
  /// Creates a needle at the entry point.
  ///
  /// The cut is kept only without effects, because effects are defined for tips that cut at every position.
  /// @param needle   parameters of the bicycle model
  /// @param effects  effects added to the model
  /// @param roll_rad roll of the bevel at the start, rad
  /// @param own      insertion-specific parameters
  /// @param cut      path through tissue that the needle has already passed
  /// @throws ArgumentError if there are more effects than a model holds
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
  // Poses along the channel that the tip has cut, by inserted length, at least 0.1 mm apart; the last is at the front.
  struct Passed {
    double insertion_mm, rotation_rad;
    model::Pose pose;
  };
  std::vector<Passed> cut_;
  bool keeps_cut_;
  model::Pose tip_;                       // including its elastic offset
  std::vector<Eigen::Vector3d> path_mm_;  // where the tip has passed; last point is the tip, without offset
  std::vector<double> path_depth_mm_;     // inserted length at each point
};

/// A beam in elastic tissue (model/src/beam); it is not a bicycle. Its guide is stationary: insertion-specific entry
/// parameters or a roll of the bevel at the start rotate the whole path.
class BeamNeedle : public Plant {
 public:
  /// Creates a needle at the entry point.
  /// @param config   parameters of the beam and the tissue
  /// @param effects  effects; only those on camera images are applied
  /// @param roll_rad roll of the bevel at the start, rad
  /// @param own      insertion-specific parameters
  /// @throws ArgumentError as model::BeamPlantConfig::validate()
  explicit BeamNeedle(const model::BeamPlantConfig& config, std::vector<model::ActiveEffect> effects = {},
                      double roll_rad = 0, const model::OwnValues& own = {});
  /// Moves the axes. Insertion beyond the configured depth is ignored. The beam is solved for each half millimetre,
  /// each fiftieth of a radian and each 5 ms, whichever comes first.
  /// @param insertion_mm increment of the insertion axis, mm
  /// @param rotation_rad increment of the rotation axis, rad
  /// @param dt_s         duration of the motion, s
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
  double due_insertion_mm_ = 0, due_rotation_rad_ = 0, due_s_ = 0;  // motion that is not solved for yet
};

/// Computes the bicycle model of a beam deep in uniform tissue: k = F / (EI lambda), lambda^4 = modulus / (4 EI);
/// without slip law.
/// @param config parameters of the beam and the tissue
/// @return parameters of the bicycle model
model::NeedleParameters bicycle_of(const model::BeamPlantConfig& config);

/// Computes the shaft as it appears to the camera that looks along x, the one that effects on cameras concern.
/// @param plant plant
/// @return points in {A}, mm
std::vector<Eigen::Vector3d> shaft_seen_along_x(const Plant& plant);

}  // namespace bevel::rig
