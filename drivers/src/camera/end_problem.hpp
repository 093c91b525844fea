// SPDX-License-Identifier: MIT
#pragma once
// The least-squares problem behind fit_end() (end_fit.hpp): parameters, residuals and gradients, damped descent with
// weights that forgive what is no needle, the noise that the residuals show, and what the parameters say of the end
// that is seen.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include <bevel/drivers/camera/bevel_shape.hpp>
#include <bevel/drivers/camera/end_fit.hpp>

namespace bevel::camera::end {

// Of the model in end_fit.hpp: tip px; height and base gray px; roll rad; the bevel's length as the logarithm of px;
// pale; the axis's offset in px, by powers of s over the profile's length; and by how much its curvature, in the same
// unit, is another one before each of kBends places.
enum Parameter { tip, height, base, roll, log_bevel, pale, c0, c1, c2, bend0 };
inline constexpr int kBends = 3;
inline constexpr int kParameters = bend0 + kBends;
using Vector = cv::Vec<double, kParameters>;
using Matrix = cv::Matx<double, kParameters, kParameters>;
inline constexpr double kHalfPi = std::numbers::pi / 2.0;

struct Prior {
  Vector mean;
  Vector information;  // 1 / sd^2; 0 where nothing is known
  void hold_bends(double sd) {
    for (int k = 0; k < kBends; ++k) information[bend0 + k] = 1.0 / (sd * sd);
  }
};

inline constexpr int kChannels = 3;  // m0, m1 in the scale of m0, m2

// How residuals count: scale and correlation of each channel. A shade moves m0 most and m2 least.
struct Noise {
  std::array<double, kChannels> sigma{};
  std::array<double, kChannels> correlation_px{};
  double information(int channel) const {
    const auto n = static_cast<size_t>(channel);
    return 1.0 / (sigma[n] * sigma[n] * correlation_px[n]);
  }
};

// 95 % efficient for Gaussian residuals; what is far out counts as its logarithm only.
inline constexpr double kCauchy = 2.385;
/// Gaussian residuals so weighted have 0.795 of their variance, and the estimate 1.053 of the least there is where the
/// weighted normal equations say 1 / 0.877: both mended in the scale of the noise.
inline constexpr double kWeighted = 1.053 * 0.877 / 0.795;

class Problem {
 public:
  Problem(const EndProfile& profile, const EndPriors& priors) : profile_(profile), priors_(priors) {
    moment_scale_ = std::sqrt(3.0) / priors.window_px;
    const double last = profile.first_s_px + static_cast<double>(size()) - 1.0;
    length_px_ = std::max(10.0, last - profile.first_s_px);
    width_px2_ = shaft_width_px2();
  }

  int size() const { return static_cast<int>(profile_.dark.size()); }
  double s(int i) const { return profile_.first_s_px + i; }
  double first_s() const { return s(0); }
  double last_s() const { return s(size() - 1); }
  double t(double s_px) const { return s_px / length_px_; }
  double length_px() const { return length_px_; }
  /// What a change of curvature by 2 / length_px^2 before bend `k` sets a point at s aside by, px.
  double by_bend(int k, double s_px) const {
    const double before = std::max(0.0, bend_s(k) - s_px) / length_px_;
    return before * before;
  }
  /// Offset of the axis from the nominal line, px.
  double offset(const Vector& p, double s_px) const {
    const double ti = t(s_px);
    double c = p[c0] + ti * (p[c1] + ti * p[c2]);
    for (int k = 0; k < kBends; ++k) c += p[bend0 + k] * by_bend(k, s_px);
    return c;
  }

  struct Tables {
    BlurredBevel here, rolled, longer;
  };
  static constexpr double kRollStep_rad = 0.02;
  static constexpr double kLogStep = 0.02;

  /// The shapes that `p` asks for, and those a step of roll and length beside it.
  void build(const Vector& p, Tables& tables, bool gradient) const;

  /// Residuals (m0, scaled m1, m2) of sample i, and their gradients where wanted.
  struct Sample {
    double residual[kChannels];
    Vector gradient[kChannels];  // of the model
    double share = 0.0;
  };
  void sample(const Vector& p, const Tables& tables, int i, bool gradient, Sample& out) const;

  struct System {
    Matrix normal = Matrix::zeros();
    Vector right{};
    double cost = 0.0;
  };
  double weight(double residual, int channel, const Noise& noise) const;
  /// Normal equations and cost at `p`, priors included.
  System assemble(const Vector& p, const Prior& prior, const Noise& noise, bool gradient);

  /// At most `turns` steps of Levenberg-Marquardt from `p`, which is moved; the cost it ends with.
  double descend(Vector& p, const Prior& prior, const Noise& noise, int turns);

  /// Scale of the residuals at `p`, and over how many samples they are alike.
  Noise noise_at(const Vector& p);

  /// Cost of ends at every third pixel with all else as expected: where to begin.
  std::vector<std::pair<double, double>> coarse(const Prior& prior, const Noise& noise);

  /// Where kSeenShare of the darkness is left, s and across, by the table of p's shape.
  cv::Vec2d seen(const Vector& p, const BlurredBevel& table) const;
  /// How much further the last darkness reaches than the model says, over a needle's width around `about_s`, and the
  /// variance of that: a cut that is worn or that shines ends elsewhere, whatever the model says.
  cv::Vec2d beyond_model(const Vector& p, const Noise& noise, double about_s);
  /// And what each parameter does to them; after assemble() with gradient.
  struct Seen {
    cv::Vec2d place;
    Vector by_s, by_across;
  };
  Seen seen_with_gradient(const Vector& p) const;

 private:
  /// Evenly over the piece up to where the nominal line ends.
  double bend_s(int k) const { return profile_.first_s_px * (k + 0.5) / kBends; }
  /// What blur adds to the second moment, from how wide the shaft is where it is whole.
  double shaft_width_px2() const;
  /// As much of an offset as is more than chance, where one of a radius is nothing unusual, and the variance of that.
  cv::Vec2d more_than_chance(double offset_px, double variance_px2) const;
  const EndProfile& profile_;
  const EndPriors& priors_;
  double length_px_ = 1.0;
  double moment_scale_ = 1.0;
  double width_px2_ = 0.0;
  Tables tables_;
};

}  // namespace bevel::camera::end
