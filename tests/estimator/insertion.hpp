// SPDX-License-Identifier: MIT
#pragma once
// A simulated insertion for the estimator's tests: true path, actuator states at 100 Hz, tip measurements at 30 Hz, and
// headings with them if asked for.
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include <bevel/estimator/config.hpp>
#include <bevel/model/motion_direction.hpp>
#include <bevel/model/samples.hpp>
#include <bevel/model/slip.hpp>

namespace bevel::estimator::testing {

struct Insertion {
  std::vector<model::ActuatorState> actuators;
  std::vector<model::TipMeasurement> measurements;
  std::vector<model::TipHeading> headings;  // in the order of utime, as all of these
  std::vector<model::Pose> poses;           // true, at each actuator state
  model::Pose final_pose;                   // at the newest actuator state
  // The direction of motion stayed within the range for which the parameters were found valid. Where it does not, the
  // model says nothing, and a truth made of it is none: near 90 degrees the simulated tip would stand still.
  bool in_domain = true;
};

struct InsertionPlan {
  double rate_mm_s = 10;
  double length_mm = 100;
  double rotation_rate_rad_s = 0.6;
  bool one_way = false;  // it turns on and on; else to and fro
  double sigma_mm = 0.15;
  int cameras = 1;  // 1: one camera that sees all three axes; 2: (y, z) and (x, z), taken at different times
  double lost_share = 0;
  bool headings_of_shaft = false;  // of two cameras: of the way the tip moves, not of the needle's own axis
  double heading_sd_rad = 0;  // 0: no headings; else one with each measurement, of two cameras the angle in its picture
};

// What the filter believes of agar (Table I).
inline EstimatorConfig agar_config() {
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  return config;
}

inline constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;

inline model::TipMeasurement measure(const Eigen::Vector3d& tip_mm, std::int64_t utime, std::int64_t seq, int camera,
                                     const Eigen::Vector3d& sees, double sigma_mm, std::mt19937_64& rng) {
  std::normal_distribution<double> noise(0, sigma_mm);
  model::TipMeasurement m;
  m.utime = utime;
  m.seq = seq;
  m.camera = camera;
  m.information_per_mm2 = (sees / (sigma_mm * sigma_mm)).asDiagonal();
  for (int i = 0; i < 3; ++i) m.position_mm[i] = sees[i] > 0 ? tip_mm[i] + noise(rng) : 0;
  return m;
}

// By a sensor that is equally sure to all sides.
inline model::TipHeading measure_heading(const Eigen::Vector3d& ahead, std::int64_t utime, std::int64_t seq, int camera,
                                         double sd_rad, std::mt19937_64& rng) {
  std::normal_distribution<double> noise(0, sd_rad);
  const Eigen::Vector3d aside = ahead.unitOrthogonal();
  model::TipHeading m;
  m.utime = utime;
  m.seq = seq;
  m.camera = camera;
  m.heading = (ahead + noise(rng) * aside + noise(rng) * ahead.cross(aside)).normalized();
  m.information_per_rad2 = (Eigen::Matrix3d::Identity() - m.heading * m.heading.transpose()) / (sd_rad * sd_rad);
  return m;
}

// By one camera that looks along an axis of {A}: the heading's angle in its picture, and nothing out of it.
inline model::TipHeading picture_heading(const Eigen::Vector3d& ahead, std::int64_t utime, std::int64_t seq, int camera,
                                         const Eigen::Vector3d& looks_along, double sd_rad, std::mt19937_64& rng) {
  std::normal_distribution<double> noise(0, sd_rad);
  const Eigen::Vector3d in_picture = (ahead - looks_along.dot(ahead) * looks_along).normalized();
  model::TipHeading m;
  m.utime = utime;
  m.seq = seq;
  m.camera = camera;
  m.heading = Eigen::AngleAxisd(noise(rng), looks_along) * in_picture;
  const Eigen::Vector3d across = looks_along.cross(m.heading);
  m.information_per_rad2 = across * across.transpose() / (sd_rad * sd_rad);
  return m;
}

// `start` is the true pose at the entry. The path between samples is the model's own with the truth's parameters.
inline Insertion insert(const model::NeedleParameters& truth, const model::Pose& start, const InsertionPlan& plan,
                        std::mt19937_64& rng) {
  Insertion out;
  std::uniform_real_distribution<double> unit(0, 1);
  model::Pose pose = start;
  double rotation = 0;
  const auto slip = model::slip_parameters(truth);
  const double duration_s = plan.length_mm / plan.rate_mm_s;
  const auto shown = [&]() -> Eigen::Vector3d {
    model::MotionDirection motion;
    if (plan.headings_of_shaft && model::motion_direction(pose.R, slip, motion)) return pose.R * motion.along;
    return pose.R.col(2);
  };
  // Steps of 1 ms hit every sample time of 100 Hz; measurements come every 33 ms, off the actuators' grid.
  std::int64_t seq = 0;
  for (int ms = 0; ms <= static_cast<int>(duration_s * 1000); ++ms) {
    const double t = ms * 1e-3;
    const std::int64_t utime = kStart_utime + std::int64_t{1000} * ms;
    // The shaft turns one way and back, at constant rates between actuator samples.
    const double rate = !plan.one_way && (ms / 2000) % 2 ? -plan.rotation_rate_rad_s : plan.rotation_rate_rad_s;
    if (ms % 10 == 0) {
      model::ActuatorState a;
      a.utime = utime;
      a.seq = ms / 10;
      a.axis_status = {2, 2};
      a.insertion_mm = plan.rate_mm_s * t;
      a.insertion_rate_mm_s = plan.rate_mm_s;
      a.rotation_rad = rotation;
      a.rotation_rate_rad_s = rate;
      out.actuators.push_back(a);
      out.poses.push_back(pose);
      out.final_pose = pose;
    }
    if (ms % 33 == 7 && unit(rng) >= plan.lost_share) {
      if (plan.cameras == 1) {
        if (plan.heading_sd_rad > 0)
          out.headings.push_back(measure_heading(pose.R.col(2), utime, seq, 0, plan.heading_sd_rad, rng));
        out.measurements.push_back(measure(pose.p_mm, utime, seq++, 0, {1, 1, 1}, plan.sigma_mm, rng));
      } else {
        if (plan.heading_sd_rad > 0)
          out.headings.push_back(picture_heading(shown(), utime, seq, 0, {1, 0, 0}, plan.heading_sd_rad, rng));
        out.measurements.push_back(measure(pose.p_mm, utime, seq++, 0, {0, 1, 1}, plan.sigma_mm, rng));
      }
    }
    if (plan.cameras == 2 && ms % 33 == 19 && unit(rng) >= plan.lost_share) {
      if (plan.heading_sd_rad > 0)
        out.headings.push_back(picture_heading(shown(), utime, seq, 1, {0, 1, 0}, plan.heading_sd_rad, rng));
      out.measurements.push_back(measure(pose.p_mm, utime, seq++, 1, {1, 0, 1}, plan.sigma_mm, rng));
    }
    if (!model::step(pose, {plan.rate_mm_s * 1e-3, rate * 1e-3, {truth.curvature_per_mm, 0}}, slip) ||
        model::evaluate_slip(model::tilt_rad(pose), slip.lambda1_per_rad, slip.lambda2).gamma_rad >
            model::kDefaultGammaMax_rad)
      out.in_domain = false;
    rotation += rate * 1e-3;
  }
  return out;
}

// Truth drawn from the prior of the filter: pose at the entry and parameters, redrawn until valid.
inline model::NeedleParameters draw_needle(const Prior& prior, std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0, 1);
  for (;;) {
    model::NeedleParameters needle = prior.needle;
    needle.curvature_per_mm += prior.curvature_sd_per_mm * normal(rng);
    needle.lambda1_per_rad += prior.lambda1_sd_per_rad * normal(rng);
    needle.lambda2 += prior.lambda2_sd * normal(rng);
    if (prior.wheelbase_sd_mm > 0) needle.wheelbase_mm += prior.wheelbase_sd_mm * normal(rng);
    if (!model::find_domain_violation(needle)) return needle;
  }
}

inline model::Pose draw_start(const Prior& prior, std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0, 1);
  model::Vector6d error;
  error << prior.position_sd_mm * normal(rng), prior.position_sd_mm * normal(rng), prior.position_sd_mm * normal(rng),
      prior.tilt_sd_rad * normal(rng), prior.tilt_sd_rad * normal(rng), prior.roll_sd_rad * normal(rng);
  return model::exp_se3(error);
}

// Of a needle and a start drawn from the prior; drawn again where the needle leaves the model's domain.
struct DrawnInsertion {
  model::NeedleParameters needle;
  Insertion data;
  int redrawn = 0;
};
inline DrawnInsertion draw_insertion(const Prior& prior, const InsertionPlan& plan, std::mt19937_64& rng) {
  for (DrawnInsertion drawn;; ++drawn.redrawn) {
    drawn.needle = draw_needle(prior, rng);
    drawn.data = insert(drawn.needle, draw_start(prior, rng), plan, rng);
    if (drawn.data.in_domain) return drawn;
  }
}

}  // namespace bevel::estimator::testing
