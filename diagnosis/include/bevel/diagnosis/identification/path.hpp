// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Predicts the tip along one insertion, with derivatives by the parameters of the needle and of the entry.
///
/// The Lie-group integrator (bevel/model/kinematics.hpp) gives the pose at the ends of a leg. Within a leg the position
/// is the cubic with the positions and velocities of both ends. Its error is h^4/384 of the fourth derivative, below
/// 1e-5 mm for 5 mm legs (tested). The Jacobian is exact at the ends of a leg and has an error of up to 1 % within it.
/// An estimate changes by less than 1 % of its standard error by that.
#include <Eigen/Core>
#include <array>
#include <vector>

#include <bevel/diagnosis/identification/insertion.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::diagnosis {

/// Parameters of the needle, the first columns of a path's Jacobian.
enum Parameter : int {
  kNeedleCurvature,  ///< curvature k, 1/mm
  kNeedleLambda1,    ///< lambda1, 1/rad
  kNeedleLambda2,    ///< lambda2
  kNeedleWheelbase,  ///< wheelbase ell, mm
  kNeedleParameters  ///< number of parameters
};
/// Names of the parameters in a model file, by Parameter.
inline constexpr std::array<const char*, kNeedleParameters> kParameterNames = {"curvature_per_mm", "lambda1_per_rad",
                                                                               "lambda2", "wheelbase_mm"};

/// Parameters of the entry: deviation of the needle's pose from nominal when it enters the tissue.
enum EntryParameter : int {
  kEntryTiltX,      ///< tilt about x of {A}, rad
  kEntryTiltY,      ///< tilt about y of {A}, rad
  kEntryRoll,       ///< roll about the shaft, rad
  kEntryOffsetX,    ///< offset along x of {A}, mm
  kEntryOffsetY,    ///< offset along y of {A}, mm
  kLateEntry,       ///< insertion of the axis at which the tip enters the tissue, mm
  kEntryParameters  ///< number of parameters
};
/// Number of columns of a path's Jacobian.
inline constexpr int kPathColumns = static_cast<int>(kNeedleParameters) + static_cast<int>(kEntryParameters);
/// Returns the column of a path's Jacobian for a parameter of the entry.
/// @param parameter the parameter
/// @return index of the column
constexpr int entry_column(EntryParameter parameter) {
  return static_cast<int>(kNeedleParameters) + static_cast<int>(parameter);
}

/// Values of the entry parameters, by EntryParameter, in their units.
using Entry = Eigen::Matrix<double, kEntryParameters, 1>;

/// Predicted path of the tip.
struct Path {
  std::vector<Eigen::Vector3d> position_mm;  ///< one per observation, in {A}, mm
  /// Derivatives of the position by Parameter, then EntryParameter; one per observation.
  std::vector<Eigen::Matrix<double, 3, kPathColumns>> jacobian;

  /// State at one end of a leg, working memory of integrate().
  struct Node {
    model::Pose pose;                                 ///< pose of the tip in {A}
    Eigen::Vector3d velocity_mm;                      ///< velocity at the start of the leg that begins here, mm per leg
    Eigen::Vector3d arrival_mm;                       ///< velocity at the end of the leg that ends here, mm per leg
    Eigen::Matrix<double, 3, kPathColumns> jacobian;  ///< derivatives of the position
    Eigen::Matrix<double, 3, kPathColumns> slope_per_mm;  ///< derivative of the Jacobian by insertion
  };
  std::vector<Node> nodes;  ///< ends of the legs, one more than legs
};

/// Integrates the path of an insertion.
/// @param insertion legs and observations
/// @param needle parameters of the needle
/// @param entry parameters of the entry
/// @param with_jacobian whether to compute the Jacobian; false: it is unchanged
/// @param path receives the path; reuse it between calls to avoid allocations
/// @return false if the tip leaves the domain of the slip law
bool integrate(const Insertion& insertion, const model::NeedleParameters& needle, const Entry& entry,
               bool with_jacobian, Path& path);

/// Predicts the path of an insertion without rotation from the nominal entry, for figures and for comparisons at equal
/// depth.
/// @param needle parameters of the needle
/// @param length_mm length of the insertion, mm
/// @param spacing_mm distance between points along the insertion, mm
/// @return positions in {A}, mm; fewer points if the tip leaves the domain of the slip law
std::vector<Eigen::Vector3d> straight_insertion(const model::NeedleParameters& needle, double length_mm,
                                                double spacing_mm = 0.5);

}  // namespace bevel::diagnosis
