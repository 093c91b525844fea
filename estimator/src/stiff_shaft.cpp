// SPDX-License-Identifier: MIT
// The filter's propagation where the shaft is stiff: the tip of a beam on an elastic foundation, cutting where it is.
//
// The bicycle of (10) with two more motions of the tip. With K = k the curvature deep in the tissue, b the bending
// length (tenth state), g and h of bevel/model/shaft_end.hpp at x = (depth + guide) / b, and -e2 the bevel's side:
//     turning by dphi:   the tip goes about a point r = K b^2 / 2 g to the other side of the bevel: r dphi along e1;
//     insertion by ds:   the tip advances at the angle K b h toward the bevel, and less deep by 3/2 (K b h / 2)^2 ds:
//                        what is fed is the length of a bent shaft;
//     curvature:         K g h.
// R of the state is that of the shaft without the bend at its end: the shaft's end is inclined toward the bevel by
// K b h / 2 against its e3 (tip_pose). This is tip_swing of the library (model/src/effects/tip_swing.cpp, derived
// there) with the tip itself as the state instead of an offset to be remembered, so that b can be estimated: turning
// shows it.
#include <bevel/estimator/end_motion.hpp>

#include <cmath>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/propagate.hpp>

namespace bevel::estimator {

EndMotion end_motion(const Shaft& shaft, double insertion_mm, double rotation_rad) {
  const double k = shaft.curvature_per_mm, b = shaft.bending_mm, x = shaft.bending_lengths;
  const model::ShaftEnd end = model::shaft_end(x);
  const double g_by_b = -end.g_by_x * x / b, h_by_b = -end.h_by_x * x / b;
  const double chord = 2 * std::sin(rotation_rad / 2), slope = 0.5 * k * b * end.h;
  const double slope_by_b = 0.5 * k * (end.h + b * h_by_b);
  // In the middle of the turn: exact for a turn at rest, of second order in the step otherwise.
  const Eigen::Matrix3d half = model::exp_so3({0, 0, rotation_rad / 2});
  const auto turned = [&](double across, double toward_bevel, double along) -> Eigen::Vector3d {
    return half * Eigen::Vector3d(across, -toward_bevel, along);
  };
  EndMotion out;
  out.moved_mm = turned(0.5 * k * b * b * end.g * chord, 2 * slope * insertion_mm, -1.5 * slope * slope * insertion_mm);
  out.by_curvature =
      turned(0.5 * b * b * end.g * chord, b * end.h * insertion_mm, -1.5 * slope * b * end.h * insertion_mm);
  out.by_bending = turned((k * b * end.g + 0.5 * k * b * b * g_by_b) * chord, 2 * slope_by_b * insertion_mm,
                          -3 * slope * slope_by_b * insertion_mm);
  out.share = end.g * end.h;
  out.share_by_bending = end.g * h_by_b + g_by_b * end.h;
  return out;
}

Swing swing_of(const Shaft& shaft) {
  const double k = shaft.curvature_per_mm, b = shaft.bending_mm, x = shaft.bending_lengths;
  const model::ShaftEnd end = model::shaft_end(x);
  return {{0, 0.5 * k * b * b * end.g, 0},
          {0, 0.5 * b * b * end.g, 0},
          {0, k * b * end.g - 0.5 * k * b * x * end.g_by_x, 0}};
}
bool NeedleFilter::move_stiff(FilterState& state, double insertion_mm, double rotation_rad) const {
  const EndMotion end = end_motion(shaft_of(state), insertion_mm, rotation_rad);
  model::Pose pose{state.pose.R, state.pose.p_mm + state.pose.R * end.moved_mm};
  const model::StepInput input{insertion_mm, rotation_rad, {end.share * state.curvature_per_mm, 0}};
  if (!model::advance(pose, input, slip_of(state))) return false;
  state.pose = pose;
  return true;
}

void NeedleFilter::predict_stiff(FilterState& state, double insertion_mm, double rotation_rad) const {
  const double k = state.curvature_per_mm;
  const EndMotion end = end_motion(shaft_of(state), insertion_mm, rotation_rad);
  model::Pose pose{state.pose.R, state.pose.p_mm + state.pose.R * end.moved_mm};
  model::NeedleJacobian J;
  state.outside_model = !model::advance(pose, {insertion_mm, rotation_rad, {end.share * k, 0}}, slip_of(state), J);
  if (state.outside_model) return;
  state.pose = pose;
  // exp(t)^-1 exp(error) exp(t) of a shift t: v + omega x t.
  model::Matrix6d shift = model::Matrix6d::Identity();
  shift.topRightCorner<3, 3>() = -model::hat(end.moved_mm);
  Eigen::Matrix<double, 6, 4> by_parameters;
  by_parameters << J.needle.col(0) * end.share + J.pose.leftCols<3>() * end.by_curvature, J.needle.middleCols<2>(1),
      J.needle.col(0) * (k * end.share_by_bending) + J.pose.leftCols<3>() * end.by_bending;
  Covariance<10> P = covariance_of<10>(state);
  propagate<10>(P, J.pose * shift, by_parameters);
  if (coloured_ || has_nuisance_) carry_shared<10>(state, J.pose * shift, by_parameters);
  P.diagonal() += process_variance<10>(P, insertion_mm, rotation_rad);
  set_covariance<10>(state, P);
}

model::Pose NeedleFilter::tip_pose(const FilterState& state) const {
  if (!stiff_) {
    if (config_.effects.empty()) return state.pose;
    model::TipReading at;
    needle_.point(augmented(state), at);
    return {state.pose.R, at.position_mm};
  }
  const Shaft shaft = shaft_of(state);
  const double slope_rad = 0.5 * shaft.curvature_per_mm * shaft.bending_mm * model::shaft_end(shaft.bending_lengths).h;
  const double pushed = pressing(state);
  return {state.pose.R * model::exp_so3({pushed * slope_rad, 0, 0}),
          state.pose.p_mm + state.pose.R * ((1 - pushed) * swing_of(shaft).to_middle_mm)};
}

Shaft NeedleFilter::shaft_of(const FilterState& state) const {
  return {state.curvature_per_mm, state.bending_mm, (state.pose.p_mm.z() + config_.prior.guide_mm) / state.bending_mm};
}

}  // namespace bevel::estimator
