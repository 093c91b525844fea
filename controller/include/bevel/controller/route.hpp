// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Following of a planned path.
#include <bevel/controller/path_plan.hpp>

namespace bevel::controller {

/// Follows a path by pure pursuit (Coulter, CMU-RI-TR-92-01).
///
/// With each estimate the path is predicted from the tip through the remaining points, and the law is aimed at its
/// point at the look-ahead distance. A path is planned with twice the margin of PathStart. If less than one margin is
/// left, or the reach no longer suffices, another path is searched for during the insertion. If the path comes within
/// an obstacle's clearance, the insertion pauses until there is another path; without one the path is blocked.
class Route {
 public:
  /// Constructs the route without points.
  /// @param obstacles obstacles to avoid
  explicit Route(std::vector<Obstacle> obstacles) : planner_(std::move(obstacles)) {}

  /// Returns whether a path is needed.
  /// @return false if there are neither obstacles nor way-points, so that the law aims at the target itself
  bool is_needed() const { return !planner_.obstacles().empty() || points_.count > 1; }

  /// Begins with new points.
  /// @param told commanded points, the target last; look() updates the target
  void restart(const PathPoints& told) { points_ = told, searching_ = false; }

  /// State of the path.
  enum class Way {
    clear,      ///< the path can be followed
    searching,  ///< a path is searched for; the insertion has to pause
    blocked,    ///< there is no path
    missed      ///< a way-point was missed by missed_mm()
  };
  /// Plans the path in one call, before motion.
  /// @param start start pose, needle and margins
  /// @return Way::clear or Way::blocked
  Way plan(const PathStart& start);
  /// Removes points that were passed, predicts the path, and continues a search if there is one.
  /// @param start present pose, needle and margins
  /// @param target the target
  /// @param periods control periods since the previous call; they limit the number of candidates
  /// @return state of the path
  Way look(const PathStart& start, const PathPoint& target, double periods);

  /// Returns the point at which the law is aimed.
  /// @return point of the path at the look-ahead distance, {A}, mm
  const Eigen::Vector3d& aim_mm() const { return outlook_.lookahead_mm; }
  /// Returns whether the law is aimed at the target.
  /// @return true if the target is the only remaining point and within the look-ahead distance
  bool aims_at_target() const { return points_.count == 1 && aim_mm() == points_.points[0].at_mm; }
  /// Returns the distance from the tip to the newest point when it was passed.
  /// @return distance, mm
  double missed_mm() const { return missed_mm_; }
  /// Returns the newest prediction of the path; if no path was found, that of the best rejected one.
  /// @return predicted path
  const PathOutlook& outlook() const { return outlook_; }
  /// Computes the smallest distance from the tip to an obstacle beyond its clearance.
  /// @param tip_mm position of the tip in {A}, mm
  /// @return distance, mm; negative within a clearance, infinity without obstacles
  double clearance_left_mm(const Eigen::Vector3d& tip_mm) const;

 private:
  void begin_search(const PathStart& start);

  PathPlanner planner_;
  PathPoints points_;
  PathOutlook outlook_;
  bool searching_ = false;
  double missed_mm_ = 0;
  double room_for_ = 0;  // number of candidates that may be evaluated
};

}  // namespace bevel::controller
