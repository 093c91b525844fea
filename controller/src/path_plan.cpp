// SPDX-License-Identifier: MIT
#include <bevel/controller/path_plan.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bevel::controller {
namespace {

constexpr int kMostSteps = 100;     // of a leg, 4 mm each
constexpr double kLeastLeg_mm = 1;  // anything nearer is passed as it comes
// A point of the planner's own is a direction to go in; what counts is how clear the path is.
constexpr double kOwnMiss_mm = 2;

// The grid of one leg and that of two, whose every number counts several times over.
struct Grid {
  std::size_t directions, shares, ratios, early;
};
constexpr std::array<Grid, 3> kGrids{{{1, 1, 1, 2}, {12, 3, 2, 2}, {8, 2, 1, 1}}};
constexpr std::array<double, 2> kRatios{1.0, 0.5}, kEarly{1.0, 0.0};
// Of the pattern search: its first steps, each time halved, in turn, r and share of each leg, and in early.
constexpr std::array<double, 3> kLegStep{0.3, 0.25, 0.15};
constexpr double kEarlyStep = 0.4;
constexpr int kHalvings = 4;

// One that is clear before one that is not; of two the one that may be off by more.
bool is_better(const PathOutlook& one, const PathOutlook& other) {
  if (one.clear() != other.clear()) return one.clear();
  return one.spare_mm() > other.spare_mm();
}

constexpr double kAny_mm = -1e9;
// The room without which no path is better than that one.
double enough_mm(const PathOutlook& than) { return std::min(0.0, than.spare_mm()); }

struct Node {  // where a path has come to
  model::Pose middle;
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();
  double come_mm = 0;  // from the start
  bool looked_ahead = false, in_domain = true;
  PathOutlook so_far;
};

}  // namespace

class PathPlanner::Legs {
 public:
  Legs(const PathStart& start, const std::vector<Obstacle>& obstacles)
      : walk_(start.needle, start.shaft),
        margin_mm_(start.margin_mm),
        reach_share_(start.reach_share),
        obstacles_(obstacles) {}

  Node begin_at(const model::Pose& tip) const {
    Node node;
    node.middle = walk_.middle_of(tip);
    node.tip_mm = tip.p_mm;
    return node;
  }

  // Through the plane of the point, as the law would go to it.
  void to(Node& node, const PathPoint& point, double early) const {
    to_plane_of(node, point, point.told ? early : 1);
    if (point.told && !node.looked_ahead) node.so_far.lookahead_mm = point.at_mm, node.looked_ahead = true;
  }

  // To the plane depth_mm ahead, the bevel turned by so much; ratio: |W| / reach.
  void free(Node& node, double turn_rad, double ratio, double depth_mm) const {
    node.middle = turned(node.middle, turn_rad);
    bend_then_straight(node, node.middle.p_mm + depth_mm * node.middle.R.col(2), ratio, 1);
  }

 private:
  void to_plane_of(Node& node, const PathPoint& point, double early) const {
    const Eigen::Vector3d along = node.middle.R.col(2);
    const Eigen::Vector3d left_mm = point.at_mm - node.tip_mm;
    if (const double ahead_mm = along.dot(left_mm); ahead_mm < kLeastLeg_mm) {
      const double miss_mm = (left_mm - std::max(ahead_mm, 0.0) * along).norm();
      node.so_far.slack_mm = std::min(node.so_far.slack_mm, -miss_mm);
      if (!(miss_mm <= std::max(point.miss_max_mm, kLeastLeg_mm))) node.so_far.reachable = false;
      return;
    }
    Eigen::Vector3d straight_mm, facing_mm;
    if (!walk_.to_plane(node.middle, point.at_mm, along, 0, straight_mm)) return lose(node);
    const Eigen::Vector3d aside = node.middle.R.transpose() * (point.at_mm - straight_mm);
    model::Pose facing = turned(node.middle, facing_rad(aside.head<2>()));
    if (!walk_.to_plane(facing, point.at_mm, along, 1, facing_mm)) return lose(node);
    const double aside_mm = aside.head<2>().norm(), reach_mm = (facing_mm - straight_mm).norm();
    node.so_far.slack_mm = std::min(node.so_far.slack_mm, reach_share_ * reach_mm - aside_mm);
    if (!(aside_mm - reach_mm <= point.miss_max_mm)) node.so_far.reachable = false;
    node.middle = facing;
    bend_then_straight(node, point.at_mm, reach_mm > 0 ? aside_mm / reach_mm : 1, early);
  }

