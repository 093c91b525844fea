// SPDX-License-Identifier: MIT
#pragma once
// A simulated insertion watched by two cameras whose pictures are rendered and tracked: what TIP_MEASUREMENT and
// TIP_HEADING hold then, with all that neighbouring frames' errors have in common.
#include <numbers>

#include <bevel/drivers/camera/tip_tracker.hpp>
#include <bevel/rig/camera/needle_renderer.hpp>
#include <bevel/rig/plant/plant.hpp>
#include "tests/estimator/insertion.hpp"

namespace bevel::estimator::testing {

struct RenderedPlan {
  double rate_mm_s = 10;
  double length_mm = 100;
  double rotation_rate_rad_s = 0.6;  // the shaft turns one way for two seconds, and back
  bool one_way = false;              // it turns on and on
  double half_turn_each_s = 0;       // to one side and back, the bevel resting between; 0: it turns as above
  double rest_s = 0;                 // with the length inserted, neither fed nor turned
  double frame_rate_hz = 30;
  camera::TrackerConfig tracker = [] {
    camera::TrackerConfig c;
    c.floor_across_mm = 0.05;  // as in config/demo.toml, for the same reason
    c.floor_along_mm = 0.08;
    return c;
  }();
};

// Of each heading of Insertion::headings: its angle in the picture less that of the shaft's end, and that of the
// bicycle's heading R e3, which slip turns away from it; and the standard deviation that the tracker claims.
struct HeadingError {
  int camera = 0;
  double of_shaft_rad = 0, of_body_rad = 0, claimed_rad = 0;
};
// Of each measurement of Insertion::measurements: how far it is off along the axes of {A} that its camera sees.
struct TipError {
  int camera = 0;
  int frame = 0;
  Eigen::Vector3d error_mm = Eigen::Vector3d::Zero();
};
struct RenderedInsertion {
  Insertion data;
  std::vector<TipError> tip_errors;
  std::vector<HeadingError> heading_errors;
  int frames = 0;
};

inline double angle_in_picture(const Eigen::Vector3d& v, int camera) {
  return std::atan2(v[camera == 0 ? 1 : 0], v[2]);
}

inline RenderedInsertion watch(const model::NeedleParameters& truth, const model::OwnValues& own,
                               const RenderedPlan& plan, std::uint64_t seed) {
  RenderedInsertion out;
  rig::KinematicPlant plant(truth, {}, 0, own);
  std::vector<camera::PlanarView> views;
  std::vector<rig::NeedleRenderer> renderers;
  std::vector<camera::TipTracker> trackers;
  for (const int which : {0, 1}) {
    camera::PlanarViewConfig view;
    view.px_per_mm = 4.4;
    view.origin_px = {240.0, 40.0};
    view.u_axis = {which == 0 ? camera::WorldAxis::y : camera::WorldAxis::x, 1};
    views.emplace_back(view);
    rig::SceneConfig scene;
    scene.size_px = {480, 640};
    scene.seed = seed * 2 + static_cast<std::uint64_t>(which);
    renderers.emplace_back(scene, views.back());
    trackers.emplace_back(plan.tracker, view.px_per_mm);
  }
  double inserted_mm = 0, rotation_rad = 0;
  std::int64_t seq = 0;
  const int rests_ms = static_cast<int>(1000 * plan.length_mm / plan.rate_mm_s);
  const int last_ms = rests_ms + static_cast<int>(1000 * plan.rest_s);
  int next_frame_ms = 7;
  for (int ms = 0; ms <= last_ms; ++ms) {
    const std::int64_t utime = kStart_utime + std::int64_t{1000} * ms;
    const bool rests = ms > rests_ms;
    const int one_way_ms = plan.half_turn_each_s > 0 ? static_cast<int>(1000 * plan.half_turn_each_s) : 2000;
    const bool turns =
        plan.half_turn_each_s == 0 || (ms % one_way_ms) * 1e-3 * plan.rotation_rate_rad_s < std::numbers::pi;
    const double rate = rests || !turns                          ? 0
                        : !plan.one_way && (ms / one_way_ms) % 2 ? -plan.rotation_rate_rad_s
                                                                 : plan.rotation_rate_rad_s;
    const double feed_mm_s = rests ? 0 : plan.rate_mm_s;
    const model::Pose tip = plant.tip();
    if (ms % 10 == 0) {
      model::ActuatorState a;
      a.utime = utime;
      a.seq = ms / 10;
      a.axis_status = {2, 2};
      a.insertion_mm = inserted_mm;
      a.rotation_rad = rotation_rad;
      out.data.actuators.push_back(a);
      out.data.poses.push_back(tip);
      out.data.final_pose = tip;
    }
    if (ms == next_frame_ms) {
      next_frame_ms += static_cast<int>(std::lround(1000 / plan.frame_rate_hz));
      std::vector<camera::Vector3> path;
      for (const Eigen::Vector3d& p : plant.shaft_mm()) path.push_back({p.x(), p.y(), p.z()});
      const auto vector = [](const Eigen::Vector3d& v) { return camera::Vector3{v.x(), v.y(), v.z()}; };
      for (const int which : {0, 1}) {
        const auto i = static_cast<std::size_t>(which);
        const double roll_rad =
            renderers[i].roll_seen_rad(vector(tip.p_mm), vector(tip.R.col(2)), vector(-tip.R.col(1)));
        const rig::NeedlePicture picture = renderers[i].render(path, roll_rad);
        const camera::TipResult seen = trackers[i].track({utime, seq, which, picture.gray});
        ++out.frames;
        if (seen.status != camera::TipStatus::ok) continue;
        const camera::Vector3 at = views[i].position_mm(seen.tip_px);
        const camera::Matrix3 information = views[i].information_per_mm2(seen.tip_px, seen.covariance_px2);
        model::TipMeasurement m;
        m.utime = utime, m.seq = seq, m.camera = which;
        m.position_mm = Eigen::Map<const Eigen::Vector3d>(at.data());
        m.information_per_mm2 = Eigen::Map<const Eigen::Matrix3d>(information.data());
        out.data.measurements.push_back(m);
        const Eigen::Vector3d sees = m.information_per_mm2.diagonal().cwiseSign();
        out.tip_errors.push_back({which, static_cast<int>(seq), sees.cwiseProduct(m.position_mm - tip.p_mm)});
        if (seen.heading_status != camera::TipStatus::ok) continue;
        const camera::SeenDirection direction =
            views[i].direction(seen.tip_px, seen.direction_px, seen.direction_variance_rad2);
        model::TipHeading h;
        h.utime = utime, h.seq = seq, h.camera = which;
        h.heading = Eigen::Map<const Eigen::Vector3d>(direction.direction.data());
        h.information_per_rad2 = Eigen::Map<const Eigen::Matrix3d>(direction.information_per_rad2.data());
        out.data.headings.push_back(h);
        const double angle = angle_in_picture(h.heading, which);
        const cv::Vec2d& d = picture.direction_px;
        out.heading_errors.push_back({which, angle - std::atan2(d[0], d[1]),
                                      angle - angle_in_picture(tip.R.col(2), which),
                                      std::sqrt(seen.direction_variance_rad2)});
      }
      ++seq;
    }
    plant.advance(feed_mm_s * 1e-3, rate * 1e-3, 1e-3);
    inserted_mm += feed_mm_s * 1e-3;
    rotation_rad += rate * 1e-3;
  }
  const auto& slip = plant.model().needle();
  out.data.in_domain =
      model::evaluate_slip(model::tilt_rad(plant.tip()), slip.lambda1_per_rad, slip.lambda2).gamma_rad <
      model::kDefaultGammaMax_rad;
  return out;
}

}  // namespace bevel::estimator::testing
