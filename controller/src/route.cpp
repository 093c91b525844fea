// SPDX-License-Identifier: MIT
#include <bevel/controller/route.hpp>

#include <algorithm>
#include <limits>

namespace bevel::controller {
namespace {

// A period has room for these: some 30 us each.
constexpr double kPerPeriod = 16;
constexpr int kAll = 1'000'000;

void drop_first(PathPoints& points) {
  std::move(points.points.begin() + 1, points.points.begin() + static_cast<std::ptrdiff_t>(points.count),
            points.points.begin());
  --points.count;
}

// A path is planned with twice the margin with which it is kept, so that it is not planned anew at once, and with nine
// tenths of the reach: the bevel may rest a third of a right angle beside where it should face (arc_law.cpp).
PathStart careful(PathStart start) {
  start.margin_mm *= 2;
  start.reach_share = 0.9;
  return start;
}

}  // namespace

double Route::clearance_left_mm(const Eigen::Vector3d& tip_mm) const {
  double left_mm = std::numeric_limits<double>::infinity();
  for (const Obstacle& obstacle : planner_.obstacles())
    left_mm = std::min(left_mm, distance_mm(obstacle, tip_mm) - obstacle.clearance_mm);
  return left_mm;
}

void Route::begin_search(const PathStart& start) {
  PathPoints told;
  for (const PathPoint& point : points_.all())
    if (point.told) told.add(point);
  planner_.begin(careful(start), told);
  searching_ = true;
}

Route::Way Route::plan(const PathStart& start) {
  begin_search(start);
  planner_.search(kAll);
  searching_ = false;
  outlook_ = planner_.best();
  if (!planner_.found()) return Way::blocked;
  points_ = planner_.path();
  return Way::clear;
}

Route::Way Route::look(const PathStart& start, const PathPoint& target, double periods) {
  points_.points.at(points_.count - 1) = target;
  room_for_ = std::min(room_for_ + kPerPeriod * std::max(periods, 0.0), kPerPeriod);
  // By the plane that arc_geometry() measures by.
  const Eigen::Vector3d along = ArcWalk(start.needle, start.shaft).middle_of(start.tip).R.col(2);
  const auto is_passed = [&](const PathPoint& point) { return along.dot(point.at_mm - start.tip.p_mm) <= 0; };
  const auto is_left_behind = [&] {  // a point of the planner's own, by one that is told
    return !points_.points[0].told && points_.points[1].told && is_passed(points_.points[1]);
  };
  while (points_.count > 1 && (is_passed(points_.points[0]) || is_left_behind())) {
    const PathPoint passed = points_.points[0];
    missed_mm_ = (passed.at_mm - start.tip.p_mm).norm();
    if (passed.told && !(missed_mm_ <= passed.miss_max_mm)) return Way::missed;
    if (passed.told) searching_ = false;  // what is sought leads through it
    drop_first(points_);
  }
  // The planner's own points are there for obstacles: once these are clear without the next one, it has done its part.
  if (!searching_ && !points_.points[0].told) {
    PathPoints without = points_;
    drop_first(without);
    const PathOutlook outlook = planner_.outlook(careful(start), without);
    if (outlook.clear() && outlook.slack_mm > 0) points_ = without;
  }
  outlook_ = planner_.outlook(start, points_);
  // Nearer than the path is not known to, it may still keep the obstacles' own clearance: until that is lost, too, or
  // there is a better one, it is gone on with.
  const auto keeps_clearance = [&] { return outlook_.reachable && outlook_.room_mm > -start.margin_mm; };
  if (!searching_ && !(outlook_.clear() && outlook_.slack_mm > 0)) begin_search(start);
  if (!searching_) return Way::clear;
  const int now = static_cast<int>(room_for_);
  room_for_ -= now;
  searching_ = !planner_.search(now);
  if (searching_) return keeps_clearance() ? Way::clear : Way::searching;
  const PathOutlook other = planner_.outlook(start, planner_.path());
  if (other.reachable && (!outlook_.reachable || other.spare_mm() > outlook_.spare_mm())) {
    points_ = planner_.path();
    outlook_ = other;
  }
  return keeps_clearance() ? Way::clear : Way::blocked;
}

}  // namespace bevel::controller
