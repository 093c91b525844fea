// SPDX-License-Identifier: MIT
#include <bevel/rig/steering/steered_insertion.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <bevel/estimator/entry_line.hpp>
#include <bevel/estimator/health.hpp>
#include <bevel/estimator/needle_estimator.hpp>

namespace bevel::rig {
namespace {

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
constexpr std::int64_t kTick_us = 5'000;
constexpr std::int64_t kActuatorPeriod_us = 10'000;
constexpr std::int64_t kSettle_us = 500'000;  // at rest before it is told to go: the filter has seen the tip
constexpr std::int64_t kFollow_us = 60'000;   // between words on a target that moves
constexpr std::int64_t kTimeLimit_us = 240'000'000;

// Coloured noise along each axis that is seen, and one message a frame from each camera.
class Eyes {
 public:
  Eyes(const Cameras& cameras, std::uint64_t seed)
      : cameras_(cameras),
        random_(seed),
        coloured_mm_(cameras.axes.size()),
        turned_(model::exp_so3(cameras.turned_rad)) {
    for (std::size_t c = 0; c < coloured_mm_.size(); ++c) coloured_mm_[c] = cameras.axes[c].sd_mm * normal_(random_);
  }

  void take(const rig::Plant& plant, std::int64_t utime) {
    model::TipReading reading{plant.tip().p_mm, model::PointColumns(3, 0)};
    plant.model().through_cameras(reading);
    const Eigen::Vector3d seen_mm = turned_ * reading.position_mm;
    const std::int64_t late_us = std::llround(1e6 * plant.model().latency_s().value);
    std::map<int, model::TipMeasurement> frames;
    const double rho = cameras_.ar1;
    for (std::size_t c = 0; c < cameras_.axes.size(); ++c) {
      const SeenAxis& one = cameras_.axes[c];
      coloured_mm_[c] = rho * coloured_mm_[c] + std::sqrt(1 - rho * rho) * one.sd_mm * normal_(random_);
      model::TipMeasurement& frame = frames[one.camera];
      frame.position_mm += one.axis * (one.axis.dot(seen_mm) + coloured_mm_[c]);
      // What frames of correlated noise are worth to a filter for white noise, as bevel-replay puts it.
      const double white_variance = one.sd_mm * one.sd_mm * (1 + rho) / (1 - rho);
      frame.information_per_mm2 += one.axis * one.axis.transpose() / white_variance;
    }
    const std::int64_t transport_us = std::llround(1e6 * cameras_.transport_s);
    for (auto& [camera, frame] : frames) {
      spoil(frame, camera);
      frame.utime = utime + late_us;
      frame.seq = seq_;
      frame.camera = camera;
      under_way_.push_back({std::max(frame.utime, utime + transport_us), frame});
    }
    ++seq_;
  }

  void deliver(estimator::NeedleEstimator& estimator, estimator::EntryLine& entry, std::int64_t utime) {
    for (; !under_way_.empty() && under_way_.front().arrives_utime <= utime; under_way_.pop_front()) {
      estimator.add(under_way_.front().measurement);
      entry.add(under_way_.front().measurement);
    }
  }

 private:
  struct UnderWay {
    std::int64_t arrives_utime;
    model::TipMeasurement measurement;
  };
  void spoil(model::TipMeasurement& frame, int camera) {
    if (cameras_.outlier_share <= 0 || uniform_(random_) >= cameras_.outlier_share) return;
    const Eigen::Vector3d off = Eigen::Vector3d(normal_(random_), normal_(random_), normal_(random_)).normalized();
    const double by_mm = 3 + 7 * uniform_(random_);
    for (const SeenAxis& one : cameras_.axes)
      if (one.camera == camera) frame.position_mm += by_mm * one.axis * one.axis.dot(off);
  }

