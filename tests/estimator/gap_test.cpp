// SPDX-License-Identifier: MIT
// Gaps in the reports of the axes: the estimate after one is as uncertain as the motion that nobody observed can have
// made it, and no measurement within one is applied where the axes are not known.
#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <string>

#include <bevel/estimator/health.hpp>
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

using testing::agar_config;
constexpr double kFastest_mm_s = 20, kFastest_rad_s = 12;

enum class Unseen { stopped, inserted_then_turned, turned_then_inserted, to_and_fro, arbitrary, kCount };
constexpr std::array kNames = {"stopped", "inserted, then turned", "turned, then inserted", "to and fro", "arbitrary"};

struct Rates {
  double mm_s = 0, rad_s = 0;
};

// Rates within the limits at each millisecond of a gap.
std::vector<Rates> draw_motion(Unseen kind, int gap_ms, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Rates> rates(static_cast<std::size_t>(gap_ms));
  const auto fill = [&](int from, int to, Rates with) {
    for (int ms = from; ms < std::min(to, gap_ms); ++ms) rates[static_cast<std::size_t>(ms)] = with;
  };
  const double share = 0.2 + 0.6 * unit(rng), side = unit(rng) < 0.5 ? -1 : 1;
  const int half = static_cast<int>(share * gap_ms);
  switch (kind) {
    case Unseen::stopped:  // by the drives, 160 ms after the driver was heard last
      fill(0, 160, {10, 2 * side});
      break;
    case Unseen::inserted_then_turned:
      fill(0, half, {kFastest_mm_s, 0});
      fill(half, gap_ms, {0, side * kFastest_rad_s * unit(rng)});
      break;
    case Unseen::turned_then_inserted:
      fill(0, half, {0, side * kFastest_rad_s * unit(rng)});
      fill(half, gap_ms, {kFastest_mm_s, 0});
      break;
    case Unseen::to_and_fro: {  // out with the bevel one way, back with it the other, as far as the entry allows
      const int out = std::min(gap_ms / 2 - 66, 1500), turn = 131 * 2;  // half a turn at full rate
      if (out <= 0) break;
      fill(0, out, {side * kFastest_mm_s, 0});
      fill(out, out + turn, {0, kFastest_rad_s});
      fill(out + turn, 2 * out + turn, {-side * kFastest_mm_s, 0});
      break;
    }
    default:
      for (int ms = 0; ms < gap_ms;) {
        const int until = ms + 20 + static_cast<int>(unit(rng) * 0.5 * gap_ms);
        fill(ms, until, {kFastest_mm_s * (2 * unit(rng) - 0.8) / 1.2, kFastest_rad_s * (2 * unit(rng) - 1)});
        ms = until;
      }
  }
  return rates;
}

struct Passed {
  bool in_domain = true;
  bool reset_before = false;     // the filter took the bevel for turned over: a k of the prior's far end
  std::array<double, 3> nees{};  // at the end of the gap, after half a second at rest, after 40 mm more
  Estimate after;
  std::int64_t in_gap = 0;
};

// 40 mm in, a gap with cameras that go on measuring, half a second at rest, and 40 mm more.
Passed run(const EstimatorConfig& config, Unseen kind, double gap_s, std::mt19937_64& rng) {
  const model::NeedleParameters needle = testing::draw_needle(config.prior, rng);
  const auto slip = model::slip_parameters(needle);
  model::Pose pose = testing::draw_start(config.prior, rng);
  const int gap_ms = static_cast<int>(1000 * gap_s), from = 4000;
  const std::vector<Rates> unseen = draw_motion(kind, gap_ms, rng);
  NeedleEstimator estimator(config);
  Passed out;
  double inserted_mm = 0, rotation_rad = 0;
  const int rest = from + gap_ms, again = rest + 500, end = gap_s > 2 ? again : again + 4000;
  for (int ms = 0; ms <= end; ++ms) {
    const std::int64_t utime = testing::kStart_utime + std::int64_t{1000} * ms;
    const bool in_gap = ms > from && ms < rest;
    Rates now;
    if (ms < from || (ms >= again && ms < end)) now = {10, (ms / 1000) % 2 ? -0.9 : 0.9};
    if (ms >= from && ms < rest) now = unseen[static_cast<std::size_t>(ms - from)];
    if (ms == from && estimator.estimate(utime).state.reset_count > 0) {
      out.reset_before = true;
      break;
    }
    if (inserted_mm < 5 && now.mm_s < 0) now.mm_s = 0;
    if (ms % 33 == 7) estimator.add(testing::measure(pose.p_mm, utime, ms, 0, {0, 1, 1}, 0.15, rng));
    if (ms % 33 == 19) estimator.add(testing::measure(pose.p_mm, utime, ms, 1, {1, 0, 1}, 0.15, rng));
    if ((ms % 10 == 0 && !in_gap) || ms == rest) {
      model::ActuatorState axes;
      axes.utime = utime, axes.seq = ms;
      axes.insertion_mm = inserted_mm, axes.rotation_rad = rotation_rad;
      axes.insertion_rate_mm_s = now.mm_s, axes.rotation_rate_rad_s = now.rad_s;
      estimator.add(axes);
      const int at = ms == rest ? 0 : ms == again ? 1 : ms == end ? 2 : -1;
      if (at >= 0)
        out.nees.at(static_cast<std::size_t>(at)) = testing::nees_of(estimator.estimate(utime).state, pose, needle);
      if (at == 0) out.after = estimator.estimate(utime);
    }
    if (!model::step(pose, {now.mm_s * 1e-3, now.rad_s * 1e-3, {needle.curvature_per_mm, 0}}, slip) ||
        model::evaluate_slip(model::tilt_rad(pose), slip.lambda1_per_rad, slip.lambda2).gamma_rad >
            model::kDefaultGammaMax_rad) {
      out.in_domain = false;
      break;
    }
    inserted_mm += now.mm_s * 1e-3;
    rotation_rad += now.rad_s * 1e-3;
  }
  out.in_gap = estimator.counters().positions.in_gap;
  return out;
}

