// SPDX-License-Identifier: MIT
#include <bevel/nodes/rig_node.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/drivers/camera/calibrated_view.hpp>
#include <bevel/error.hpp>
#include <bevel/model/lie.hpp>
#include <bevel/nodes/needle_pose.hpp>

namespace bevel::nodes {
namespace {

constexpr std::int64_t kTruthPeriod_ns = 10'000'000;

rig::SimulatedDriveConfig drive_config(const stepper::AxisConfig& axis, const LimitSwitchConfig& switches) {
  rig::SimulatedDriveConfig config;
  config.node_id = axis.node_id;
  config.counts_per_unit = axis.counts_per_unit;
  const auto [low, high] =
      std::minmax({axis.counts_per_unit * switches.min_unit, axis.counts_per_unit * switches.max_unit});
  config.switches = {low, high};
  return config;
}

// Information W of a heading that is as uncertain to all sides, per rad^2; v: heading over standard deviation. W =
// [v]x' [v]x is zero along v, where rounding makes it negative as often as not. No entry is rounded by more than a
// share of sqrt(W_ii W_jj), so that a few such shares more on the diagonal keep every eigenvalue from falling below
// zero.
Eigen::Matrix3d information_across(const Eigen::Vector3d& v) {
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  const Eigen::Matrix3d cross = model::hat(v);
  Eigen::Matrix3d information = cross.transpose() * cross;
  information.diagonal() *= 1 + kRounding;
  return information;
}

}  // namespace

RigNode::RigNode(lcm::LCM& lcm, can::Bus& insertion_bus, can::Bus& rotation_bus, const SystemConfig& config,
                 rig::FrameServer* frames)
    : config_(config),
      port_(lcm),
      status_(port_, "bevel-rig", 0.001),
      buses_{FaultyBus(insertion_bus, config.stepper.axes[0].node_id),
             FaultyBus(rotation_bus, config.stepper.axes[1].node_id)},
      frames_(frames),
      heading_noise_(static_cast<std::uint64_t>(config.rig.seed)) {
  drives_[0] = std::make_unique<rig::SimulatedDrive>(
      buses_[0], drive_config(config.stepper.axes[0], config.rig.limit_switches[0]));
  drives_[1] = std::make_unique<rig::SimulatedDrive>(
      buses_[1], drive_config(config.stepper.axes[1], config.rig.limit_switches[1]));
  own_values_ = model::draw(config.rig.variation, static_cast<std::uint64_t>(config.rig.seed));
  const auto effects = io::active_effects(config.rig.effects, config.rig.discrepancies, "");
  if (config.rig.beam)
    plant_ = std::make_unique<rig::BeamNeedle>(*config.rig.beam, effects, config.rig.roll_error_rad, own_values_);
  else
    plant_ = std::make_unique<rig::KinematicPlant>(config.rig.truth, effects, config.rig.roll_error_rad, own_values_,
                                                   rig::Cut::kept);
  for (const CameraViewConfig& c : config.cameras) {
    rig::SceneConfig scene;
    scene.size_px = {c.width_px, c.height_px};
    scene.needle_diameter_mm = c.tracker.needle_diameter_mm;
    scene.bevel_length_mm = c.tracker.bevel_length_mm;
    scene.noise_gray = config.rig.noise_gray;
    scene.blur_px = config.rig.blur_px;
    scene.seed = static_cast<std::uint64_t>(config.rig.seed + c.camera);
    if (c.calibrated) {
      auto view = std::make_shared<camera::CalibratedView>(*c.calibrated);
      const bool nearer_x = std::abs(view->plane_normal()[0]) > std::abs(view->plane_normal()[1]);
      eyes_.push_back({c.camera, nearer_x, rig::NeedleRenderer(scene, std::move(view))});
      continue;
    }
    const bool along_x = c.view.u_axis.axis != camera::WorldAxis::x && c.view.v_axis.axis != camera::WorldAxis::x;
    eyes_.push_back({c.camera, along_x, rig::NeedleRenderer(scene, camera::PlanarView(c.view))});
  }
}

void RigNode::break_drive(const Fault& fault, std::int64_t start_ns, std::uint64_t seed) {
  if (fault.component != Component::insertion_drive && fault.component != Component::rotation_drive)
    throw ArgumentError(std::string("fault: the rig has no ") + name_of(fault.component) +
                        "; allowed: insertion_drive, rotation_drive");
  const std::size_t axis = fault.component == Component::insertion_drive ? 0 : 1;
  const std::int64_t from_ns = start_ns + std::llround(fault.at_s * 1e9);
  if (fault.kind == FaultKind::stuck) {
    blocked_axis_ = axis;
    blocked_from_ns_ = from_ns;
    return;
  }
  buses_.at(axis).begin(fault.kind, from_ns, seed);
}

void RigNode::step(const Now& now) {
  const auto [now_ns, now_utime] = now;
  port_.tell_time(now);
  if (blocked_axis_) drives_.at(*blocked_axis_)->set_motor_blocked(now_ns >= blocked_from_ns_);
  for (auto& drive : drives_) drive->step(now_ns);
  move_plant(now_ns);
  if (now_ns >= next_truth_ns_) {
    next_truth_ns_ = now_ns + kTruthPeriod_ns;
    publish_truth(now_utime);
  }
  if (frames_ && now_ns >= next_frame_ns_) {
    const auto period_ns = std::llround(1e9 / config_.rig.frame_rate_hz);
    next_frame_ns_ = std::max(next_frame_ns_ + period_ns, now_ns + period_ns / 2);
    take_frames(now);
  }
  publish_frames(now_ns);
  if (config_.rig.heading.sd_rad > 0 && now_ns >= next_heading_ns_) {
    const auto period_ns = std::llround(1e9 / config_.rig.heading.rate_hz);
    next_heading_ns_ = std::max(next_heading_ns_ + period_ns, now_ns + period_ns / 2);
    take_heading(now);
  }
  publish_headings(now_ns);
  status_.report(io::ProcessState::running, "");
}

void RigNode::move_plant(std::int64_t now_ns) {
  const double dt_s = last_ns_ ? static_cast<double>(now_ns - last_ns_) * 1e-9 : 0;
  last_ns_ = now_ns;
  const std::array<double, 2> at{drives_[0]->position_unit(), drives_[1]->position_unit()};
  plant_->advance(at[0] - moved_[0], at[1] - moved_[1], dt_s);
  moved_ = at;
}

void RigNode::publish_truth(std::int64_t now_utime) {
  const model::Pose tip = plant_->tip();
  needle_state_t m{};
  m.utime = now_utime;
  m.seq = truth_seq_++;
  write_pose(tip, m);
  const model::NeedleParameters& needle = plant_->model().needle();
  m.curvature_per_mm = needle.curvature_per_mm;
  m.lambda1_per_rad = needle.lambda1_per_rad;
  m.lambda2 = needle.lambda2;
  port_.publish(io::channel::kNeedleTruth, m);
}

// Through the cameras' effects and with their delay, as the estimator takes what a model file says of them.
void RigNode::take_heading(const Now& now) {
  const model::Pose tip = plant_->tip();
  const auto seen_mm = [&](double ahead_mm) {
    model::TipReading reading{tip.p_mm + ahead_mm * tip.R.col(2), model::PointColumns(3, 0)};
    plant_->model().through_cameras(reading);
    return reading.position_mm;
  };
  const Eigen::Vector3d ahead = (seen_mm(0.5) - seen_mm(-0.5)).normalized();
  const double sd_rad = config_.rig.heading.sd_rad;
  std::normal_distribution<double> noise(0, sd_rad);
  const Eigen::Vector3d aside = ahead.unitOrthogonal();
  const double right_rad = noise(heading_noise_), up_rad = noise(heading_noise_);
  const auto late_us = std::llround(1e6 * plant_->model().latency_s().value);
  model::TipHeading m;
  m.utime = now.utime + late_us;
  m.seq = heading_seq_++;
  m.camera = config_.rig.heading.camera;
  m.heading = (ahead + right_rad * aside + up_rad * ahead.cross(aside)).normalized();
  m.information_per_rad2 = information_across(m.heading / sd_rad);
  felt_.push_back({now.ns + 1000 * late_us, io::to_message(m)});
}

void RigNode::publish_headings(std::int64_t now_ns) {
  for (; !felt_.empty() && felt_.front().due_ns <= now_ns; felt_.pop_front())
    port_.publish(io::channel::kTipHeading, felt_.front().heading);
}

void RigNode::take_frames(const Now& now) {
  const auto late_us = std::llround(1e6 * plant_->model().latency_s().value);
  const auto to_camera = [](const std::vector<Eigen::Vector3d>& shaft_mm) {
    std::vector<camera::Vector3> path;
    for (const Eigen::Vector3d& p : shaft_mm) path.push_back({p.x(), p.y(), p.z()});
    return path;
  };
  const auto path = to_camera(plant_->shaft_mm());
  const auto path_along_x = to_camera(rig::shaft_seen_along_x(*plant_));
  const auto vector = [](const Eigen::Vector3d& v) { return camera::Vector3{v.x(), v.y(), v.z()}; };
  const model::Pose tip = plant_->tip();
  for (Eye& eye : eyes_) {
    // A bevel's point is on the side to which the needle bends: body -y (bevel/model/needle.hpp).
    const double roll_rad = eye.renderer.roll_seen_rad(vector(tip.p_mm), vector(tip.R.col(2)), vector(-tip.R.col(1)));
    camera::Frame frame;
    frame.capture_utime = now.utime + late_us;
    frame.seq = frame_seq_;
    frame.camera = eye.camera;
    frame.gray = eye.renderer.render(eye.along_x ? path_along_x : path, roll_rad).gray;
    taken_.push_back({now.ns + 1000 * late_us, std::move(frame)});
  }
  ++frame_seq_;
}

void RigNode::publish_frames(std::int64_t now_ns) {
  for (; !taken_.empty() && taken_.front().due_ns <= now_ns; taken_.pop_front()) frames_->publish(taken_.front().frame);
}

}  // namespace bevel::nodes
