// SPDX-License-Identifier: MIT
#include <bevel/drivers/stepper/follow_watch.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <random>

#include <bevel/drivers/stepper/scale_watch.hpp>

namespace bevel::stepper {
namespace {

constexpr std::int64_t kPeriod_ns = 10'000'000, kLag_ns = 80'000'000;
constexpr double kPeriod_s = 1e-9 * kPeriod_ns;

// Turns as a law by arcs makes them: up to 8 rad/s and down at 40 rad/s^2, then rest.
double turning_rad_s(int cycle) {
  const double t_s = std::fmod(cycle * kPeriod_s, 1.5);
  return std::clamp(std::min(40 * t_s, 40 * (0.6 - t_s)), 0.0, 8.0);
}

// An axis that obeys each command after so many thousandths of a second.
class Axis {
 public:
  void command(double rate_unit_s, double delay_s) { coming_.push_back({now_s_ + delay_s, rate_unit_s}); }
  double advance() {
    for (double left_s = kPeriod_s; left_s > 1e-12;) {
      const double until_s =
          coming_.empty() ? now_s_ + left_s : std::clamp(coming_.front().first, now_s_, now_s_ + left_s);
      stands_ += rate_ * (until_s - now_s_);
      left_s -= until_s - now_s_;
      now_s_ = until_s;
      if (left_s > 1e-12) rate_ = coming_.front().second, coming_.pop_front();
    }
    return stands_;
  }

 private:
  double now_s_ = 0, rate_ = 0, stands_ = 0;
  std::deque<std::pair<double, double>> coming_;
};

TEST(FollowWatch, CommandsThatAreObeyedSoonerAndLaterDoNotAddUp) {
  constexpr unsigned kSeed = 3;
  std::mt19937_64 rng(kSeed);
  std::uniform_real_distribution<double> delay_s(0.001, 0.018);
  FollowWatch watch(kLag_ns, kPeriod_ns);
  watch.begin(0, 0);
  Axis axis;
  double obeyed_after_s = 0;
  for (int cycle = 1; cycle <= 20'000; ++cycle) {
    // One that comes before the one sent before it would be another bus.
    obeyed_after_s = std::max(obeyed_after_s - kPeriod_s, delay_s(rng));
    const double rate_rad_s = turning_rad_s(cycle);
    axis.command(rate_rad_s, obeyed_after_s);
    ASSERT_TRUE(watch.follows(cycle * kPeriod_ns, rate_rad_s, axis.advance()))
        << "cycle " << cycle << ", seed " << kSeed;
  }
}

TEST(FollowWatch, AnAxisThatIsBlockedIsFoundWithinTheLagAndTwoPeriods) {
  for (const int blocked_at : {30, 200, 210, 1000}) {  // in a ramp, at the full rate, in the next ramp
    FollowWatch watch(kLag_ns, kPeriod_ns);
    watch.begin(0, 0);
    Axis axis;
    double stands = 0;
    int found_at = 0;
    for (int cycle = 1; cycle <= 2000 && found_at == 0; ++cycle) {
      axis.command(4, 0.005);
      if (const double would = axis.advance(); cycle < blocked_at) stands = would;
      if (!watch.follows(cycle * kPeriod_ns, 4, stands)) found_at = cycle;
    }
    EXPECT_GE(found_at, blocked_at);
    EXPECT_LE(found_at, blocked_at + 12) << "blocked at " << blocked_at;
  }
}

TEST(FollowWatch, AnAxisThatCreepsWhileItShouldRestIsFound) {
  FollowWatch watch(kLag_ns, kPeriod_ns);
  watch.begin(0, 0);
  int cycle = 1;
  while (cycle < 1000 && watch.follows(cycle * kPeriod_ns, 0, 0.2 * cycle * kPeriod_s)) ++cycle;
  EXPECT_NEAR(0.2 * cycle * kPeriod_s, 0.05, 0.005);
}

TEST(FollowWatch, AnAxisThatNeverStartsIsFoundSoonAfterTheLag) {
  FollowWatch watch(kLag_ns, kPeriod_ns);
  watch.begin(0, 0);
  int cycle = 1;
  for (double rate = 0; cycle < 1000; ++cycle) {
    rate = std::min(8.0, 40 * cycle * kPeriod_s);
    if (!watch.follows(cycle * kPeriod_ns, rate, 0)) break;
  }
  EXPECT_LE(cycle, 20);
}

// Seconds until the scale is found wrong for an axis that turns as the steering law commands, up to a minute.
std::optional<double> found_wrong_after_s(double scale, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> delay_s(0.001, 0.018);
  std::normal_distribution<double> noise(0.0, 0.002), rate_noise(0.0, 0.5);
  FollowWatch follow(kLag_ns, kPeriod_ns);
  ScaleWatch watch;
  follow.begin(0, 0);
  Axis axis;
  double obeyed_after_s = 0;
  for (int cycle = 1; cycle <= 6000; ++cycle) {
    obeyed_after_s = std::max(obeyed_after_s - kPeriod_s, delay_s(rng));
    const double rate = turning_rad_s(cycle) + rate_noise(rng);
    axis.command(scale * rate, obeyed_after_s);
    const double stands = axis.advance() + noise(rng);
    (void)follow.follows(cycle * kPeriod_ns, rate, stands);
    watch.add(follow.commanded_unit(), stands);
    if (watch.wrong_scale()) return cycle * kPeriod_s;
  }
  return std::nullopt;
}

TEST(ScaleWatch, FindsAScaleThatIsOffByATenth) {
  for (const double scale : {0.9, 1.1, 1.5})
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const auto after_s = found_wrong_after_s(scale, seed);
      ASSERT_TRUE(after_s) << scale << ", seed " << seed;
      EXPECT_LE(*after_s, 10.0) << scale << ", seed " << seed;
    }
}

TEST(ScaleWatch, ToleratesWhatAScrewsPitchMayBeOffBy) {
  for (const double scale : {0.97, 1.0, 1.03})
    for (unsigned seed = 1; seed <= 20; ++seed)
      EXPECT_FALSE(found_wrong_after_s(scale, seed)) << scale << ", seed " << seed;
}

}  // namespace
}  // namespace bevel::stepper
