// SPDX-License-Identifier: MIT
#pragma once
// The path while it is followed. With each estimate it is drawn anew from where the tip is through the points that are
// left, and the law is aimed at where it is a look-ahead later (pure pursuit: Coulter, CMU-RI-TR-92-01). It is planned
// with twice the margin (PathStart); under one margin, or where the reach no longer suffices, another is looked for on
// the way; where it would come within an obstacle's own clearance nothing is inserted until there is another, and it is
// blocked if there is none.
#include <bevel/controller/path_plan.hpp>

namespace bevel::controller {

class Route {
 public:
  explicit Route(std::vector<Obstacle> obstacles) : planner_(std::move(obstacles)) {}

  // Where there are neither obstacles nor way-points the target is all there is to aim at.
  bool is_needed() const { return !planner_.obstacles().empty() || points_.count > 1; }

  // Begins anew with these points; the target is the last and has to be told with each look.
  void restart(const PathPoints& told) { points_ = told, searching_ = false; }

  enum class Way { clear, searching, blocked, missed };
  // The whole search at once, before anything moves: clear or blocked.
  Way plan(const PathStart& start);
  // Takes points that are passed off, and looks at the path, or for one by as many candidates as these periods have
  // room for. missed: a way-point, by missed_mm.
  Way look(const PathStart& start, const PathPoint& target, double periods);

  const Eigen::Vector3d& aim_mm() const { return outlook_.lookahead_mm; }
  bool aims_at_target() const { return points_.count == 1 && aim_mm() == points_.points[0].at_mm; }
  double missed_mm() const { return missed_mm_; }
  // Of the path when it was last looked at, or of the best there is where none was found.
  const PathOutlook& outlook() const { return outlook_; }
  // The nearest obstacle: from the tip to its surface, less the clearance it asks for. Infinite without any.
  double clearance_left_mm(const Eigen::Vector3d& tip_mm) const;

 private:
  void begin_search(const PathStart& start);

  PathPlanner planner_;
  PathPoints points_;
  PathOutlook outlook_;
  bool searching_ = false;
  double missed_mm_ = 0;
  double room_for_ = 0;  // candidates
};

}  // namespace bevel::controller
