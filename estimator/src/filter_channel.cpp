// SPDX-License-Identifier: MIT
// The filter's propagation through a channel that the tip has cut (channel.hpp).
//
// The channel is the path of (10), and is gone through backwards by running the same model backwards with the bevel as
// it stood: turn to that, step, turn back. The derivatives are those of this motion, so that what going in has made of
// an error of k or of the heading, going back takes away again. What uneven tissue did to the path on the way in is in
// the path and not in the model: it is met again, and is the same process noise (without it, in tissue as uneven as the
// filter takes it, the squared error is 2.4 of its variance after 30 mm, with it 0.8; Channel.OfTissue).
//
// A stiff shaft (stiff_shaft.cpp) is pushed aside by the bevel's force by r = K b^2 / 2 g and inclined by K b / 2 h,
// and drawn back is not: what lies in the channel is the middle of the swing, whichever way the bevel points (the beam
// is linear, and its cut as far as it reaches the same as when the tip was there first). Its pose here stays that of
// the tip as if it was pressed; what is seen is aside of that, toward the middle, by r for what is left of the force.
#include <algorithm>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/propagate.hpp>

namespace bevel::estimator {
namespace {

using Eigen::Vector3d;

// Motions in the body, one after the other, and their derivatives by the error before the first and by k, lambda1,
// lambda2 and the tenth.
struct Motions {
  model::Pose pose;
  model::Matrix6d by_pose = model::Matrix6d::Identity();
  Eigen::Matrix<double, 6, 4> by_needle = Eigen::Matrix<double, 6, 4>::Zero();

  void turn(double rad) {
    const Eigen::Matrix3d by = model::exp_so3({0, 0, rad});
    pose.R = pose.R * by;
    model::Matrix6d back = model::Matrix6d::Zero();
    back.topLeftCorner<3, 3>() = back.bottomRightCorner<3, 3>() = by.transpose();
    after(back);
  }
  void shift(const Vector3d& by_mm, const Vector3d& by_curvature, const Vector3d& by_tenth) {
    pose.p_mm += pose.R * by_mm;
    model::Matrix6d J = model::Matrix6d::Identity();
    J.topRightCorner<3, 3>() = -model::hat(by_mm);
    after(J);
    by_needle.block<3, 1>(0, 0) += by_curvature;
    by_needle.block<3, 1>(0, 3) += by_tenth;
  }
  void after(const model::Matrix6d& J) {
    by_pose = J * by_pose;
    by_needle = J * by_needle;
  }
};

}  // namespace

double NeedleFilter::pressing(const FilterState& state) const {
  return std::clamp(1 - state.channel.drawn_back_mm() / config_.prior.bevel_mm, 0.0, 1.0);
}

bool NeedleFilter::draw_through(FilterState& state, const Channel::Part& part, bool with_covariance) const {
  const double turn_rad = part.bend.toward_rad - state.channel.rolled_rad();
  const double share = part.bend.share, k = share * state.curvature_per_mm;
  Motions motions{state.pose};
  const auto shaft_at = [&](double curvature_per_mm) -> Shaft {
    const double length_mm = motions.pose.p_mm.z() + config_.prior.guide_mm;
    return {curvature_per_mm, state.bending_mm, length_mm / state.bending_mm};
  };
  const auto swing = [&](double by) {
    if (!stiff_) return;
    const Swing middle = swing_of(shaft_at(state.curvature_per_mm));
    motions.shift(by * middle.to_middle_mm, by * middle.by_curvature, by * middle.by_bending);
  };
  swing(1);
  motions.turn(turn_rad);
  swing(-share);
  double curvature = k, by_bending = 0, end_share = 1;
  if (stiff_) {
    const EndMotion end = end_motion(shaft_at(k), part.insertion_mm, 0);
    motions.shift(end.moved_mm, share * end.by_curvature, end.by_bending);
    end_share = end.share;
    curvature = end.share * k, by_bending = k * end.share_by_bending;
  }
  model::NeedleJacobian J;
  const model::StepInput input{part.insertion_mm, 0, {curvature, 0}};
  const bool in_domain = takes_midpoint(config_, part.insertion_mm, 0)
                             ? model::advance_by_midpoint(motions.pose, input, slip_of(state), J)
                             : model::advance(motions.pose, input, slip_of(state), J);
  if (!in_domain) return false;
  motions.after(J.pose);
  motions.by_needle.col(0) += share * end_share * J.needle.col(0);
  motions.by_needle.middleCols<2>(1) += J.needle.middleCols<2>(1);
  motions.by_needle.col(3) += stiff_ ? (by_bending * J.needle.col(0)).eval() : J.needle.col(3).eval();
  swing(share);
  motions.turn(-turn_rad);
  swing(-1);
  state.pose = motions.pose;
  if (!with_covariance) return true;
  if (ten_states_) {
    Covariance<10> P = covariance_of<10>(state);
    propagate<10>(P, motions.by_pose, motions.by_needle);
    if (coloured_ || has_nuisance_) carry_shared<10>(state, motions.by_pose, motions.by_needle);
    P.diagonal() += process_variance<10>(P, part.insertion_mm, 0);
    set_covariance<10>(state, P);
  } else {
    if (coloured_ || has_nuisance_) carry_shared<9>(state, motions.by_pose, motions.by_needle.leftCols<3>());
    propagate<9>(state.covariance, motions.by_pose, motions.by_needle.leftCols<3>());
    state.covariance.diagonal() += process_variance<9>(state.covariance, part.insertion_mm, 0);
  }
  return true;
}

template <int kSize>
Vector3d NeedleFilter::drawn_back_tip(const FilterState& state, Eigen::Matrix<double, 3, kSize>& by_state) const {
  const double released = 1 - pressing(state);
  const Swing middle = swing_of(shaft_of(state));
  const Vector3d aside_mm = released * middle.to_middle_mm;
  by_state.setZero();
  by_state.template leftCols<3>() = state.pose.R;
  by_state.template middleCols<3>(3) = -state.pose.R * model::hat(aside_mm);
  by_state.col(6) = released * (state.pose.R * middle.by_curvature);
  by_state.col(kSize - 1) = released * (state.pose.R * middle.by_bending);
  return state.pose.p_mm + state.pose.R * aside_mm;
}
template Vector3d NeedleFilter::drawn_back_tip<10>(const FilterState&, Eigen::Matrix<double, 3, 10>&) const;

}  // namespace bevel::estimator
