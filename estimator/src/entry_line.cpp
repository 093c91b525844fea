// SPDX-License-Identifier: MIT
#include <bevel/estimator/entry_line.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace bevel::estimator {
namespace {

constexpr double kAtEntry_mm = 1.0;
constexpr double kGate =
    25;  // of the squared innovation over its variance: what is far off is a reading of something else
// A slope so wide that the readings alone decide: what is asked is what they say, not what was expected.
constexpr double kAnySlope_rad = 0.3;
constexpr double kAnyBend = 1;  // relative: of the curvature, and of how lambda shares it out

double square(double x) { return x * x; }

}  // namespace

EntryLine::EntryLine(const EstimatorConfig& config) : filter_(config), expected_slope_sd_(config.entry_slope_sd_rad) {
  restart();
}

void EntryLine::restart() {
  began_ = false;
  inserted_mm_ = deepest_mm_ = 0;
  passed_ = 0;
  readings_ = 0;
  forgotten_ = 0;
  forgotten_at_.fill(-std::numeric_limits<double>::infinity());
  const Prior& prior = filter_.config().prior;
  const double aside_mm2 = square(prior.position_sd_mm) + square(prior.variation.entry_point_mm);
  mean_.setZero();
  covariance_.setZero();
  covariance_.diagonal() << aside_mm2, aside_mm2, square(kAnySlope_rad), square(kAnySlope_rad), square(kAnyBend),
      square(prior.roll_sd_rad) + square(prior.variation.roll_rad), 1, 1, 1;
}

void EntryLine::add(const model::ActuatorState& axes) {
  if (!began_) {
    if (std::abs(axes.insertion_mm) > kAtEntry_mm && filter_.config().start_at_axes) return;  // not from the entry
    nominal_ = filter_.config().start_at_axes ? filter_.inserted(axes.insertion_mm, axes.rotation_rad)
                                              : filter_.initial(axes.insertion_mm, axes.rotation_rad);
    from_mm_ = filter_.config().start_at_axes ? 0 : axes.insertion_mm;
    needles_.fill(nominal_);
    const Prior& prior = filter_.config().prior;
    needles_[0].lambda1_per_rad += prior.lambda1_sd_per_rad;
    needles_[1].lambda2 += prior.lambda2_sd;
    needles_[2].bending_mm += prior.bending_sd_mm;
    began_ = true;
  } else if (deepest_mm_ <= kTo_mm) {
    const double by_mm = axes.insertion_mm - from_mm_ - inserted_mm_, by_rad = axes.rotation_rad - rotation_rad_;
    forgotten_ += filter_.forgotten(by_mm, by_rad, static_cast<double>(axes.utime - axes_utime_) * 1e-6);
    filter_.predict_mean(nominal_, by_mm, by_rad);
    for (FilterState& needle : needles_) filter_.predict_mean(needle, by_mm, by_rad);
  }
  inserted_mm_ = axes.insertion_mm - from_mm_;
  deepest_mm_ = std::max(deepest_mm_, inserted_mm_);
  rotation_rad_ = axes.rotation_rad;
  axes_utime_ = axes.utime;
  Passed& passed = past_[passed_++ % kPast];
  // Beyond, nothing is followed any more: one that is drawn back from there is not looked at again.
  passed = {axes.utime, deepest_mm_ <= kTo_mm ? inserted_mm_ : deepest_mm_, forgotten_,
            filter_.tip_pose(nominal_).p_mm};
  for (int i = 0; i < kNeedles; ++i)
    passed.beside_mm.col(i) = (filter_.tip_pose(needles_[i]).p_mm - passed.p_mm).head<2>();
}

// The newest that is not newer.
const EntryLine::Passed* EntryLine::at(std::int64_t utime) const {
  for (std::size_t i = 1; i <= std::min(passed_, kPast); ++i)
    if (const Passed& one = past_[(passed_ - i) % kPast]; one.utime <= utime) return &one;
  return nullptr;
}

void EntryLine::add(const model::TipMeasurement& measurement) {
  if (!began_ || measurement.status != 0) return;
  const Passed* passed = at(measurement.utime);
  if (!passed || passed->inserted_mm <= 0 || passed->inserted_mm > kTo_mm) return;
  double& forgotten_at = forgotten_at_[measurement.camera == 0 ? 0 : 1];
  const double worth = filter_.worth(std::max(passed->forgotten - forgotten_at, 0.0));
  if (!(worth > 0)) return;  // nothing was forgotten since the last: it is the same error again
  forgotten_at = std::max(forgotten_at, passed->forgotten);
  const Eigen::Vector3d& p = passed->p_mm;
  Eigen::Matrix<double, 2, kUnknowns> H;
  H.leftCols<6>() << 1, 0, p.z(), 0, p.x(), -p.y(),  //
      0, 1, 0, p.z(), p.y(), p.x();
  H.rightCols<kNeedles>() = passed->beside_mm;
  // What is known across, whatever z may be.
  const Eigen::Matrix3d& W = measurement.information_per_mm2;
  Eigen::Matrix2d across = W.topLeftCorner<2, 2>();
  if (W(2, 2) > 0) across -= W.topRightCorner<2, 1>() * W.bottomLeftCorner<1, 2>() / W(2, 2);
  // One axis after the other, along the eigenvectors of a symmetric 2 x 2: where nothing is seen, nothing is taken.
  const double half_difference = 0.5 * (across(0, 0) - across(1, 1)), mean = 0.5 * across.trace();
  const double radius = std::hypot(half_difference, across(0, 1)),
               angle = 0.5 * std::atan2(across(0, 1), half_difference);
  const Eigen::Vector2d first(std::cos(angle), std::sin(angle)), second(-first.y(), first.x());
  for (const auto& [axis, information] : {std::pair(first, mean + radius), std::pair(second, mean - radius)}) {
    if (!(information > 1e-9)) continue;
    const Unknowns h = H.transpose() * axis;
    const Unknowns Ph = covariance_ * h;
    const double known_mm2 = h.dot(Ph);
    const double along_mm = axis.dot(measurement.position_mm.head<2>() - p.head<2>()) - h.dot(mean_);
    if (!(square(along_mm) < kGate * (known_mm2 + 1 / information))) continue;
    const double variance_mm2 = known_mm2 + 1 / (worth * information);
    mean_ += Ph * (along_mm / variance_mm2);
    covariance_ -= Ph * Ph.transpose() / variance_mm2;
    ++readings_;
  }
}

double EntryLine::slope_sd() const { return std::sqrt(std::max(covariance_(2, 2), covariance_(3, 3))); }

double EntryLine::statistic() const {
  const Eigen::Matrix2d variance =
      covariance_.block<2, 2>(2, 2) + square(expected_slope_sd_) * Eigen::Matrix2d::Identity();
  return slope().dot(variance.inverse() * slope());
}

}  // namespace bevel::estimator
