// SPDX-License-Identifier: MIT
#pragma once
// A path to the target that keeps clear of the obstacles, of arcs that the needle can make.
//
// A path leads through a row of points: none, one or two of the planner's own, the operator's way-points, the target.
// From a pose the leg to a point (arc_law.hpp for W and reach) faces the side W on which the point lies and bends until
// W is gone, then goes straight, alternating. With q ahead and r = |W| / reach that is after q (1 - sqrt(1 - r)): W
// falls with insertion s by k (q s - s^2 / 2), and the reach is k q^2 / 2. The next leg begins in the pose in which one
// ends. The law by arcs, aimed from each pose at where the path from there is kLookahead_mm later, follows it
// (route.hpp).
//
// The search goes over what a needle can do rather than over places. The planner's own points are the ends of free
// legs, each given by a turn of the bevel, its r and how far it goes: none of them, then one, then two, each time a
// coarse grid of these numbers, the best few of which are improved by pattern search (Hooke and Jeeves 1961). Of the
// paths with the fewest points the one is taken that may be off by most before it comes too near or falls short.
// Nothing allocates, and a search is cut into pieces for control periods.
#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <bevel/controller/arc_walk.hpp>
#include <bevel/controller/obstacle.hpp>

namespace bevel::controller {

inline constexpr std::size_t kMostWayPoints = 8;  // of the operator
inline constexpr std::size_t kMostPoints = kMostWayPoints + 3;

// So far ahead the law is aimed: nearer it would turn more often, farther it would cut corners. What it leaves the path
// by, alternating, is under kLeaves of the bend over that length, k kLookahead_mm^2
// (tests/controller/path_plan_test.cpp).
inline constexpr double kLookahead_mm = 30, kLeaves = 0.1;

struct PathPoint {
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double miss_max_mm = 0;  // what it may be missed by
  bool told = false;       // by the operator: not the planner's own
};

// Points to aim at in their order, the target last.
struct PathPoints {
  std::array<PathPoint, kMostPoints> points;
  std::size_t count = 0;
  double early = 1;  // of the bend of legs to points told: c = r + early (1 - r)
  void add(const PathPoint& point) {
    if (count < kMostPoints) points.at(count++) = point;
  }
  std::span<const PathPoint> all() const { return {points.data(), count}; }
};

// What a path depends on besides its points.
struct PathStart {
  model::Pose tip;  // in {A}
  model::NeedleParameters needle;
  ShaftConfig shaft;
  double margin_mm = 0;    // kept from the obstacles besides their own clearance: what the path is not known to
  double reach_share = 1;  // of the reach that is counted on
};

struct PathOutlook {
  bool reachable = true;    // every point, within what it may be missed by; false outside the model's domain too
  double nearest_mm = 1e9;  // to any obstacle's surface
  double room_mm = 1e9;     // by how much the path may be off before it is nearer to an obstacle than it should be
  double slack_mm = 1e9;    // by how much the reach exceeds what is needed, at the point where that is least
  Eigen::Vector3d lookahead_mm =
      Eigen::Vector3d::Zero();  // kLookahead_mm on, or the first point told if that is nearer
  bool clear() const { return reachable && room_mm > 0; }
  double spare_mm() const { return std::min(room_mm, slack_mm); }
};

class PathPlanner {
 public:
  explicit PathPlanner(std::vector<Obstacle> obstacles) : obstacles_(std::move(obstacles)) {}
  const std::vector<Obstacle>& obstacles() const { return obstacles_; }

  // How the law would go through the points.
  PathOutlook outlook(const PathStart& start, const PathPoints& points) const;

  // Begins a search for a path through the points told, which has one at least, and goes on with it by so many
  // candidates; true when it is at its end.
  void begin(const PathStart& start, const PathPoints& told);
  bool search(int candidates);
  // Clear, and not farther out of reach than the points told are without the obstacles.
  bool found() const { return best_.clear() && best_.slack_mm >= slack_needed_mm_; }
  const PathPoints& path() const { return path_; }
  // Of the best path that there is. Where none was found: how near that one comes, which is too near.
  const PathOutlook& best() const { return best_; }

 private:
  struct FreeLeg {
    double turn_rad = 0;
    double ratio = 0;  // r
    double share = 0;  // of what lies ahead until the first point told, as far as it goes
  };
  static constexpr std::size_t kMostLegs = 2, kKept = 4;
  struct Candidate {
    std::array<FreeLeg, kMostLegs> legs;
    std::size_t count = 0;
    double early = 1;
    PathOutlook outlook{.reachable = false, .room_mm = -1e9, .slack_mm = -1e9};
  };
  enum class Phase { grid, improve, done };

  class Legs;  // what moves along a path
  static Candidate on_grid(std::size_t legs, int index);
  static int grid_size(std::size_t legs);
  static void change(Candidate& candidate, int number, double way);
  // Given up where the room falls below enough_mm.
  PathOutlook walk(const Candidate& candidate, double enough_mm, PathPoints* points = nullptr) const;
  void try_next();
  void keep(const Candidate& candidate);
  void end_improving();

  std::vector<Obstacle> obstacles_;
  PathStart start_;
  PathPoints told_, path_;
  PathOutlook best_;
  double slack_needed_mm_ = 0;
  Phase phase_ = Phase::done;
  std::size_t legs_ = 0;               // of the candidates of now
  int next_ = 0;                       // of the phase
  std::array<Candidate, kKept> kept_;  // the best of the grid first
};

}  // namespace bevel::controller
