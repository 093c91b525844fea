// SPDX-License-Identifier: MIT
#pragma once
// The tip along one insertion by the model, with derivatives by the needle's and the entry's parameters.
//
// At the ends of a leg the pose comes from the Lie-group integrator (bevel/model/kinematics.hpp); within it the
// position is the cubic with the positions and velocities of both ends (error h^4/384 of the fourth derivative: below
// 1e-5 mm for 5 mm legs, tested). The Jacobian in between errs by up to 1 %, at the legs' ends it is exact: an estimate
// moves by less than 1 % of its standard error for it.
#include <Eigen/Core>
#include <array>
#include <vector>

#include <bevel/diagnosis/identification/insertion.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::diagnosis {

// Columns of a path's Jacobian: four of the needle, then those of the entry.
enum Parameter : int { kNeedleCurvature, kNeedleLambda1, kNeedleLambda2, kNeedleWheelbase, kNeedleParameters };
inline constexpr std::array<const char*, kNeedleParameters> kParameterNames = {"curvature_per_mm", "lambda1_per_rad",
                                                                               "lambda2", "wheelbase_mm"};

// How the needle stood when it entered, against nominal: a stage is never quite square to the tissue.
enum EntryParameter : int {
  kEntryTiltX,
  kEntryTiltY,
  kEntryRoll,
  kEntryOffsetX,
  kEntryOffsetY,
  kLateEntry,
  kEntryParameters
};
inline constexpr int kPathColumns = static_cast<int>(kNeedleParameters) + static_cast<int>(kEntryParameters);
constexpr int entry_column(EntryParameter parameter) {
  return static_cast<int>(kNeedleParameters) + static_cast<int>(parameter);
}

// tilt about x_A and y_A (rad), roll about the shaft (rad), offset along x_A and y_A (mm), and the insertion read off
// the axis when the tip met the tissue (mm).
using Entry = Eigen::Matrix<double, kEntryParameters, 1>;

struct Path {
  std::vector<Eigen::Vector3d> position_mm;  // one per observation, {A}
  std::vector<Eigen::Matrix<double, 3, kPathColumns>> jacobian;

  // Room for integrate(); kept from one call to the next.
  struct Node {
    model::Pose pose;
    Eigen::Vector3d velocity_mm;  // per leg: at the start of the leg that begins here
    Eigen::Vector3d arrival_mm;   // per leg: at the end of the leg that ends here
    Eigen::Matrix<double, 3, kPathColumns> jacobian;
    Eigen::Matrix<double, 3, kPathColumns> slope_per_mm;  // of the Jacobian, along the insertion
  };
  std::vector<Node> nodes;
};

// False where the tip leaves the domain of the slip law. Without `with_jacobian` the Jacobian is left alone.
bool integrate(const Insertion& insertion, const model::NeedleParameters& needle, const Entry& entry,
               bool with_jacobian, Path& path);

// The path at every `spacing_mm` of an uninterrupted insertion from the nominal entry, no rotation: for drawing and for
// comparing at equal depth. Ends early where the model's domain does.
std::vector<Eigen::Vector3d> straight_insertion(const model::NeedleParameters& needle, double length_mm,
                                                double spacing_mm = 0.5);

}  // namespace bevel::diagnosis
