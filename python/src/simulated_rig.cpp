// SPDX-License-Identifier: MIT
#include "simulated_rig.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <bevel/error.hpp>
#include <bevel/model/kinematics.hpp>

namespace bevel::python {
namespace {

constexpr double kLongestStep_mm = 0.5, kLargestStep_rad = 0.05, kLongestStep_s = 0.02;

void require_inside_domain(const rig::Plant& plant, double insertion_mm, double rotation_rad) {
  const model::NeedleParameters& needle = plant.model().needle();
  model::Pose pose = plant.tip();
  const model::StepInput input{insertion_mm, rotation_rad, Eigen::Vector2d(needle.curvature_per_mm, 0)};
  if (!model::advance(pose, input, model::slip_parameters(needle)))
    throw DomainError("the needle leaves the domain of the slip law (Eq. 25): its heading is at " +
                      std::to_string(model::tilt_rad(plant.tip())) + " rad to z");
}

}  // namespace

SimulatedRig::SimulatedRig(std::unique_ptr<rig::Plant> plant, const Noise& noise, std::uint64_t seed)
    : plant_(std::move(plant)), noise_(noise), random_(seed) {
  passed_.push_back({0, plant_->tip().p_mm});
  record_axes(0, 0);
}

void SimulatedRig::record_axes(double insertion_rate_mm_s, double rotation_rate_rad_s) {
  constexpr auto kEnabled = static_cast<std::int32_t>(model::AxisStatus::enabled);
  model::ActuatorState state;
  state.utime = utime_of(time_s_);
  state.seq = std::ssize(recorded_.actuators) + 1;
  state.axis_status = {kEnabled, kEnabled};
  state.insertion_mm = insertion_mm_;
  state.insertion_rate_mm_s = insertion_rate_mm_s;
  state.rotation_rad = rotation_rad_;
  state.rotation_rate_rad_s = rotation_rate_rad_s;
  recorded_.actuators.push_back(state);
}

void SimulatedRig::move(double insertion_mm, double rotation_rad, double duration_s) {
  if (!std::isfinite(insertion_mm) || !std::isfinite(rotation_rad))
    throw ArgumentError("insertion_mm or rotation_rad is not finite");
  constexpr double kShortest_s = 1e-4, kLongest_s = 3600;
  if (!(duration_s >= kShortest_s && duration_s <= kLongest_s))
    throw ArgumentError("duration is " + std::to_string(duration_s) + " s; allowed: 1e-4 to 3600 s");
  const double steps = std::max({1.0, std::ceil(std::abs(insertion_mm) / kLongestStep_mm - 1e-9),
                                 std::ceil(std::abs(rotation_rad) / kLargestStep_rad - 1e-9),
                                 std::ceil(duration_s / kLongestStep_s - 1e-9)});
  const double start_s = time_s_, start_mm = insertion_mm_, start_rad = rotation_rad_;
  for (double step = 1; step <= steps; ++step) {
    require_inside_domain(*plant_, insertion_mm / steps, rotation_rad / steps);
    plant_->advance(insertion_mm / steps, rotation_rad / steps, duration_s / steps);
    time_s_ = start_s + step / steps * duration_s;
    insertion_mm_ = start_mm + step / steps * insertion_mm;
    rotation_rad_ = start_rad + step / steps * rotation_rad;
    passed_.push_back({time_s_, plant_->tip().p_mm});
  }
  record_axes(insertion_mm / duration_s, rotation_rad / duration_s);
}

Eigen::Vector3d SimulatedRig::tip_at(double time_s) const {
  const auto after = std::ranges::lower_bound(passed_, time_s, {}, &Passed::time_s);
  if (after == passed_.begin()) return passed_.front().tip_mm;
  if (after == passed_.end()) return passed_.back().tip_mm;
  const Passed &a = *(after - 1), &b = *after;
  return a.tip_mm + (time_s - a.time_s) / (b.time_s - a.time_s) * (b.tip_mm - a.tip_mm);
}

Eigen::Vector3d SimulatedRig::measure_position() {
  model::TipReading reading{tip_at(time_s_ - plant_->model().latency_s().value), {}};
  plant_->model().through_cameras(reading);
  std::normal_distribution<double> normal;
  model::TipMeasurement tip;
  tip.utime = utime_of(time_s_);
  tip.seq = std::ssize(recorded_.tips) + 1;
  Eigen::Vector3d seen;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double sigma_mm = noise_.sigma_mm[i];
    const double error = normal(random_);  // drawn in any case: the noise of one axis does not depend on the others
    const bool measured = std::isfinite(sigma_mm);
    tip.position_mm[i] = measured ? reading.position_mm[i] + sigma_mm * error : 0;
    seen[i] = measured ? tip.position_mm[i] : std::numeric_limits<double>::quiet_NaN();
    tip.information_per_mm2(i, i) = measured ? 1 / (sigma_mm * sigma_mm) : 0;
  }
  recorded_.tips.push_back(tip);

