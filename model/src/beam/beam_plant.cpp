// SPDX-License-Identifier: MIT
#include <bevel/model/beam/beam_plant.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

#include <bevel/error.hpp>

namespace bevel::model {
namespace {

constexpr double kN_mm2PerKPa = 1e-3;
constexpr double kMaxTurnWhileFed_rad = 0.2;    // a step's cut is straight; a faster helix would be cut as a polygon
constexpr double kMaxStepOfRelaxation = 0.25;   // in relaxation times
constexpr double kMaxStepsOfRelaxation = 80.0;  // 20 relaxation times: the rest, however long, changes nothing

void require(bool allowed, const char* field, double value, const char* allowed_text) {
  if (allowed) return;
  std::ostringstream message;
  message << "beam plant: " << field << " = " << value << ", allowed: " << allowed_text;
  throw ArgumentError(message.str());
}

void require_positive(const char* field, double value) {
  require(std::isfinite(value) && value > 0.0, field, value, "finite and > 0");
}

void require_not_negative(const char* field, double value) {
  require(std::isfinite(value) && value >= 0.0, field, value, "finite and >= 0");
}

const BeamPlantConfig& validated(const BeamPlantConfig& config) {
  config.validate();
  return config;
}

}  // namespace

void BeamPlantConfig::validate() const {
  require_positive("bending_stiffness_N_mm2", bending_stiffness_N_mm2);
  require_positive("foundation_modulus_kPa", foundation_modulus_kPa);
  require(relaxing_fraction >= 0.0 && relaxing_fraction < 1.0, "relaxing_fraction", relaxing_fraction, "0 to below 1");
  require_positive("relaxation_time_s", relaxation_time_s);
  require_not_negative("bevel_force_N", bevel_force_N);
  require_positive("bevel_length_mm", bevel_length_mm);
  require_not_negative("guide_gap_mm", guide_gap_mm);
  require_not_negative("windup_at_100mm_rad", windup_at_100mm_rad);
  require(layer_from_mm >= 0.0, "layer_from_mm", layer_from_mm, ">= 0, infinity for none");
  require_positive("layer_modulus_kPa", layer_modulus_kPa);
  require_not_negative("layer_force_N", layer_force_N);
  require_positive("max_depth_mm", max_depth_mm);
  require_positive("element_length_mm", element_length_mm);
  require_positive("cell_length_mm", cell_length_mm);
  require_positive("max_step_mm", max_step_mm);
}

BeamPlant::BeamPlant(const BeamPlantConfig& config)
    : config_(validated(config)),
      beam_(config.bending_stiffness_N_mm2, config.element_length_mm, config.guide_gap_mm, config.max_depth_mm),
      cut_({config.foundation_modulus_kPa * kN_mm2PerKPa, config.relaxing_fraction, config.relaxation_time_s,
            config.layer_from_mm, config.layer_modulus_kPa / config.foundation_modulus_kPa},
           config.cell_length_mm, config.max_depth_mm),
      windup_(config.windup_at_100mm_rad) {}

void BeamPlant::advance(double insertion_increment_mm, double rotation_increment_rad, double dt_s) {
  require(std::isfinite(insertion_increment_mm), "insertion_increment_mm", insertion_increment_mm, "finite");
  require(std::isfinite(rotation_increment_rad), "rotation_increment_rad", rotation_increment_rad, "finite");
  require_not_negative("dt_s", dt_s);
  if (fed_mm_ + insertion_increment_mm > config_.max_depth_mm) {
    std::ostringstream message;
    message << "beam plant: feed to " << fed_mm_ + insertion_increment_mm
            << " mm, allowed: up to max_depth_mm = " << config_.max_depth_mm;
    throw DomainError(message.str());
  }
  double steps = std::max(1.0, std::abs(insertion_increment_mm) / config_.max_step_mm);
  if (insertion_increment_mm != 0.0) {
    steps = std::max(steps, std::abs(rotation_increment_rad) / kMaxTurnWhileFed_rad);
  }
  if (config_.relaxing_fraction > 0.0) {
    const double relaxations = dt_s / (config_.relaxation_time_s * kMaxStepOfRelaxation);
    steps = std::max(steps, std::min(relaxations, kMaxStepsOfRelaxation));
  }
  const double share = 1.0 / std::ceil(steps - 1e-9);
  const int count = static_cast<int>(std::ceil(steps - 1e-9));
  for (int i = 0; i < count; ++i) {
    step(insertion_increment_mm * share, rotation_increment_rad * share, dt_s * share);
  }
}

void BeamPlant::step(double insertion_mm, double rotation_rad, double dt_s) {
  const double from_mm = fed_mm_;
  const Lateral from_aside_mm = tip_aside_mm_;
  fed_mm_ += insertion_mm;
  base_roll_rad_ += rotation_rad;
  windup_.follow(base_roll_rad_, fed_mm_);

  bent_ = fed_mm_ > beam_.clamp_mm();
  if (!bent_) {  // inside the guide
    tip_aside_mm_ = tip_angle_rad_ = Lateral{};
    tip_mm_ = {0.0, 0.0, fed_mm_};
    return;
  }
  // The piece of tissue reached in this step has no spring yet: its stretch is only of the order of the step.
  const double settled_mm = cut_.settled_mm(fed_mm_);
  beam_.set_tip(fed_mm_, std::min(settled_mm_, settled_mm));
  settled_mm_ = settled_mm;
  cut_.add_springs(beam_, dt_s);
  beam_.add_force(fed_mm_, std::polar(bevel_force_N(), tip_roll_rad()) * Lateral(0.0, -1.0));
  beam_.solve();
  cut_.relax(beam_, dt_s);
  tip_aside_mm_ = beam_.displacement_mm(fed_mm_);
  tip_angle_rad_ = beam_.slope(fed_mm_);
  tip_mm_ = config_.feed_is_arc_length ? beam_.tip_along_shaft_mm()
                                       : Eigen::Vector3d(tip_aside_mm_.real(), tip_aside_mm_.imag(), fed_mm_);
  cut_.cut(from_mm, from_aside_mm, fed_mm_, tip_aside_mm_);
}

double BeamPlant::bevel_force_N() const {
  // Only the part of the bevel's face that meets uncut tissue pushes: all of it at the front, none of it a bevel's
  // length behind, and during entry the part that is already in.
  const double behind_mm = std::max(0.0, cut_.front_mm() - fed_mm_);
  const double pressing = (std::min(fed_mm_, config_.bevel_length_mm) - behind_mm) / config_.bevel_length_mm;
  return (fed_mm_ < config_.layer_from_mm ? config_.bevel_force_N : config_.layer_force_N) *
         std::clamp(pressing, 0.0, 1.0);
}

Eigen::Vector3d BeamPlant::tip_heading() const {
  if (config_.feed_is_arc_length) return turned_from_axis(tip_angle_rad_);
  return Eigen::Vector3d(tip_angle_rad_.real(), tip_angle_rad_.imag(), 1.0).normalized();
}

Eigen::Matrix3d BeamPlant::tip_rotation() const {
  const auto tilt = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), tip_heading());
  return (tilt * Eigen::AngleAxisd(tip_roll_rad(), Eigen::Vector3d::UnitZ())).toRotationMatrix();
}

