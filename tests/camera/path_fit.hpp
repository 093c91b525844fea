// SPDX-License-Identifier: MIT
#pragma once
// Planar needle models fitted to the tips seen in one insertion's pictures, of which the insertion is known (one
// picture a step) and the base's place, roll and duty cycle are not: what lies aside against depth.
#include <Eigen/Core>
#include <vector>

namespace bevel::test {

struct PathTip {
  double depth_mm = 0.0;  ///< down the picture; the insertion axis is taken to be that, which the slip law needs
  double aside_mm = 0.0;  ///< to the right
  double sd_mm = 0.1;     ///< of aside
};

/// Free are place and direction at the first tip, and of
///   line: nothing else; bicycle: the curvature, (5); agar: the same, with the slip of Table I's agar;
///   extended: lambda1 and lambda2 of (13)-(16) too, beside Table I as a prior (0.3 +- 0.3, 0.13 +- 0.15).
enum class PathModel { line, bicycle, agar, extended };
inline constexpr PathModel kPathModels[] = {PathModel::line, PathModel::bicycle, PathModel::agar, PathModel::extended};
const char* name_of(PathModel model);

struct PathFit {
  PathModel model = PathModel::line;
  double first_depth_mm = 0.0;
  Eigen::VectorXd p;   ///< aside mm, tilt rad, curvature 1/mm, lambda1 1/rad, lambda2
  Eigen::VectorXd sd;  ///< of p; 0 of what is held
  bool inside = true;  ///< the slip law has an answer all along

  /// Where the tip passes `depth_mm`.
  double aside_mm(double depth_mm) const;
};

/// Weighted least squares by Gauss-Newton. At least as many tips as the model has free parameters.
PathFit fit_path(const std::vector<PathTip>& tips, PathModel model);

/// Each tip left out in turn, and what the fit to the others says of it: predicted less seen, mm.
std::vector<double> each_left_out(const std::vector<PathTip>& tips, PathModel model);
/// The last `count` tips from all before them.
std::vector<double> last_left_out(const std::vector<PathTip>& tips, PathModel model, int count);

double rms(const std::vector<double>& values);

}  // namespace bevel::test