  const Cameras& cameras_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0, 1};
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::vector<double> coloured_mm_;
  Eigen::Matrix3d turned_;
  std::deque<UnderWay> under_way_;
  std::int64_t seq_ = 0;
};

controller::NeedleView view_of(const estimator::Estimate& estimate) {
  controller::NeedleView view;
  view.utime = estimate.utime;
  view.pose = estimate.tip;
  view.curvature_per_mm = estimate.state.curvature_per_mm;
  view.lambda1_per_rad = estimate.state.lambda1_per_rad;
  view.lambda2 = estimate.state.lambda2;
  view.bending_mm = estimate.state.bending_mm;
  view.uncertain = {std::sqrt(estimate.state.covariance(6, 6)),
                    estimate.state.bending_mm > 0 ? std::sqrt(estimate.state.tenth_variance) : 0};
  view.position_variance_mm2 = estimate.state.covariance.diagonal().head<3>().maxCoeff();
  view.heading_variance_rad2 = estimate.state.covariance.diagonal().segment<2>(3).maxCoeff();
  view.health = estimator::lost(estimate.health);
  view.unsure = (estimate.health & estimator::kUnsure) != 0;
  view.reset_count = estimate.state.reset_count;
  view.reset_cause = estimate.health & estimator::kResetBits;
  return view;
}

// Where the tip was at each inserted length on the way in.
class WayIn {
 public:
  void pass(double insertion_mm, const Eigen::Vector3d& tip_mm) { way_.emplace_back(insertion_mm, tip_mm); }
  double distance_mm(double insertion_mm, const Eigen::Vector3d& tip_mm) const {
    if (way_.size() < 2) return 0;
    const auto after = std::ranges::lower_bound(way_.begin() + 1, way_.end() - 1, insertion_mm, {},
                                                [](const auto& passed) { return passed.first; });
    const auto &a = *(after - 1), &b = *after;
    const double length_mm = b.first - a.first;
    const double share = length_mm > 0 ? (insertion_mm - a.first) / length_mm : 1;
    return (a.second + share * (b.second - a.second) - tip_mm).norm();
  }

 private:
  std::vector<std::pair<double, Eigen::Vector3d>> way_;
};

// The controller, or a law that it is measured against.
class Pilot {
 public:
  Pilot(const controller::ControllerConfig& config, const model::NeedleParameters& needle, const Believed& believed)
      : supervisor_(config, needle, believed.undone), period_s_(config.period_s) {
    if (believed.baseline) baseline_.emplace(*believed.baseline, config.limits);
  }
  void see(const model::ActuatorState& axes) { supervisor_.set_actuator(axes); }
  void see(const controller::NeedleView& needle) { supervisor_.set_needle(needle); }
  void request(controller::Request request, const Eigen::Vector3d& target_mm, std::int64_t utime) {
    told_mm_ = target_mm;
    supervisor_.request(request, controller::Target{target_mm, 0}, utime);
  }
  controller::Rates step(const controller::NeedleView& needle, const model::ActuatorState& axes, std::int64_t utime) {
    if (baseline_) return baseline_->step(needle, axes, told_mm_, period_s_);
    const model::MotionCommand command = supervisor_.step(utime, period_s_);
    return {command.insertion_rate_mm_s, command.rotation_rate_rad_s};
  }
  bool moves() const { return baseline_ ? baseline_->moves() : supervisor_.moves(); }
  bool holds() const {
    return baseline_ ? baseline_->arrived() : supervisor_.status().state == controller::State::hold;
  }
  bool comes_to_rest() const { return reason() == controller::Reason::coming_to_rest; }
  controller::Reason reason() const {
    using controller::Reason;
    if (!baseline_) return supervisor_.status().reason;
    return moves() ? Reason::none : !holds() ? Reason::state_unhealthy : Reason::held;
  }
  controller::Miss reported() const { return supervisor_.status().miss; }
  const controller::Status& status() const { return supervisor_.status(); }
  bool has_report() const { return !baseline_; }