  static void lose(Node& node) {
    node.in_domain = node.so_far.reachable = false;
    node.so_far.slack_mm = -1e9;
  }
  static model::Pose turned(model::Pose middle, double by_rad) {
    middle.R = middle.R * model::exp_so3({0, 0, by_rad});
    return middle;
  }
  // Turn that points the bevel there (arc_law.hpp).
  double facing_rad(const Eigen::Vector2d& aside_mm) const {
    const double side = walk_.end_at(0).curvature_per_mm < 0 ? -1.0 : 1.0;
    return std::atan2(side * aside_mm.x(), -side * aside_mm.y());
  }

  void bend_then_straight(Node& node, const Eigen::Vector3d& point_mm, double ratio, double early) const {
    const Eigen::Vector3d along = node.middle.R.col(2);
    const double r = std::min(ratio, 1.0), share = r + early * (1 - r);
    double bend_mm = share > 0 ? along.dot(point_mm - node.middle.p_mm) * (1 - std::sqrt(1 - r / share)) : 0;
    for (int i = 0; i < kMostSteps; ++i) {
      double step_mm = ArcWalk::step_to_plane_mm(node.middle, point_mm, along);
      if (step_mm <= 0) return;
      const double bends = bend_mm > 1e-3 ? share : 0;
      if (bends > 0) step_mm = std::min(step_mm, bend_mm);
      bend_mm -= step_mm;
      if (!walk_.step(node.middle, bends, step_mm)) return lose(node);
      pass(node, bends);
    }
    lose(node);  // farther than a needle is long
  }

  void pass(Node& node, double share) const {
    const Eigen::Vector3d to_mm = walk_.tip_mm(node.middle, share);
    // While it alternates, the tip of a stiff shaft is where its bevel happens to put it.
    const double swing_mm = (1 - share) * std::abs(walk_.end_at(to_mm.z()).swing_mm);
    for (const Obstacle& obstacle : obstacles_) {
      const double away_mm = distance_mm(obstacle, node.tip_mm, to_mm) - swing_mm;
      if (!std::isfinite(away_mm)) return lose(node);
      node.so_far.nearest_mm = std::min(node.so_far.nearest_mm, away_mm);
      node.so_far.room_mm = std::min(node.so_far.room_mm, away_mm - obstacle.clearance_mm - margin_mm_);
    }
    const double step_mm = (to_mm - node.tip_mm).norm();
    node.come_mm += step_mm;
    if (!node.looked_ahead && node.come_mm >= kLookahead_mm) {
      node.so_far.lookahead_mm = to_mm - (node.come_mm - kLookahead_mm) / step_mm * (to_mm - node.tip_mm);
      node.looked_ahead = true;
    }
    node.tip_mm = to_mm;
  }

  ArcWalk walk_;
  double margin_mm_, reach_share_;
  const std::vector<Obstacle>& obstacles_;
};

PathOutlook PathPlanner::outlook(const PathStart& start, const PathPoints& points) const {
  const Legs legs(start, obstacles_);
  Node node = legs.begin_at(start.tip);
  for (const PathPoint& point : points.all())
    if (node.in_domain) legs.to(node, point, points.early);
  return node.so_far;
}

PathOutlook PathPlanner::walk(const Candidate& candidate, double enough_mm, PathPoints* points) const {
  const Legs legs(start_, obstacles_);
  Node node = legs.begin_at(start_.tip);
  if (points) points->count = 0, points->early = candidate.early;
  for (std::size_t i = 0; i < candidate.count && node.in_domain; ++i) {
    const FreeLeg& leg = candidate.legs.at(i);
    const double ahead_mm = node.middle.R.col(2).dot(told_.points[0].at_mm - node.tip_mm);
    legs.free(node, leg.turn_rad, leg.ratio, leg.share * std::max(ahead_mm, kLeastLeg_mm));
    if (points) points->add({node.tip_mm, kOwnMiss_mm, false});
    if (node.so_far.room_mm < enough_mm) {  // as it goes on it only falls
      node.so_far.reachable = false;
      return node.so_far;
    }
  }
  for (const PathPoint& point : told_.all()) {
    if (node.in_domain) legs.to(node, point, candidate.early);
    if (points) points->add(point);
  }
  return node.so_far;
}

