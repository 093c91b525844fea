// SPDX-License-Identifier: MIT
#include <bevel/drivers/camera/bevel_shape.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::camera {
namespace {

Moments mix(const Moments& a, const Moments& b, double share) { return a + share * (b - a); }

Moments between(double lo, double hi) {
  return {0.5 * (hi - lo), 0.25 * (hi * hi - lo * lo), (hi * hi * hi - lo * lo * lo) / 6.0};
}

}  // namespace

BevelMoments bevel_moments(double x, double length, double sin_rho) {
  if (x <= 0.0) return {};
  if (x >= length) return {{1.0, 0.0, 1.0 / 3.0}, {}};
  const double c = 1.0 - 2.0 * x / length;
  const double q = std::sqrt(std::max(0.0, 1.0 - c * c));
  const double cos_rho = std::sqrt(std::max(0.0, 1.0 - sin_rho * sin_rho));
  const bool all_right = c < sin_rho;
  const bool all_left = c < -sin_rho;
  const double right = sin_rho * c + cos_rho * q;  // sin(rho + acos c)
  const double left = sin_rho * c - cos_rho * q;
  BevelMoments m;
  m.outline = between(all_left ? -1.0 : left, all_right ? 1.0 : right);
  // The wall before the cut is there where the plane has already left it: beyond the same two lines.
  Moments wall;
  if (all_right) wall = wall + between(right, 1.0);
  if (all_left) wall = wall + between(-1.0, left);
  m.face = m.outline - wall;
  return m;
}

void BlurredBevel::build(double length, double sin_rho, double blur) {
  const double reach = 3.5 * blur;
  step_ = std::clamp(0.5 * blur, 0.02, 0.6);
  const int half = static_cast<int>(std::ceil(reach / step_));
  kernel_.resize(static_cast<size_t>(half) + 1);
  double sum = 0.0;
  for (int i = 0; i <= half; ++i) {
    const double z = i * step_ / blur;
    kernel_[static_cast<size_t>(i)] = std::exp(-0.5 * z * z);
    sum += (i == 0 ? 1.0 : 2.0) * kernel_[static_cast<size_t>(i)];
  }
  for (double& k : kernel_) k /= sum;
  first_x_ = -reach - step_;
  const auto count = static_cast<size_t>(std::ceil((length + 2.0 * reach) / step_)) + 3;
  const auto margin = static_cast<size_t>(half);
  sharp_.resize(count + 2 * margin);
  for (size_t i = 0; i < sharp_.size(); ++i)
    sharp_[i] =
        bevel_moments(first_x_ + (static_cast<double>(i) - static_cast<double>(margin)) * step_, length, sin_rho);
  table_.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const size_t here = i + margin;
    const auto add = [&](double weight, const BevelMoments& m) {
      table_[i].outline = table_[i].outline + weight * m.outline;
      table_[i].face = table_[i].face + weight * m.face;
    };
    table_[i] = {};
    add(kernel_[0], sharp_[here]);
    for (size_t k = 1; k < kernel_.size(); ++k) {
      add(kernel_[k], sharp_[here - k]);
      add(kernel_[k], sharp_[here + k]);
    }
  }
}

BlurredBevel::Value BlurredBevel::at(double x) const {
  const double place = (x - first_x_) / step_;
  if (place <= 0.0) return {};
  const auto i = static_cast<size_t>(place);
  if (i + 1 >= table_.size()) return {{{1.0, 0.0, 1.0 / 3.0}, {}}, {}};
  const BevelMoments& a = table_[i];
  const BevelMoments& b = table_[i + 1];
  const double share = place - static_cast<double>(i);
  const auto slope = [this](const Moments& from, const Moments& to) { return 1.0 / step_ * (to - from); };
  return {{mix(a.outline, b.outline, share), mix(a.face, b.face, share)},
          {slope(a.outline, b.outline), slope(a.face, b.face)}};
}

}  // namespace bevel::camera
