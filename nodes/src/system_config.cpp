// SPDX-License-Identifier: MIT
#include <bevel/nodes/system_config.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include <bevel/drivers/camera/calibrated_view.hpp>
#include <bevel/drivers/camera/calibration/calibration_file.hpp>
#include <bevel/error.hpp>
#include <bevel/io/config.hpp>
#include <bevel/io/estimator_config.hpp>

namespace bevel::nodes {
namespace {

using io::above;
using io::in_range;
using io::optional;
using io::required;
using io::Section;

// One link of the chain from a fault to rest; docs/hazards.md has the sum.
constexpr io::Range kShareOfStop = in_range(0.01, 0.12).because("the needle must rest within 200 ms of a fault");

constexpr std::size_t kMostObstacles = 16;

// A sphere has `centre_mm`, a capsule `from_mm` and `to_mm`.
controller::Obstacle read_obstacle(Section s) {
  controller::Obstacle obstacle;
  const auto read_point = [&s](const char* key, Eigen::Vector3d& point) {
    std::array<double, 3> mm{};
    s.read(key, mm, required, in_range(-500, 500));
    point = Eigen::Vector3d(mm[0], mm[1], mm[2]);
  };
  if (s.has("centre_mm")) {
    for (const char* key : {"from_mm", "to_mm"})
      if (s.has(key)) s.fail(key, "stands beside centre_mm, which makes it a sphere; one or the other");
    read_point("centre_mm", obstacle.from_mm);
    obstacle.to_mm = obstacle.from_mm;
  } else if (s.has("from_mm") || s.has("to_mm")) {
    read_point("from_mm", obstacle.from_mm);
    read_point("to_mm", obstacle.to_mm);
  } else {
    s.fail("", "says not where it is; allowed: centre_mm of a sphere, or from_mm and to_mm of a capsule");
  }
  s.read("radius_mm", obstacle.radius_mm, required, in_range(0.01, 200));
  s.read("clearance_mm", obstacle.clearance_mm, required,
         in_range(0.1, 50).because("the estimate of the tip is not exact"));
  return obstacle;
}

void read_controller(Section s, controller::ControllerConfig& c) {
  s.read("period_s", c.period_s, optional,
         in_range(0.002, 0.03).because("set-points must be renewed before the driver takes them for old"));
  s.read(
      "operator_timeout_s", c.operator_timeout_s, optional,
      in_range(0.1, 5).because("the needle is steered on, unrecorded, for so long after the operator program hangs"));
  s.read("law", c.law, optional,
         io::Choices<controller::Law>{
             {"arcs", controller::Law::arcs}, {"flip", controller::Law::flip}, {"spin", controller::Law::spin}});
  Section l = s.section("limits", optional);
  l.read("insertion_rate_mm_s", c.limits.insertion_rate_mm_s, optional, in_range(0.01, 100));
  l.read("retraction_rate_mm_s", c.limits.retraction_rate_mm_s, optional, in_range(0.01, 100));
  l.read("insertion_rate_min_share", c.limits.insertion_rate_min_share, optional, in_range(0.01, 1));
  l.read("rotation_rate_rad_s", c.limits.rotation_rate_rad_s, optional, in_range(0.01, 100));
  l.read("rotation_acceleration_rad_s2", c.limits.rotation_acceleration_rad_s2, optional, in_range(1, 10000));
  l.read("insertion_acceleration_mm_s2", c.limits.insertion_acceleration_mm_s2, optional, in_range(1, 10000));
  l.read("total_rotation_rad", c.limits.total_rotation_rad, optional, in_range(6.2831853, 1e6));
  Section g = s.section("gains", optional);
  g.read("convergence_rad_s", c.gains.convergence_rad_s, optional, in_range(0.01, 100));
  g.read("boundary_layer_rad", c.gains.boundary_layer_rad, optional, in_range(0.01, 3));
  g.read("tube_share", c.gains.tube_share, optional, in_range(0, 10));
  g.read("tolerance_mm", c.gains.tolerance_mm, optional, in_range(0, 10));
  g.read("parameter_uncertainty", c.gains.parameter_uncertainty, optional, in_range(0, 2));
  Section t = s.section("target", optional);
  t.read("gate_breathing", c.follow.gate_breathing, optional);
  t.read("reading_sd_mm", c.follow.motion.reading_sd_mm, optional, in_range(0.001, 10));
  t.read("velocity_sd_mm_s", c.follow.motion.velocity_sd_mm_s, optional, in_range(0, 20));
  t.read("breathing_sd_mm", c.follow.motion.breathing_sd_mm, optional, in_range(0, 30));
  t.read("renewed_after_s", c.follow.motion.renewed_after_s, optional, in_range(1, 1e6));
  Section f = s.section("safety", optional);
  controller::SafetyLimits& safety = c.safety;
  f.read("state_age_s", safety.state_age_s, optional, kShareOfStop);
  f.read("actuator_age_s", safety.actuator_age_s, optional, kShareOfStop);
  f.read("position_sd_mm", safety.position_sd_mm, optional, in_range(0.05, 10));
  f.read("depth_min_mm", safety.depth_min_mm, optional, in_range(-20, 0));
  f.read("depth_max_mm", safety.depth_max_mm, optional, in_range(1, 400));
  f.read("lateral_max_mm", safety.lateral_max_mm, optional, in_range(1, 200));
  // A rate is wrong by less than the axis can do, or the limit never acts.
  f.read("tracking_error_mm_s", safety.tracking_error_mm_s, optional,
         in_range(0.1, 0.5 * c.limits.insertion_rate_mm_s));
  f.read("tracking_error_rad_s", safety.tracking_error_rad_s, optional,
         in_range(0.1, 0.5 * c.limits.rotation_rate_rad_s));
  f.read("tracking_error_s", safety.tracking_error_s, optional, kShareOfStop);
  f.read("axis_delay_s", safety.axis_delay_s, optional, kShareOfStop);
  f.read("resting_motion_mm", safety.resting_motion_mm, optional, in_range(0.02, 2));
  f.read("resting_motion_rad", safety.resting_motion_rad, optional, in_range(0.02, 1));
  f.read("enabling_s", safety.enabling_s, optional, in_range(0.1, 30));
  f.read("target_miss_max_mm", safety.target_miss_max_mm, optional, in_range(0.05, 20));
  f.read("arrival_tolerance_mm", safety.arrival_tolerance_mm, optional, in_range(0.05, 20));
  f.read("target_lost", safety.target_lost, optional,
         io::Choices<controller::TargetLost>{{"warn", controller::TargetLost::warn},
                                             {"stop", controller::TargetLost::stop}});
  for (const Section& one : s.sections("obstacle", optional)) {
    c.obstacles.push_back(read_obstacle(one));
    if (c.law != controller::Law::arcs) s.fail("obstacle", "needs law = \"arcs\": no other goes round obstacles");
  }
  if (c.obstacles.size() > kMostObstacles)
    s.fail("obstacle", "occurs " + std::to_string(c.obstacles.size()) + " times, allowed: up to " +
                           std::to_string(kMostObstacles) + ", for which a period has time");
}

void read_axis(Section s, stepper::AxisConfig& axis) {
  int node_id = axis.node_id;
  s.read("node_id", node_id, optional, in_range(1, 127));
  axis.node_id = static_cast<std::uint8_t>(node_id);
  const auto read_identity = [&s](const char* key, std::uint32_t& number) {
    std::int64_t value = number;
    s.read(key, value, optional, in_range(0, 4294967295));
    number = static_cast<std::uint32_t>(value);
  };
  read_identity("vendor_id", axis.vendor_id);
  read_identity("product_code", axis.product_code);
  read_identity("revision", axis.revision);
  read_identity("serial", axis.serial);
  s.read("counts_per_unit", axis.counts_per_unit, optional, in_range(-1e7, 1e7));
  s.read("rate_limit_unit_s", axis.rate_limit_unit_s, optional, above(0));
  s.read("acceleration_unit_s2", axis.acceleration_unit_s2, optional, above(0));
  s.read("quick_stop_unit_s2", axis.quick_stop_unit_s2, optional, above(0));
  s.read("following_error_unit", axis.following_error_unit, optional, io::at_least(0));
  s.read("counts_per_revolution", axis.counts_per_revolution, optional, in_range(0, 1e9));
  s.read("velocity_unit", axis.velocity_unit, optional,
         io::Choices<stepper::VelocityUnit>{{"as-stated", stepper::VelocityUnit::as_stated},
                                            {"counts/s", stepper::VelocityUnit::counts_per_s},
                                            {"rpm", stepper::VelocityUnit::rpm},
                                            {"0.1 rpm", stepper::VelocityUnit::tenth_rpm},
                                            {"0.01 rpm", stepper::VelocityUnit::hundredth_rpm},
                                            {"0.001 rpm", stepper::VelocityUnit::thousandth_rpm}});
  s.read("position_min_unit", axis.position_min_unit, optional, io::any_finite());
  s.read("position_max_unit", axis.position_max_unit, optional, io::any_finite());
  const auto read_drive_limit = [&s](const char* key, std::optional<double>& limit) {
    double value = std::numeric_limits<double>::quiet_NaN();
    s.read(key, value, optional, io::any_finite());
    if (!std::isnan(value)) limit = value;
  };
  read_drive_limit("drive_position_min_unit", axis.drive_position_min_unit);
  read_drive_limit("drive_position_max_unit", axis.drive_position_max_unit);
}

void read_stepper(Section s, stepper::StepperConfig& c) {
  read_axis(s.section("insertion", optional), c.axes[stepper::kInsertion]);
  read_axis(s.section("rotation", optional), c.axes[stepper::kRotation]);
  s.read("mode", c.mode, optional,
         io::Choices<stepper::VelocityMode>{{"pv", stepper::VelocityMode::profile},
                                            {"csv", stepper::VelocityMode::cyclic}});
  const auto read_ms = [&s](const char* key, std::int64_t& ns, double longest_ms = 1000) {
    double ms = static_cast<double>(ns) * 1e-6;
    s.read(key, ms, optional, in_range(1, longest_ms));
    ns = std::llround(ms * 1e6);
  };
  read_ms("period_ms", c.period_ns);
  read_ms("boot_timeout_ms", c.boot_timeout_ns, 60000);
  read_ms("setpoint_zero_age_ms", c.setpoint_zero_age_ns);
  read_ms("setpoint_stop_age_ms", c.setpoint_stop_age_ns);
  read_ms("drive_heartbeat_ms", c.drive_heartbeat_ns);
  read_ms("drive_heartbeat_timeout_ms", c.drive_heartbeat_timeout_ns);
  read_ms("following_error_ms", c.following_error_ns);
  read_ms("master_heartbeat_ms", c.master_heartbeat_ns);
  read_ms("master_heartbeat_timeout_ms", c.master_heartbeat_timeout_ns);
  for (const std::string& problem : stepper::problems_of(c)) s.fail("", problem);
  for (const std::string& problem : stepper::safety_problems_of(c)) s.fail("", problem);
}

void read_source(Section s, camera::SourceConfig& source) {
  s.read("kind", source.kind, optional,
         io::Choices<camera::SourceKind>{{"folder", camera::SourceKind::folder},
                                         {"video", camera::SourceKind::video},
                                         {"device", camera::SourceKind::device},
                                         {"stream", camera::SourceKind::stream}});
  s.read("path", source.path, optional);
  s.read("camera", source.camera, optional, in_range(0, 15));
  double period_s = static_cast<double>(source.period_us) * 1e-6;
  s.read("period_s", period_s, optional, in_range(1e-3, 3600));
  source.period_us = std::llround(period_s * 1e6);
  s.read("width_px", source.width_px, optional, in_range(16, 8192));
  s.read("height_px", source.height_px, optional, in_range(16, 8192));
  s.read("rate_hz", source.rate_hz, optional, in_range(0.1, 1000));
  s.read("fourcc", source.fourcc, optional);
}

const io::Choices<camera::SignedAxis> kAxisChoices{
    {"+x", {camera::WorldAxis::x, 1}},  {"-x", {camera::WorldAxis::x, -1}}, {"+y", {camera::WorldAxis::y, 1}},
    {"-y", {camera::WorldAxis::y, -1}}, {"+z", {camera::WorldAxis::z, 1}},  {"-z", {camera::WorldAxis::z, -1}}};

void read_planar_view(Section& s, io::Presence presence, camera::PlanarViewConfig& view) {
  s.read("px_per_mm", view.px_per_mm, presence, in_range(0.1, 1000));
  std::array<double, 2> origin{0, 0};
  s.read("origin_px", origin, presence);
  view.origin_px = {origin[0], origin[1]};
  s.read("columns_carry", view.u_axis, presence, kAxisChoices);
  s.read("rows_carry", view.v_axis, presence, kAxisChoices);
}

// The camera's lens, pose and wall from the file that its key `calibration` names, in place of the keys of a planar
// view.
void read_calibration(Section& s, const std::string& path, CameraViewConfig& c) {
  for (const char* key : {"px_per_mm", "origin_px", "columns_carry", "rows_carry"})
    if (s.has(key)) s.fail(key, "stands beside calibration, which says where every pixel looks; one or the other");
  camera::PlanarViewConfig unused;
  read_planar_view(s, optional, unused);
  bool provisional = false;
  s.read("provisional_frame", provisional, optional);
  try {
    const camera::Calibration calibration = camera::load_calibration(path);
    c.calibrated = camera::camera_of(calibration, c.camera, path).model;
    if (calibration.frame == camera::FrameKind::none && !provisional)
      return s.fail("calibration",
                    path +
                        ": frame is none: its cameras know each other and not the needle's frame; allowed: "
                        "fiducial, insertion (bevel-calibrate), or provisional_frame = true, to record the "
                        "insertion that gives it, with no controller running");
    const camera::CalibratedView check(*c.calibrated);
  } catch (const std::exception& error) {
    return s.fail("calibration", error.what());
  }
  const cv::Size size = c.calibrated->lens.picture_px;
  const auto must_be = [&s, &path](const char* key, int given, int calibrated) {
    if (s.has(key) && given != calibrated)
      s.fail(key,
             "is " + std::to_string(given) + ", allowed: " + std::to_string(calibrated) + ", of which " + path + " is");
  };
  must_be("width_px", c.width_px, size.width);
  must_be("height_px", c.height_px, size.height);
  c.width_px = size.width;
  c.height_px = size.height;
}

CameraViewConfig read_camera(Section s, const std::filesystem::path& folder) {
  CameraViewConfig c;
  s.read("camera", c.camera, required, in_range(0, 15));
  s.read("width_px", c.width_px, optional, in_range(16, 8192));
  s.read("height_px", c.height_px, optional, in_range(16, 8192));
  std::string calibration;
  s.read("calibration", calibration, optional);
  if (!calibration.empty())
    read_calibration(s, (folder / calibration).string(), c);
  else
    read_planar_view(s, required, c.view);
  camera::TrackerConfig& t = c.tracker;
  s.read("entry_side", t.entry_side, optional,
         io::Choices<camera::EntrySide>{{"top", camera::EntrySide::top},
                                        {"bottom", camera::EntrySide::bottom},
                                        {"left", camera::EntrySide::left},
                                        {"right", camera::EntrySide::right}});
  std::array<double, 2> entry{t.entry_px.x, t.entry_px.y};
  s.read("entry_px", entry, optional);
  t.entry_px = {entry[0], entry[1]};
  s.read("entry_half_width_px", t.entry_half_width_px, optional);
  s.read("needle_diameter_mm", t.needle_diameter_mm, optional, in_range(0.05, 10));
  s.read("bevel_length_mm", t.bevel_length_mm, optional, in_range(0, 50));
  s.read("bevel_length_sd", t.bevel_length_sd, optional, in_range(0.01, 2));
  s.read("tip_point", t.tip_point, optional,
         io::Choices<camera::TipPoint>{{"axis", camera::TipPoint::axis}, {"seen", camera::TipPoint::seen}});
  s.read("max_along_sd_mm", t.max_along_sd_mm, optional, in_range(1e-3, 50));
  s.read("min_contrast_gray", t.min_contrast_gray, optional, in_range(1, 255));
  s.read("min_length_mm", t.min_length_mm, optional, in_range(0.5, 1000));
  s.read("floor_across_mm", t.floor_across_mm, optional, in_range(1e-4, 100));
  s.read("floor_along_mm", t.floor_along_mm, optional, in_range(1e-4, 100));
  s.read("latency_s", c.latency_s, optional, in_range(-0.2, 1));
  s.read("headings", c.headings, optional);
  s.read("floor_heading_rad", t.floor_heading_rad, optional, in_range(1e-5, 1));
  s.read("max_heading_sd_rad", t.max_heading_sd_rad, optional, in_range(1e-3, 1));
  return c;
}

// What a model file holds, as the section has it, or from the model file that its key `model` names. The needle is left
// as it is where there is none.
io::ModelFile read_model(Section& s, const std::filesystem::path& folder, io::Presence needle_presence,
                         const model::NeedleParameters& needle) {
  io::ModelFile model{needle};
  std::string path;
  s.read("model", path, optional);
  if (Section own = s.section("needle", path.empty() ? needle_presence : optional); own.present())
    model.needle = io::read_needle(own);
  model.effects = io::read_effects(s);
  model.discrepancies = io::read_discrepancies(s, model.effects.size());
  model.variation = io::read_variation(s);
  if (path.empty()) return model;
  for (const char* key : {"needle", "effect", "discrepancy", "variation"})
    if (s.has(key)) {
      s.fail("model", std::string("stands for needle, effect, discrepancy and variation, and there is ") + key +
                          " too; one or the other");
      return model;
    }
  try {
    return io::load_model_file((folder / path).string());
  } catch (const io::ConfigError& e) {
    s.fail("model", e.what());
  }
  return model;
}

// The mechanical plant in place of [rig.needle].
model::BeamPlantConfig read_beam(Section s) {
  model::BeamPlantConfig beam;
  s.read("foundation_modulus_kPa", beam.foundation_modulus_kPa, optional, in_range(0.1, 1000));
  s.read("bevel_force_N", beam.bevel_force_N, optional, in_range(0, 10));
  s.read("bending_stiffness_N_mm2", beam.bending_stiffness_N_mm2, optional, in_range(1, 1e7));
  s.read("guide_gap_mm", beam.guide_gap_mm, optional, in_range(0, 100));
  s.read("relaxing_fraction", beam.relaxing_fraction, optional, in_range(0, 0.99));
  s.read("relaxation_time_s", beam.relaxation_time_s, optional, in_range(0.01, 1000));
  s.read("windup_at_100mm_rad", beam.windup_at_100mm_rad, optional, in_range(0, 10));
  return beam;
}

void read_rig(Section s, const std::filesystem::path& folder, RigConfig& c) {
  io::ModelFile model = read_model(s, folder, optional, c.truth);
  c.truth = model.needle;
  c.effects = std::move(model.effects);
  c.discrepancies = std::move(model.discrepancies);
  c.variation = model.variation.value_or(model::Variation{});
  if (Section beam = s.section("beam", optional); beam.present()) c.beam = read_beam(beam);
  s.read("roll_error_rad", c.roll_error_rad, optional, in_range(-3.2, 3.2));
  s.read("frames_socket", c.frames_socket, optional);
  s.read("frame_rate_hz", c.frame_rate_hz, optional, in_range(1, 120));
  s.read("noise_gray", c.noise_gray, optional, in_range(0, 50));
  s.read("blur_px", c.blur_px, optional, in_range(0, 10));
  s.read("seed", c.seed, optional, in_range(0, 1e15));
  Section h = s.section("heading", optional);
  h.read("sd_rad", c.heading.sd_rad, h.present() ? required : optional, in_range(1e-4, 1));
  h.read("rate_hz", c.heading.rate_hz, optional, in_range(0.1, 500));
  h.read("camera", c.heading.camera, optional, in_range(0, 15));
  Section l = s.section("limit_switches", optional);
  const auto below = in_range(-1e4, -0.01).because("the axis stands at 0 between them when the rig starts");
  const auto beyond = in_range(0.01, 1e4).because(below.reason);
  l.read("insertion_min_mm", c.limit_switches[stepper::kInsertion].min_unit, optional, below);
  l.read("insertion_max_mm", c.limit_switches[stepper::kInsertion].max_unit, optional, beyond);
  l.read("rotation_min_rad", c.limit_switches[stepper::kRotation].min_unit, optional, below);
  l.read("rotation_max_rad", c.limit_switches[stepper::kRotation].max_unit, optional, beyond);
}

// What the filter has states of: of cameras 0 and 1.
void check_states_of_cameras(Section s, const SystemConfig& c) {
  Section noise = s.section("reading_noise", optional), nuisance = s.section("nuisance", optional);
  const estimator::NuisancePrior& told = c.estimator.nuisance;
  const std::string has_more = "is above 0, and there is a camera ",
                    of_two = "; allowed: with cameras 0 and 1 only, whose ";
  for (const CameraViewConfig& camera : c.cameras) {
    if (camera.camera <= 1) continue;
    const std::string why = has_more + std::to_string(camera.camera) + of_two;
    if (c.estimator.reading.correlated_share > 0) noise.fail("correlated_share", why + "errors have states");
    if (told.latency_sd_s > 0) nuisance.fail("latency_sd_s", why + "latencies have states");
  }
}

// Assumes a shaft that bends, unless the file has the key, or something that the filter does not combine with it:
// effects, the wheelbase or headings.
void assume_shaft(Section prior, bool has_effects, SystemConfig& c) {
  const bool takes_headings =
      c.rig.heading.sd_rad > 0 || std::ranges::any_of(c.cameras, [](const auto& camera) { return camera.headings; });
  estimator::Prior& own = c.estimator.prior;
  if (prior.has("bending_mm") || has_effects || takes_headings || own.wheelbase_sd_mm > 0) return;
  const estimator::Prior given = own;
  estimator::assume_unknown_shaft(own);
  if (prior.has("bending_sd_mm")) own.bending_sd_mm = given.bending_sd_mm;
  if (prior.has("guide_mm")) own.guide_mm = given.guide_mm;
}

}  // namespace

SystemConfig load_system_config(const std::string& path) {
  io::ConfigFile file = io::ConfigFile::load(path);
  SystemConfig c;
  c.text = file.text();
  Section system = file.section("system", optional);
  system.read("lcm_url", c.lcm_url, optional);
  system.read("can", c.can, optional);
  system.read("realtime", c.realtime, optional);
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  Section root = file.root();
  io::ModelFile believed = read_model(root, folder, required, c.needle);
  c.needle = c.estimator.prior.needle = believed.needle;
  c.estimator.prior.variation = believed.variation.value_or(model::Variation{});
  c.estimator.through_channel = true;  // a needle in tissue; recordings of a model are replayed without a system file
  io::read_estimator_config(file.section("estimator", optional), c.estimator);
  read_controller(file.section("controller", optional), c.controller);
  read_stepper(file.section("stepper", optional), c.stepper);
  c.estimator.axes = {c.estimator.limits.actuator_age_s, c.stepper.axes[stepper::kInsertion].rate_limit_unit_s,
                      c.stepper.axes[stepper::kRotation].rate_limit_unit_s};
  read_source(file.section("source", optional), c.source);
  for (const Section& s : file.sections("camera", optional)) c.cameras.push_back(read_camera(s, folder));
  if (c.source.kind == camera::SourceKind::device)
    for (const CameraViewConfig& camera : c.cameras)
      if (camera.calibrated && camera.camera == c.source.camera &&
          camera.calibrated->lens.picture_px != cv::Size(c.source.width_px, c.source.height_px))
        file.section("source", optional)
            .fail("width_px", "and height_px are " + std::to_string(c.source.width_px) + " x " +
                                  std::to_string(c.source.height_px) + ", allowed: " + std::to_string(camera.width_px) +
                                  " x " + std::to_string(camera.height_px) + ", of which the calibration of camera " +
                                  std::to_string(camera.camera) + " is");
  check_states_of_cameras(file.section("estimator", optional), c);
  // Whoever of them gives headings gives the shaft's.
  for (const CameraViewConfig& camera : c.cameras) c.estimator.shaft_cameras.push_back(camera.camera);
  c.rig.truth = c.needle;
  read_rig(file.section("rig", optional), folder, c.rig);
  if (c.rig.heading.sd_rad > 0 && std::ranges::count(c.cameras, c.rig.heading.camera, &CameraViewConfig::camera) > 0)
    file.section("rig", optional)
        .section("heading", optional)
        .fail("camera", "is " + std::to_string(c.rig.heading.camera) +
                            ", which a [[camera]] has; allowed: a number of its own, 0 to 15");
  assume_shaft(file.section("estimator", optional).section("prior", optional), !believed.effects.empty(), c);
  c.controller.shaft = {c.estimator.prior.bending_mm, c.estimator.prior.guide_mm};
  file.finish();
  c.live_effects = io::live_effects(believed.effects, believed.discrepancies);
  c.effects = std::move(believed.effects);
  c.discrepancies = std::move(believed.discrepancies);
  c.estimator.effects = c.live_effects.active;
  c.controller.through_channel = c.estimator.through_channel && c.estimator.effects.empty();
  if (c.estimator.prior.bending_mm > 0 && !c.estimator.effects.empty())
    throw io::ConfigError({path + ": [estimator.prior] bending_mm: a stiff shaft is estimated without [[effect]]s; " +
                           std::string(c.estimator.effects.front().effect->name()) + " is one"});
  if (c.estimator.nuisance.any() && !c.estimator.effects.empty())
    throw io::ConfigError({path + ": [estimator.nuisance]: wind-up and latencies are estimated without " +
                           "[[effect]]s; " + std::string(c.estimator.effects.front().effect->name()) + " is one"});
  return c;
}

}  // namespace bevel::nodes