 private:
  controller::Supervisor supervisor_;
  double period_s_;
  std::optional<BaselineSteering> baseline_;
  Eigen::Vector3d told_mm_ = Eigen::Vector3d::Zero();
};

StopCause stop_cause(const Pilot& pilot, const estimator::NeedleEstimator& estimator,
                     const estimator::Estimate& estimate, std::int64_t utime, double depth_mm) {
  using controller::Reason;
  const Reason reason = pilot.reason();
  StopCause cause;
  cause.reason = reason == Reason::none ? "the time limit" : to_string(reason);
  cause.depth_mm = depth_mm;
  if (pilot.has_report() && reason != Reason::none) {
    const controller::Status& status = pilot.status();
    cause.value = status.value, cause.unit = status.unit;
    if (status.allowed.place[0] != '\0') cause.limit = status.allowed.most;
  }
  if (reason == Reason::state_unhealthy) {
    const estimator::HealthFinding finding = estimator.finding(estimate, utime);
    if (finding.flag != estimator::kHealthy) cause.reason += std::string(", ") + finding.quantity;
    cause.value = finding.value, cause.limit = finding.limit, cause.unit = finding.unit;
  }
  if (reason == Reason::state_reset) {
    cause.reason += ", " + estimator::describe_health(estimator::reset_bit(estimate.state.reset_cause));
    cause.value = 0, cause.unit.clear();
  }
  return cause;
}

}  // namespace

