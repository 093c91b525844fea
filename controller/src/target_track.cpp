// SPDX-License-Identifier: MIT
#include <bevel/controller/target_track.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <bevel/model/age.hpp>

namespace bevel::controller {
namespace {

constexpr double kSlowest_hz = 0.08, kFastest_hz = 0.6;
// Between neighbours: over the half minute of an insertion, a tenth of a turn at a quarter of a hertz.
constexpr double kFrequencyStep = 1.015;
constexpr double kJump = 30.7;       // chi-square of three axes, one reading in a million
constexpr double kNegligible = -30;  // log weight, of the likeliest's 0

}  // namespace

TargetTrack::TargetTrack(const TargetMotion& motion) : motion_(motion) {
  const int steps = static_cast<int>(std::log(kFastest_hz / kSlowest_hz) / std::log(kFrequencyStep));
  for (int i = 0; i <= steps; ++i)
    breaths_.emplace_back().frequency_rad_s = 2 * std::numbers::pi * kSlowest_hz * std::pow(kFrequencyStep, i);
  restart();
}

void TargetTrack::restart() {
  empty_ = at_rest_ = true;
  jumped_before_ = false;
  const double v = motion_.velocity_sd_mm_s, a = motion_.breathing_sd_mm;
  const double c = motion_.reading_sd_mm + a;  // from the first reading, which is the origin
  for (Breath& breath : breaths_) {
    breath.mean.setZero();
    breath.covariance = Eigen::Vector4d(c * c, v * v, a * a, a * a).asDiagonal();
    breath.log_weight = 0;
  }
}

double TargetTrack::ahead_s(std::int64_t utime) const { return model::age_s(utime, newest_utime_); }

bool TargetTrack::is_jump(std::int64_t utime, const Eigen::Vector3d& position_mm) const {
  const double sd_mm = std::hypot(position_sd_mm(utime), motion_.reading_sd_mm);
  return (position_mm - TargetTrack::position_mm(utime)).squaredNorm() > kJump * sd_mm * sd_mm;
}

void TargetTrack::observe(std::int64_t utime, const Eigen::Vector3d& position_mm) {
  if (empty()) {
    newest_utime_ = utime;
    origin_mm_ = position_mm;
  } else if (utime <= newest_utime_) {
    return;
  } else if (is_jump(utime, position_mm)) {
    // One may be a slip of who reads it; two are another target.
    if (!jumped_before_) {
      jumped_before_ = true;
      return;
    }
    restart();
    return observe(utime, position_mm);
  }
  at_rest_ = empty_;
  empty_ = jumped_before_ = false;
  const double since_s = ahead_s(utime);
  const double a = motion_.breathing_sd_mm, v = motion_.velocity_sd_mm_s;
  const Eigen::Vector4d renewed = Eigen::Vector4d(0, v * v, a * a, a * a) * since_s / motion_.renewed_after_s;
  const double reading_mm2 = motion_.reading_sd_mm * motion_.reading_sd_mm;
  for (Breath& breath : breaths_) {
    const double cosine = std::cos(breath.frequency_rad_s * since_s), sine = std::sin(breath.frequency_rad_s * since_s);
    Eigen::Matrix4d F = Eigen::Matrix4d::Identity();
    F(0, 1) = since_s;
    F.bottomRightCorner<2, 2>() << cosine, sine, -sine, cosine;
    breath.mean = (F * breath.mean).eval();
    breath.covariance = (F * breath.covariance * F.transpose()).eval();
    breath.covariance.diagonal() += renewed;
    const Eigen::Vector4d Ph = breath.covariance.col(0) + breath.covariance.col(2);  // what is read is m + s
    const double variance_mm2 = Ph[0] + Ph[2] + reading_mm2;
    const Eigen::Vector3d innovation_mm =
        position_mm - origin_mm_ - (breath.mean.row(0) + breath.mean.row(2)).transpose();
    breath.mean += Ph / variance_mm2 * innovation_mm.transpose();
    breath.covariance -= Ph * Ph.transpose() / variance_mm2;
    breath.log_weight -= 0.5 * (innovation_mm.squaredNorm() / variance_mm2 + 3 * std::log(variance_mm2));
  }
  weigh();
  newest_utime_ = utime;
}

// Once a reading: predictions are asked for in every step of the law.
void TargetTrack::weigh() {
  const double largest = likeliest().log_weight;
  double sum = 0;
  for (Breath& breath : breaths_) {
    breath.log_weight -= largest;
    breath.weight = breath.log_weight < kNegligible ? 0 : std::exp(breath.log_weight);
    sum += breath.weight;
  }
  for (Breath& breath : breaths_) breath.weight /= sum;
}

const TargetTrack::Breath& TargetTrack::likeliest() const {
  return *std::ranges::max_element(breaths_, {}, &Breath::log_weight);
}

Eigen::Vector4d TargetTrack::reading_after(const Breath& breath, double ahead_s) {
  const double turned_rad = breath.frequency_rad_s * ahead_s;
  return {1, ahead_s, std::cos(turned_rad), std::sin(turned_rad)};
}

Eigen::Vector3d TargetTrack::position_mm(std::int64_t utime) const {
  if (empty()) return Eigen::Vector3d::Zero();
  if (at_rest_) return origin_mm_;
  Eigen::Vector3d mean_mm = origin_mm_;
  for (const Breath& breath : breaths_)
    if (breath.weight > 0) mean_mm += breath.weight * (breath.mean.transpose() * reading_after(breath, ahead_s(utime)));
  return mean_mm;
}

double TargetTrack::position_sd_mm(std::int64_t utime) const {
  if (empty()) return 0;
  const Eigen::Vector3d mean_mm = position_mm(utime) - origin_mm_;
  Eigen::Vector3d between_mm2 = Eigen::Vector3d::Zero();
  double within_mm2 = 0;
  for (const Breath& breath : breaths_) {
    if (breath.weight <= 0) continue;
    const Eigen::Vector4d h = reading_after(breath, ahead_s(utime));
    within_mm2 += breath.weight * h.dot(breath.covariance * h);
    between_mm2 += breath.weight * (breath.mean.transpose() * h - mean_mm).cwiseAbs2();
  }
  return std::sqrt(within_mm2 + between_mm2.maxCoeff());
}

double TargetTrack::period_s() const { return 2 * std::numbers::pi / likeliest().frequency_rad_s; }

double TargetTrack::breathing_mm() const {
  // The longer half axis of the ellipse s cos + c sin.
  const Eigen::Vector3d s = likeliest().mean.row(2), c = likeliest().mean.row(3);
  const double sum = s.squaredNorm() + c.squaredNorm(), difference = s.squaredNorm() - c.squaredNorm();
  return std::sqrt(0.5 * (sum + std::hypot(difference, 2 * s.dot(c))));
}

std::int64_t TargetTrack::next_turn_utime(std::int64_t from_utime) const {
  if (empty()) return from_utime;
  const Breath& breath = likeliest();
  // s cos + c sin is at an end of its longer half axis where tan 2 w t = 2 s.c / (s.s - c.c).
  const Eigen::Vector3d s = breath.mean.row(2), c = breath.mean.row(3);
  const double half_s = std::numbers::pi / breath.frequency_rad_s;
  const double first_s = 0.5 * std::atan2(2 * s.dot(c), s.squaredNorm() - c.squaredNorm()) / breath.frequency_rad_s;
  const double turns = std::ceil((ahead_s(from_utime) - first_s) / half_s);
  return newest_utime_ + std::llround(1e6 * (first_s + turns * half_s));
}

}  // namespace bevel::controller
