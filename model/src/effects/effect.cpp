// SPDX-License-Identifier: MIT
#include <bevel/model/effects/effect.hpp>

#include <array>
#include <cmath>
#include <numbers>

namespace bevel::model {

std::vector<double> starts_every(double step, double first, double last) {
  std::vector<double> starts;
  for (int i = 0; first + i * step <= last; ++i) starts.push_back(first + i * step);
  return starts;
}

double value_if_unsaid(const EffectParameter& parameter) {
  if (parameter.scope == Scope::recording) return 0;
  return std::isnan(parameter.usual) ? parameter.none : parameter.usual;
}

double meant(const EffectParameter& parameter, double value) {
  if (parameter.modulo <= 0) return value;
  const double none = std::isnan(parameter.none) ? 0 : parameter.none;
  return value - parameter.modulo * std::round((value - none) / parameter.modulo);
}

std::string_view name_of(Covariate covariate) {
  switch (covariate) {
    case Covariate::time_s:
      return "time_s";
    case Covariate::depth_mm:
      return "depth_mm";
    case Covariate::speed_mm_s:
      return "speed_mm_s";
    case Covariate::turn_rate_rad_s:
      return "turn_rate_rad_s";
    case Covariate::since_stop_s:
      return "since_stop_s";
    case Covariate::since_reversal_mm:
      return "since_reversal_mm";
    case Covariate::roll_rad:
      return "roll_rad";
    case Covariate::turned_rad:
      return "turned_rad";
    case Covariate::withdrawn_mm:
      return "withdrawn_mm";
    case Covariate::tip_x_mm:
      return "tip_x_mm";
    case Covariate::tip_y_mm:
      return "tip_y_mm";
    case Covariate::tip_xy_mm:
      return "tip_xy_mm";
    case Covariate::tip_yx_mm:
      return "tip_yx_mm";
    case Covariate::since_speed_change_s:
      return "since_speed_change_s";
  }
  return "time_s";
}

bool needs_clock(Covariate covariate) {
  return covariate == Covariate::time_s || covariate == Covariate::speed_mm_s ||
         covariate == Covariate::turn_rate_rad_s || covariate == Covariate::since_stop_s ||
         covariate == Covariate::since_speed_change_s;
}

std::optional<Eigen::Vector2d> tip_direction(Covariate covariate) {
  switch (covariate) {
    case Covariate::tip_x_mm:
      return Eigen::Vector2d::UnitX();
    case Covariate::tip_y_mm:
      return Eigen::Vector2d::UnitY();
    case Covariate::tip_xy_mm:
      return Eigen::Vector2d(std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2);
    case Covariate::tip_yx_mm:
      return Eigen::Vector2d(-std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2);
    default:
      return std::nullopt;
  }
}

std::span<const Covariate> all_covariates() {
  static constexpr std::array<Covariate, kCovariates> kAll = {Covariate::time_s,       Covariate::depth_mm,
                                                              Covariate::speed_mm_s,   Covariate::turn_rate_rad_s,
                                                              Covariate::since_stop_s, Covariate::since_reversal_mm,
                                                              Covariate::roll_rad,     Covariate::turned_rad,
                                                              Covariate::withdrawn_mm, Covariate::tip_x_mm,
                                                              Covariate::tip_y_mm,     Covariate::tip_xy_mm,
                                                              Covariate::tip_yx_mm,    Covariate::since_speed_change_s};
  return kAll;
}

Dual2 LegView::lateral_in_body(const Dual2& world) const {
  // v_B = R^T v moves by v_B x delta under a body rotation delta of R.
  const Eigen::Vector3d v = R.transpose() * Eigen::Vector3d(world[0].value, world[1].value, 0);
  Dual2 body;
  for (int i = 0; i < 2; ++i) {
    auto& out = body[static_cast<std::size_t>(i)];
    out.value = v[i];
    if (R_moves || world[0].moves() || world[1].moves())
      out.slopes() = R(0, i) * world[0].slope() + R(1, i) * world[1].slope();
  }
  if (R_moves) {
    body[0].slopes() += (v.y() * R_body.row(2) - v.z() * R_body.row(1)).array().transpose();
    body[1].slopes() += (v.z() * R_body.row(0) - v.x() * R_body.row(2)).array().transpose();
  }
  return turned(body, rotation_rad * -0.5);
}

Dual2 LegView::lateral_in_world(const Dual2& body) const {
  const Dual3 world = in_world(body);
  return {world[0], world[1]};
}

Dual2 LegView::toward_bevel() const {
  const Dual half = 0.5 * rotation_rad;
  const double away = curvature_per_mm.value < 0 ? -1 : 1;
  return {away * sin(half), -away * cos(half)};
}

Dual3 LegView::in_world(const Dual2& body) const {
  // R u moves by R (delta x u).
  const Eigen::Vector3d u(body[0].value, body[1].value, 0);
  Dual3 world;
  for (int i = 0; i < 3; ++i) world[static_cast<std::size_t>(i)].value = R.row(i).dot(u);
  if (!R_moves && !body[0].moves() && !body[1].moves()) return world;
  const Eigen::Matrix<double, 3, kMaxColumns> du =
      (Eigen::Matrix<double, 3, kMaxColumns>() << -R_body.row(2) * u.y(), R_body.row(2) * u.x(),
       R_body.row(0) * u.y() - R_body.row(1) * u.x())
          .finished();
  for (int i = 0; i < 3; ++i) {
    world[static_cast<std::size_t>(i)].slopes() =
        R(i, 0) * body[0].slope() + R(i, 1) * body[1].slope() + (R.row(i) * du).array().transpose();
  }
  return world;
}

std::span<const std::uint32_t> Effect::variants() const {
  static constexpr std::uint32_t kAll[] = {~0U};
  return kAll;
}

int find_parameter_violation(const Effect& effect, std::span<const double> values) {
  for (std::size_t i = 0; i < effect.parameters().size(); ++i) {
    const auto& parameter = effect.parameters()[i];
    if (!(values[i] >= parameter.lower && values[i] <= parameter.upper)) return static_cast<int>(i);
  }
  return -1;
}

const Effect* find_effect(std::string_view name) {
  for (const Effect* effect : all_effects())
    if (effect->name() == name) return effect;
  return nullptr;
}

}  // namespace bevel::model