  const model::Pose pose = plant_->tip();
  const Eigen::Quaterniond q(pose.R);
  needle_state_t truth{};
  truth.utime = tip.utime;
  truth.seq = tip.seq;
  std::ranges::copy(pose.p_mm, truth.position_mm);
  truth.orientation_wxyz[0] = q.w(), truth.orientation_wxyz[1] = q.x(), truth.orientation_wxyz[2] = q.y(),
  truth.orientation_wxyz[3] = q.z();
  const model::NeedleParameters& needle = plant_->model().needle();
  truth.curvature_per_mm = needle.curvature_per_mm;
  truth.lambda1_per_rad = needle.lambda1_per_rad;
  truth.lambda2 = needle.lambda2;
  recorded_.truths.push_back(truth);
  return seen;
}

Eigen::Vector3d SimulatedRig::measure_heading() {
  const Eigen::Matrix3d R = plant_->tip().R;
  std::normal_distribution<double> normal;
  const double x = normal(random_), y = normal(random_);
  model::TipHeading reading;
  reading.utime = utime_of(time_s_);
  reading.seq = std::ssize(recorded_.headings) + 1;
  reading.heading = R * model::exp_so3(noise_.heading_rad * Eigen::Vector3d(x, y, 0)) * Eigen::Vector3d::UnitZ();
  reading.information_per_rad2 = (Eigen::Matrix3d::Identity() - reading.heading * reading.heading.transpose()) /
                                 (noise_.heading_rad * noise_.heading_rad);
  recorded_.headings.push_back(reading);
  return reading.heading;
}

void SimulatedRig::follow(const AxisMotion& motion, double camera_hz, bool headings) {
  constexpr double kFastest_hz = 1000;
  if (!(camera_hz >= 0 && camera_hz <= kFastest_hz))
    throw ArgumentError("camera_hz is " + std::to_string(camera_hz) + "; allowed: 0 to 1000");
  const double start_s = time_s_, period_s = camera_hz > 0 ? 1 / camera_hz : motion.time_s.maxCoeff() * 2 + 1;
  double due_s = start_s;
  const auto measure_if_due = [&] {
    if (camera_hz <= 0 || time_s_ + 1e-9 < due_s) return;
    measure_position();
    if (headings) measure_heading();
    while (due_s <= time_s_ + 1e-9) due_s += period_s;
  };
  measure_if_due();
  for (Eigen::Index i = 1; i < motion.time_s.size(); ++i) {
    move(motion.insertion_mm[i] - motion.insertion_mm[i - 1], motion.rotation_rad[i] - motion.rotation_rad[i - 1],
         motion.time_s[i] - motion.time_s[i - 1]);
    measure_if_due();
  }
}

Recording SimulatedRig::recording(const std::string& name) const {
  io::Recording copy = recorded_;
  order_by_time(copy);
  copy.events = std::ssize(copy.arrivals) + std::ssize(copy.truths);
  return {name, std::move(copy)};
}

}  // namespace bevel::python