// Mean NEES over nine states, of 100 needles drawn from the prior for each motion and length of gap; the plant is the
// model, so that no process noise covers anything else.
TEST(Gap, UnseenMotionWithinTheLimitsStaysWithinTheCovariance) {
  constexpr int kRuns = 100;
  constexpr unsigned kSeed = 60;
  EstimatorConfig config = agar_config();
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};
  const boost::math::chi_squared chi2(9.0 * kRuns);
  const double highest = boost::math::quantile(chi2, 0.999) / (9 * kRuns);
  std::cout << "seed " << kSeed << ", " << kRuns << " insertions each, NEES/9 at the end of the gap, after 0.5 s at "
            << "rest, after 40 mm more; 99.9 % quantile " << highest << "\n";
  for (int k = 0; k < static_cast<int>(Unseen::kCount); ++k)
    for (const double gap_s : {0.2, 1.0, 2.0, 5.0}) {
      std::mt19937_64 rng(kSeed);
      std::array<double, 3> nees{};
      int redrawn = 0;
      for (int i = 0; i < kRuns;) {
        const Passed one = run(config, static_cast<Unseen>(k), gap_s, rng);
        if (!one.in_domain || one.reset_before) {
          ASSERT_LT(++redrawn, 10 * kRuns);
          continue;
        }
        ++i;
        EXPECT_EQ(one.after.state.reset_cause, ResetCause::gap);
        EXPECT_EQ(one.after.state.reset_count, 1);
        EXPECT_NE(one.after.health & kResetByGap, 0);
        EXPECT_GT(one.in_gap, 0);
        for (std::size_t n = 0; n < nees.size(); ++n) nees.at(n) += one.nees.at(n) / (9 * kRuns);
      }
      std::cout << kNames.at(static_cast<std::size_t>(k)) << ", " << gap_s << " s: " << nees[0] << " " << nees[1] << " "
                << nees[2] << ", redrawn " << redrawn << "\n";
      // After longer ones the heading is reported as too uncertain, and nothing is steered by it.
      const std::size_t checked = gap_s > 2 ? 2 : 3;
      for (std::size_t n = 0; n < checked; ++n)
        EXPECT_LT(nees.at(n), highest) << kNames.at(static_cast<std::size_t>(k)) << " " << gap_s << ", " << n;
    }
}

// Periods that vary as they do are no gap: the same to the last bit as without any limit on them.
TEST(Gap, AnIntervalWithinTheAgeLimitIsInterpolatedAsBefore) {
  std::mt19937_64 rng(61);
  EstimatorConfig config = agar_config();
  testing::Insertion data = testing::insert(config.prior.needle, {}, {}, rng);
  std::erase_if(data.actuators, [](const model::ActuatorState& a) { return a.seq % 60 > 0 && a.seq % 60 < 8; });
  EstimatorConfig any = config;
  any.axes.gap_s = 0;
  NeedleEstimator estimator(config), unlimited(any);
  testing::play(estimator, data);
  testing::play(unlimited, data);
  const auto now = data.actuators.back().utime;
  const FilterState a = estimator.estimate(now).state, b = unlimited.estimate(now).state;
  EXPECT_EQ(a.pose.p_mm, b.pose.p_mm);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.reset_count, 0);
}

