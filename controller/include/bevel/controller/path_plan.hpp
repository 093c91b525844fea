// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Planning of a feasible path to the target that avoids the obstacles.
///
/// A path leads through a sequence of points: up to two points of the planner, the operator's way-points, the target.
/// The leg from a pose to a point (arc_law.hpp defines W and reach) faces W and bends until W is 0, then goes straight
/// by alternating the bevel. With the distance q to the point and r = |W| / reach, the bend ends after
/// q (1 - sqrt(1 - r)): W decreases with the insertion s by k (q s - s^2 / 2), and the reach is k q^2 / 2. The next leg
/// begins in the final pose of the previous one. Law::arcs follows the path, aimed at its point kLookahead_mm ahead of
/// the tip (route.hpp).
///
/// The search space is that of the needle's inputs. The planner's points are the ends of free legs. The parameters of a
/// free leg are a rotation of the bevel, r and a length. The search tries no free leg, then one, then two. Each stage
/// evaluates a coarse grid and improves the best candidates by pattern search (Hooke and Jeeves 1961). Among the paths
/// with the fewest points, the result has the largest margin to the obstacles and to the reach.
#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <bevel/controller/arc_walk.hpp>
#include <bevel/controller/obstacle.hpp>

namespace bevel::controller {

inline constexpr std::size_t kMostWayPoints = 8;                ///< largest number of the operator's way-points
inline constexpr std::size_t kMostPoints = kMostWayPoints + 3;  ///< largest number of points of a path

/// Look-ahead distance of the law on a path, mm. A shorter one causes more rotations, a longer one cuts corners.
inline constexpr double kLookahead_mm = 30,
                        kLeaves = 0.1;  ///< bound of the deviation from a path by alternating, as a share of the bend
                                        ///< k kLookahead_mm^2 (tests/controller/path_plan_test.cpp)

/// Point of a path.
struct PathPoint {
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();  ///< position in {A}, mm
  double miss_max_mm = 0;                           ///< largest allowed miss, mm
  bool told = false;                                ///< commanded by the operator; false: a point of the planner
};

/// Points of a path in their order, the target last.
struct PathPoints {
  std::array<PathPoint, kMostPoints> points;  ///< the points; the first `count` are valid
  std::size_t count = 0;                      ///< number of points
  /// Position of the bend on legs to commanded points, in [0, 1]: the share of the curvature is c = r + early (1 - r).
  /// 1: as early as possible; 0: evenly.
  double early = 1;
  /// Appends a point; without effect if there are kMostPoints.
  /// @param point the point
  void add(const PathPoint& point) {
    if (count < kMostPoints) points.at(count++) = point;
  }
  /// Returns the valid points.
  /// @return the first `count` points
  std::span<const PathPoint> all() const { return {points.data(), count}; }
};

/// Start pose, needle and margins of a path.
struct PathStart {
  model::Pose tip;                 ///< pose of the shaft's end in {A}, mm
  model::NeedleParameters needle;  ///< parameters of the needle
  ShaftConfig shaft;               ///< stiffness of the shaft
  double margin_mm = 0;            ///< uncertainty of the path, mm; adds to the clearance of the obstacles
  double reach_share = 1;          ///< share of the reach that a path may use, in [0, 1]
};

/// Predicted path through a sequence of points.
struct PathOutlook {
  bool reachable = true;    ///< every point is within its allowed miss; false outside the model's domain
  double nearest_mm = 1e9;  ///< smallest distance to the surface of an obstacle, mm
  double room_mm = 1e9;     ///< smallest distance to an obstacle beyond its clearance and the margin, mm
  double slack_mm = 1e9;    ///< smallest excess of the reach over |W| among the points, mm
  /// Point of the path kLookahead_mm ahead of the tip, or the first commanded point if that is nearer; {A}, mm.
  Eigen::Vector3d lookahead_mm = Eigen::Vector3d::Zero();
  /// Returns whether the path reaches its points and keeps clear of the obstacles.
  /// @return true if `reachable` and `room_mm` is positive
  bool clear() const { return reachable && room_mm > 0; }
  /// Computes the smaller of the two margins.
  /// @return the smaller of `room_mm` and `slack_mm`, mm
  double spare_mm() const { return std::min(room_mm, slack_mm); }
};

/// Searches for a path, in portions for the control periods. The search does not allocate.
class PathPlanner {
 public:
  /// Constructs the planner.
  /// @param obstacles obstacles to avoid
  explicit PathPlanner(std::vector<Obstacle> obstacles) : obstacles_(std::move(obstacles)) {}
  /// Returns the obstacles.
  /// @return obstacles given to the constructor
  const std::vector<Obstacle>& obstacles() const { return obstacles_; }

  /// Predicts the path of the law through given points.
  /// @param start start pose, needle and margins
  /// @param points points of the path, the target last
  /// @return predicted path
  PathOutlook outlook(const PathStart& start, const PathPoints& points) const;

  /// Begins a search.
  /// @param start start pose, needle and margins
  /// @param told commanded points, the target last; precondition: at least one
  void begin(const PathStart& start, const PathPoints& told);
  /// Continues the search.
  /// @param candidates largest number of candidates to evaluate
  /// @return true if the search has ended
  bool search(int candidates);
  /// Returns whether the search has found a path.
  /// @return true if the best path is clear, and not farther out of reach than the direct path through the commanded
  ///     points
  bool found() const { return best_.clear() && best_.slack_mm >= slack_needed_mm_; }
  /// Returns the points of the best path.
  /// @return points, the target last
  const PathPoints& path() const { return path_; }
  /// Returns the prediction of the best path; if no path was found, that of the best rejected one.
  /// @return predicted path
  const PathOutlook& best() const { return best_; }

 private:
  struct FreeLeg {
    double turn_rad = 0;
    double ratio = 0;  // r
    double share = 0;  // length over the distance to the first commanded point
  };
  static constexpr std::size_t kMostLegs = 2, kKept = 4;
  struct Candidate {
    std::array<FreeLeg, kMostLegs> legs;
    std::size_t count = 0;
    double early = 1;
    PathOutlook outlook{.reachable = false, .room_mm = -1e9, .slack_mm = -1e9};
  };
  enum class Phase { grid, improve, done };

  class Legs;  // prediction along a path
  static Candidate on_grid(std::size_t legs, int index);
  static int grid_size(std::size_t legs);
  static void change(Candidate& candidate, int number, double way);
  // Stops if room_mm falls below enough_mm.
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
  std::size_t legs_ = 0;               // number of free legs of the present stage
  int next_ = 0;                       // index within the phase
  std::array<Candidate, kKept> kept_;  // best candidates of the grid, the best first
};

}  // namespace bevel::controller