void PathPlanner::begin(const PathStart& start, const PathPoints& told) {
  start_ = start;
  told_ = path_ = told;
  Candidate direct;
  best_ = walk(direct, kAny_mm);
  slack_needed_mm_ = std::min(best_.slack_mm, 0.0);
  legs_ = 0, next_ = 0;
  kept_.fill({});
  phase_ = found() ? Phase::done : Phase::grid;
}

bool PathPlanner::search(int candidates) {
  for (; candidates > 0 && phase_ != Phase::done; --candidates) try_next();
  return phase_ == Phase::done;
}

int PathPlanner::grid_size(std::size_t legs) {
  const Grid& grid = kGrids.at(legs);
  std::size_t size = grid.early;
  for (std::size_t i = 0; i < legs; ++i) size *= grid.directions * grid.shares * grid.ratios;
  return static_cast<int>(size);
}

PathPlanner::Candidate PathPlanner::on_grid(std::size_t legs, int index) {
  const Grid& grid = kGrids.at(legs);
  Candidate candidate;
  candidate.count = legs;
  auto rest = static_cast<std::size_t>(index);
  const auto digit = [&rest](std::size_t base) {
    const std::size_t value = rest % base;
    rest /= base;
    return value;
  };
  candidate.early = kEarly.at(digit(grid.early));
  for (std::size_t i = 0; i < legs; ++i) {
    FreeLeg& leg = candidate.legs.at(i);
    leg.turn_rad =
        2 * std::numbers::pi * static_cast<double>(digit(grid.directions)) / static_cast<double>(grid.directions);
    leg.share = static_cast<double>(1 + digit(grid.shares)) / static_cast<double>(1 + grid.shares);
    leg.ratio = kRatios.at(digit(grid.ratios));
  }
  return candidate;
}

// One of its numbers by a share of that number's first step.
void PathPlanner::change(Candidate& candidate, int number, double way) {
  const auto leg = static_cast<std::size_t>(number / 3);
  const double by = way * (leg < candidate.count ? kLegStep.at(static_cast<std::size_t>(number % 3)) : kEarlyStep);
  if (leg == candidate.count)
    candidate.early = std::clamp(candidate.early + by, 0.0, 1.0);
  else if (number % 3 == 0)
    candidate.legs.at(leg).turn_rad += by;
  else if (number % 3 == 1)
    candidate.legs.at(leg).ratio = std::clamp(candidate.legs.at(leg).ratio + by, 0.0, 1.0);
  else
    candidate.legs.at(leg).share = std::clamp(candidate.legs.at(leg).share + by, 0.05, 0.95);
}

// Sorted in, the worst drops out.
void PathPlanner::keep(const Candidate& candidate) {
  if (!is_better(candidate.outlook, kept_.back().outlook)) return;
  kept_.back() = candidate;
  for (std::size_t i = kept_.size() - 1; i > 0 && is_better(kept_.at(i).outlook, kept_.at(i - 1).outlook); --i)
    std::swap(kept_.at(i), kept_.at(i - 1));
}

void PathPlanner::try_next() {
  if (phase_ == Phase::grid) {
    Candidate candidate = on_grid(legs_, next_);
    candidate.outlook = walk(candidate, enough_mm(kept_.back().outlook));
    keep(candidate);
    if (++next_ == grid_size(legs_)) phase_ = Phase::improve, next_ = 0;
    return;
  }
  const int numbers = 3 * static_cast<int>(legs_) + 1, each = kHalvings * numbers * 2;
  Candidate& kept = kept_.at(static_cast<std::size_t>(next_ / each));
  if (kept.count != legs_) kept = on_grid(legs_, 0);  // fewer than are kept
  Candidate tried = kept;
  const double way = std::pow(0.5, next_ % each / (2 * numbers));
  change(tried, next_ / 2 % numbers, next_ % 2 == 0 ? way : -way);
  tried.outlook = walk(tried, enough_mm(kept.outlook));
  if (is_better(tried.outlook, kept.outlook)) kept = tried;
  if (++next_ == each * static_cast<int>(kKept)) end_improving();
}

void PathPlanner::end_improving() {
  const Candidate& best = *std::ranges::max_element(
      kept_, [](const Candidate& a, const Candidate& b) { return is_better(b.outlook, a.outlook); });
  if (is_better(best.outlook, best_)) best_ = walk(best, kAny_mm, &path_);
  if (found() || legs_ == kMostLegs) {
    phase_ = Phase::done;
    return;
  }
  ++legs_;
  next_ = 0;
  kept_.fill({});
  phase_ = Phase::grid;
}

}  // namespace bevel::controller