// While it resets drives for an arm the stepper reports nothing. Drives that are not enabled, before and after, and
// that stand where they stood, have not moved.
TEST(Gap, DrivesThatAreNotEnabledAndStandWhereTheyStoodHaveNotMoved) {
  for (const auto& [before, after, moved_mm, gap] :
       {std::tuple(3, 0, 0.0, false), std::tuple(2, 2, 0.0, true), std::tuple(3, 0, 0.5, true),
        std::tuple(3, 2, 0.0, true), std::tuple(0, 0, 0.0, true)}) {
    NeedleEstimator estimator(agar_config());
    for (int i = 0; i < 20; ++i) {
      model::ActuatorState axes;
      axes.utime = testing::kStart_utime + std::int64_t{10'000} * i + (i >= 10 ? 600'000 : 0);
      axes.seq = i;
      axes.axis_status = {i < 10 ? before : after, i < 10 ? before : 3 * (after != 0)};
      axes.insertion_mm = 20 + (i >= 10 ? moved_mm : 0);
      estimator.add(axes);
    }
    const auto now = testing::kStart_utime + 790'000;
    EXPECT_EQ(estimator.estimate(now).state.reset_count, gap ? 1 : 0) << before << after << moved_mm;
  }
}

// One report that arrives late, within a gap, ends it: what was measured is applied, and nothing is reset.
TEST(Gap, AReportThatArrivesLateClosesIt) {
  std::mt19937_64 rng(62);
  EstimatorConfig config = agar_config();
  testing::InsertionPlan plan;
  plan.length_mm = 10;
  const testing::Insertion data = testing::insert(config.prior.needle, {}, plan, rng);
  NeedleEstimator whole(config, 512), late(config, 512);
  testing::play(whole, data);
  testing::Insertion without = data;
  std::erase_if(without.actuators, [](const model::ActuatorState& a) { return a.seq > 40 && a.seq < 60; });
  testing::play(late, without);
  const auto now = data.actuators.back().utime;
  EXPECT_EQ(late.estimate(now).state.reset_count, 1);
  for (const auto& a : data.actuators)
    if (a.seq > 40 && a.seq < 60) late.add(a);
  EXPECT_EQ(late.estimate(now).state.reset_count, 0);
  EXPECT_EQ(late.estimate(now).state.pose.p_mm, whole.estimate(now).state.pose.p_mm);
  EXPECT_EQ(late.estimate(now).state.covariance, whole.estimate(now).state.covariance);
}

// After a long gap the needle can point anywhere: the health word reports that the heading is too uncertain.
TEST(Gap, ALongOneIsReportedAsAnUncertainHeading) {
  std::mt19937_64 rng(63);
  const EstimatorConfig config = agar_config();
  for (const double gap_s : {0.2, 10.0}) {
    const Passed one = run(config, Unseen::stopped, gap_s, rng);
    EXPECT_EQ((one.after.health & kHeadingUncertain) != 0, gap_s > 1) << gap_s;
    EXPECT_NE(describe_health(one.after.health).find("reset: motion of the axes was not reported"), std::string::npos);
  }
}

// Through the channel, with a stiff shaft, with errors that frames share, with a wind-up and with an ell that is
// estimated: finite, symmetric, positive definite.
TEST(Gap, EveryFilterPassesOne) {
  for (int variant = 0; variant < 6; ++variant) {
    std::mt19937_64 rng(64);
    EstimatorConfig config = agar_config();
    config.through_channel = variant != 5;
    if (variant == 1) config.prior.bending_mm = 30, config.prior.bending_sd_mm = 5;
    if (variant == 2) config.reading = {.correlated_share = 0.5, .correlation_s = 0.3};
    if (variant == 3) config.nuisance = {.windup_sd_rad = 0.4, .latency_sd_s = 0.01};
    if (variant == 4) config.prior.wheelbase_sd_mm = 3;
    for (const Unseen kind : {Unseen::arbitrary, Unseen::to_and_fro}) {
      const Passed one = run(config, kind, 1.5, rng);
      const FilterState& s = one.after.state;
      EXPECT_TRUE(s.pose.p_mm.allFinite()) << variant;
      EXPECT_EQ(s.covariance, s.covariance.transpose()) << variant;
      EXPECT_EQ(s.covariance.llt().info(), Eigen::Success) << variant;
      EXPECT_EQ(s.reset_cause, ResetCause::gap) << variant;
    }
  }
}

}  // namespace
}  // namespace bevel::estimator