std::vector<Eigen::Vector3d> BeamPlant::shaft_polyline_mm(std::size_t points) const {
  require(points >= 2, "points", static_cast<double>(points), "at least 2");
  constexpr double kPiece_mm = 1.0;
  std::vector<Eigen::Vector3d> line(points);
  const double start_mm = std::min(beam_.clamp_mm(), fed_mm_);
  const double spacing_mm = (fed_mm_ - start_mm) / static_cast<double>(points - 1);
  const double pieces = std::max(1.0, std::ceil(spacing_mm / kPiece_mm));
  Eigen::Vector3d at_mm(0.0, 0.0, start_mm);
  for (std::size_t i = 0; i < points; ++i) {
    const double along_mm = start_mm + spacing_mm * static_cast<double>(i);
    if (!config_.feed_is_arc_length) {
      const Lateral w = bent_ ? beam_.displacement_mm(along_mm) : Lateral{};
      line[i] = {w.real(), w.imag(), along_mm};
      continue;
    }
    line[i] = at_mm;
    for (double piece = 0.5; piece < pieces && i + 1 < points; ++piece)
      at_mm += spacing_mm / pieces *
               turned_from_axis(bent_ ? beam_.slope(along_mm + spacing_mm * piece / pieces) : Lateral{});
  }
  line.back() = tip_mm_;
  return line;
}

}  // namespace bevel::model