Insertion steer(const SteeredRig& rig, const Believed& believed, const Eigen::Vector3d& target_mm, std::uint64_t seed,
                bool told_the_tip) {
  const std::unique_ptr<rig::Plant> plant = rig.make_plant();
  Eyes cameras(rig.cameras, seed);
  estimator::EstimatorConfig settings = believed.estimator;
  // A rig whose camera is late has its limit set for that: it is not what is looked at here.
  settings.limits.measurement_age_s += plant->model().latency_s().value;
  estimator::NeedleEstimator estimator(settings);
  estimator::EntryLine entry(entry_line_config(settings));
  controller::ControllerConfig config = believed.controller;
  config.through_channel = settings.through_channel && settings.effects.empty();
  const model::NeedleParameters needle = model::AugmentedNeedle(settings.prior.needle, settings.effects).needle();
  Pilot pilot(config, needle, believed);
  const auto frame_us = std::llround(1e6 * rig.cameras.frame_s);
  const auto control_us = std::llround(1e6 * config.period_s);
  const double tick_s = static_cast<double>(kTick_us) * 1e-6;
  Insertion result;
  model::ActuatorState axes;
  axes.axis_status = {static_cast<std::int32_t>(model::AxisStatus::enabled),
                      static_cast<std::int32_t>(model::AxisStatus::enabled)};
  std::int64_t next_frame_us = 0;
  bool started = false;
  std::optional<Eigen::Vector3d> met_mm;  // the target when the needle stopped
  // To the target before, drawn back from it, to the target itself.
  enum class Leg { before, back, last } leg = believed.before ? Leg::before : Leg::last;
  WayIn way;
  std::vector<double> way_point_miss_mm(believed.way_points_mm.size(), std::numeric_limits<double>::infinity());
  estimator::Estimate estimate;
  std::int64_t estimated_utime = 0;
  const auto target_now = [&] { return rig.target_mm ? rig.target_mm(result.duration_s) : target_mm; };
  for (std::int64_t us = 0; us < kTimeLimit_us; us += kTick_us) {
    const std::int64_t utime = kStart_utime + us;
    if (us > 0) {
      const double insertion_mm = axes.insertion_rate_mm_s * tick_s, rotation_rad = axes.rotation_rate_rad_s * tick_s;
      const Eigen::Vector3d before_mm = plant->tip().p_mm;
      plant->advance(insertion_mm, rotation_rad, tick_s);
      for (std::size_t i = 0; i < way_point_miss_mm.size(); ++i)
        way_point_miss_mm[i] = std::min(way_point_miss_mm[i], (plant->tip().p_mm - believed.way_points_mm[i]).norm());
      for (const controller::Obstacle& obstacle : config.obstacles)
        result.nearest_mm =
            std::min(result.nearest_mm, controller::distance_mm(obstacle, before_mm, plant->tip().p_mm));
      axes.insertion_mm += insertion_mm, axes.rotation_rad += rotation_rad;
      result.turned_rad += std::abs(rotation_rad);
      const Eigen::Vector3d tip_mm = plant->tip().p_mm;
      if (leg == Leg::before) way.pass(axes.insertion_mm, tip_mm);
      if (leg == Leg::back)
        result.off_the_path_mm = std::max(result.off_the_path_mm, way.distance_mm(axes.insertion_mm, tip_mm));
      if (started && !met_mm) result.duration_s += tick_s;
    }
    if (us % kActuatorPeriod_us == 0) {
      axes.utime = utime;
      ++axes.seq;
      estimator.add(axes);
      entry.add(axes);
      pilot.see(axes);
    }
    if (us >= next_frame_us) {
      next_frame_us += frame_us;
      cameras.take(*plant, utime);
    }
    cameras.deliver(estimator, entry, utime);
    if (result.turned_frame_said_mm == 0 && entry.is_turned()) result.turned_frame_said_mm = axes.insertion_mm;
    if (us % control_us != 0 || us < kSettle_us) continue;
    estimate = estimator.estimate(utime), estimated_utime = utime;
    controller::NeedleView view = view_of(estimate);
    if (leg == Leg::back)
      result.drawn_back_error_mm = std::max(result.drawn_back_error_mm, (view.pose.p_mm - plant->tip().p_mm).norm());
    if (told_the_tip) view.pose = plant->tip();
    pilot.see(view);
    using controller::Request;
    const auto go = [&](const Eigen::Vector3d& to_mm) {
      for (const Eigen::Vector3d& point_mm : believed.way_points_mm) pilot.request(Request::way_point, point_mm, utime);
      pilot.request(Request::arm, to_mm, utime);
      pilot.request(Request::start, to_mm, utime);
      started = true;
    };
    if (!started) go(leg == Leg::before ? believed.before->target_mm : target_mm);
    if (rig.target_mm && !met_mm && us % kFollow_us == 0) pilot.request(Request::follow, target_now(), utime);
    const controller::Rates rates = pilot.step(view, axes, utime);
    axes.insertion_rate_mm_s = rates.insertion_mm_s;
    axes.rotation_rate_rad_s = rates.rotation_rad_s;
    if (pilot.moves()) continue;
    if (!met_mm) met_mm = target_now();
    if (pilot.comes_to_rest()) continue;
    if (leg == Leg::last || !pilot.holds()) break;
    met_mm.reset();
    if (leg == Leg::before) {
      leg = Leg::back;
      result.before_miss_mm = (plant->tip().p_mm - believed.before->target_mm).norm();
      pilot.request(Request::retract, {0, 0, axes.insertion_mm - believed.before->drawn_back_mm}, utime);
    } else if (rates.insertion_mm_s == 0) {
      leg = Leg::last;
      go(target_mm);
    }
  }
  result.inserted_mm = axes.insertion_mm;
  result.at_depth = leg == Leg::last && pilot.holds();
  result.reason = pilot.reason();
  if (!result.at_depth) result.stopped = stop_cause(pilot, estimator, estimate, estimated_utime, plant->tip().p_mm.z());
  if (pilot.has_report()) result.reported = pilot.reported();
  if (!way_point_miss_mm.empty()) result.way_point_miss_mm = std::ranges::max(way_point_miss_mm);
  result.miss_mm = (plant->tip().p_mm - met_mm.value_or(target_now())).norm();
  const estimator::Estimate last = estimator.estimate(axes.utime);
  result.estimate_error_mm = (last.tip.p_mm - plant->tip().p_mm).norm();
  const model::Vector6d error = model::log_se3(last.tip.inverse() * plant->tip());
  result.pose_nees = error.dot(last.state.covariance.topLeftCorner<6, 6>().ldlt().solve(error));
  return result;
}

}  // namespace bevel::rig
