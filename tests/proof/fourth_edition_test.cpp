// SPDX-License-Identifier: MIT
// The kinds that the fourth edition has beside those of the third: what they are, each by its own law, that they can be
// seen, and that the editions before it draw what they drew.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proof/trial.hpp"

namespace bevel::proof {
namespace {

const BaseNeedle kBicycle{0.005, 22, 0, 0};
const BaseNeedle kStraight{0, 22, 0, 0};

AxisMotion motion_of(std::vector<Segment> segments) { return follow({"test", std::move(segments)}); }

std::vector<EffectKind> new_kinds() {
  const auto& before = catalogue(3);
  return {catalogue(4).begin() + static_cast<std::ptrdiff_t>(before.size()), catalogue(4).end()};
}

// The recordings of a rich trial, with nothing concealed.
struct Rich {
  BaseNeedle needle;
  Setting setting;
};
Rich rich_trial(std::uint64_t seed) {
  int number = 0;
  while (!draw_recordings(seed, number).truth.rich) ++number;
  const Trial trial = draw_recordings(seed, number);
  Rich rich{.needle = trial.truth.needle, .setting = {}};
  for (const TrialRecording& recording : trial.recordings) {
    rich.setting.motions.push_back(recording.motion);
    rich.setting.frames.push_back(recording.frames);
    rich.setting.whiteners.emplace_back(trial.truth.noise, recording.frames);
  }
  return rich;
}

TEST(FourthEdition, AddsSixKindsOnNoList) {
  const auto &third = catalogue(3), &fourth = catalogue(4);
  ASSERT_EQ(fourth.size(), third.size() + 6);
  for (std::size_t i = 0; i < third.size(); ++i) {
    EXPECT_STREQ(fourth[i].name, third[i].name);
    EXPECT_EQ(fourth[i].listed, third[i].listed);
    ASSERT_EQ(fourth[i].parameters.size(), third[i].parameters.size());
    for (std::size_t j = 0; j < third[i].parameters.size(); ++j) {
      EXPECT_EQ(fourth[i].parameters[j].slot, third[i].parameters[j].slot) << third[i].name;
      EXPECT_EQ(fourth[i].parameters[j].low, third[i].parameters[j].low) << third[i].name;
      EXPECT_EQ(fourth[i].parameters[j].high, third[i].parameters[j].high) << third[i].name;
    }
  }
  for (const EffectKind& kind : new_kinds()) {
    EXPECT_FALSE(kind.listed) << kind.name;
    EXPECT_TRUE(std::ranges::none_of(third, [&](const EffectKind& k) { return std::string(k.name) == kind.name; }));
  }
}

// Numbers of the program before there was a fourth.
TEST(FourthEdition, LeavesTheOthersAsTheyWere) {
  struct Known {
    int edition, number;
    double varied;
    const char *first, *last;
    double first_sigmas;
    Eigen::Vector3d last_of_sixth_mm;
  };
  const Known all[] = {
      {1, 3, 0, "flip_transient", "puncture", 20.9354891, {-0.343315046, -5.817287393, 54.680670136}},
      {1, 17, 0, "roll_friction", "refraction", 9.49320206, {0.478233324, -3.551979715, 60.310268628}},
      {2, 17, 0, "roll_friction", "slip_direction", 9.49627202, {0.470910357, -3.528552392, 60.310664123}},
      {3, 9, 1, "drilling", "drilling", 4.29867067, {0.857007027, -16.630680181, 85.534879720}},
      {3, 17, 0, "roll_friction", "slip_direction", 9.49627202, {0.470910357, -3.528552392, 60.310664123}}};
  for (const Known& known : all) {
    SCOPED_TRACE("edition " + std::to_string(known.edition) + ", trial " + std::to_string(known.number));
    const Trial trial = draw_trial(4, known.number, {.varied = known.varied, .edition = known.edition});
    ASSERT_FALSE(trial.truth.entries.empty());
    const TruthEntry &first = trial.truth.entries.front(), &last = trial.truth.entries.back();
    EXPECT_EQ(first.effect.kind.empty() ? first.effect.name : first.effect.kind, known.first);
    EXPECT_EQ(last.effect.name, known.last);
    EXPECT_NEAR(first.visible_sigmas, known.first_sigmas, 1e-6);
    const Eigen::Matrix3Xd& reported_mm = trial.recordings[5].reported_mm;
    EXPECT_LT((reported_mm.col(reported_mm.cols() - 1) - known.last_of_sixth_mm).norm(), 1e-7);
  }
}

TEST(FourthEdition, EachKindIsSeenAtItsReportedSizes) {
  constexpr std::uint64_t kSeeds[] = {101, 102, 103, 104, 105};
  std::vector<Rich> trials;
  for (const std::uint64_t seed : kSeeds) trials.push_back(rich_trial(seed));
  for (const EffectKind& kind : new_kinds()) {
    Random random(9);
    double mean = 0;
    std::string each;
    for (const Rich& trial : trials) {
      const ConcealedEffect effect = draw_effect(kind, random, trial.setting.motions);
      const Views seen = views_of(trial.setting, trial.needle, physics_of({effect}, 1));
      const double sigmas = refit_base(trial.setting, seen, trial.needle, {}).sigmas;
      EXPECT_GT(sigmas, 1) << kind.name;
      mean += sigmas / static_cast<double>(std::size(kSeeds));
      each += " " + std::to_string(sigmas);
    }
    std::printf("  %s, seeds 101 to 105:%s, mean %.1f standard deviations\n", kind.name, each.c_str(), mean);
    EXPECT_GT(mean, kVisible_sigmas) << kind.name;
  }
}

TEST(FourthEdition, EachKindVanishesInProportion) {
  const Rich trial = rich_trial(101);
  const Views bare = views_of(trial.setting, trial.needle, {});
  for (const EffectKind& kind : new_kinds()) {
    SCOPED_TRACE(kind.name);
    Random random(10);
    const ConcealedEffect effect = draw_effect(kind, random, trial.setting.motions);
    const auto difference = [&](double factor) {
      const HiddenPhysics physics = physics_of({scaled(effect, factor)}, 1);
      return whitened_difference(trial.setting, views_of(trial.setting, trial.needle, physics), bare);
    };
    EXPECT_EQ(difference(0).norm(), 0);
    const Eigen::VectorXd small = difference(0.02), half = difference(0.01);
    EXPECT_GT(half.norm(), 1e-3);
    EXPECT_LT((small - 2 * half).norm(), 0.02 * small.norm());
  }
}

// L (F - L)^3 over its largest, which is at a quarter of F = 130 mm; none of it once the shaft is pulled.
TEST(FreeShaftBow, IsLargestWithAQuarterInAndGoneWhenPulled) {
  HiddenPhysics physics;
  physics.bow_mm = 2;
  DriveTrain drive(physics, {}, 0);
  std::vector<double> lag_mm;
  double time_s = 0;
  const auto at = [&](double base_mm) {
    const double tip_mm = drive.step(time_s, base_mm, 0, 0).advance_mm;
    time_s += kStep_s;
    lag_mm.push_back(base_mm - tip_mm);
    return tip_mm;
  };
  for (int i = 0; i <= 6500; ++i) at(0.01 * i);
  const auto largest = std::ranges::max_element(lag_mm);
  EXPECT_NEAR(*largest, 2, 1e-3);
  EXPECT_NEAR(0.01 * static_cast<double>(largest - lag_mm.begin()), 32.5, 0.1);
  EXPECT_NEAR(lag_mm.back(), 2 * 0.5 * std::pow(0.5, 3) / (0.25 * std::pow(0.75, 3)), 1e-6);
  const double held_mm = at(65);  // at rest it stays
  EXPECT_NEAR(held_mm, 65 - lag_mm[6500], 1e-9);
  double base_mm = 65;
  double tip_mm = held_mm;
  for (int i = 0; i < 100; ++i) tip_mm = at(base_mm -= 0.01);
  EXPECT_GT(held_mm - tip_mm, 0.3);  // drawn back by 1 mm, the tip follows by less
  EXPECT_LT(held_mm - tip_mm, 0.7);
  for (int i = 0; i < 2000; ++i) tip_mm = at(base_mm -= 0.01);
  EXPECT_NEAR(tip_mm, base_mm, 1e-3);
}

TEST(ChuckSlip, LosesOfEachTurnByItsDepthAndNothingComesBack) {
  HiddenPhysics physics;
  physics.chuck_slip_at_100mm = 0.2;
  DriveTrain drive(physics, {}, 0);
  double time_s = 0;
  const auto roll_at = [&](double base_mm, double base_rad) {
    return drive.step(time_s += kStep_s, base_mm, base_rad, 0).roll_rad;
  };
  double roll_rad = roll_at(0, 0);
  for (int i = 1; i <= 500; ++i) roll_rad = roll_at(0, 0.004 * i);
  EXPECT_NEAR(roll_rad, 2, 1e-12);  // nothing holds a shaft that is not in yet
  for (int i = 1; i <= 500; ++i) roll_at(0.1 * i, 2);
  for (int i = 1; i <= 500; ++i) roll_rad = roll_at(50, 2 + 0.006 * i);
  EXPECT_NEAR(roll_rad, 2 + 3 * (1 - 0.1), 1e-9);
  for (int i = 500; i >= 1; --i) roll_rad = roll_at(50, 2 + 0.006 * (i - 1));
  EXPECT_NEAR(roll_rad, 2, 1e-9);  // there and back at one depth
  for (int i = 1; i <= 500; ++i) roll_rad = roll_at(50, 2 + 0.006 * i);
  for (int i = 1; i <= 300; ++i) roll_rad = roll_at(50 + 0.1 * i, 5);
  for (int i = 500; i >= 1; --i) roll_rad = roll_at(80, 2 + 0.006 * (i - 1));
  EXPECT_NEAR(roll_rad, 2 + 3 * 0.2 * (80 - 50) / 100, 1e-9);
}

// A heading that a fixed direction pulls by theta leans by the Gudermannian of theta: d lean = cos(lean) d theta.
TEST(ObliqueInterface, LeadsAStraightNeedleAsideByItsAngleAndBack) {
  HiddenPhysics physics;
  physics.interface_rad = 0.3;
  physics.interface_depth_mm = 30;
  physics.interface_toward_rad = 0.7;
  const AxisMotion motion = motion_of({{6, 10, 0}, {0.5, 0, 0}, {6, -10, 0}, {0.3, 0, 0}});
  const TipPath path = travel(kStraight, motion, physics, {}, 0);
  const std::size_t deepest = 6200;
  const Eigen::Vector3d way = path[5900] - path[5000];
  EXPECT_NEAR(std::atan2(way.head<2>().norm(), way.z()), 2 * std::atan(std::tanh(0.5 * 0.3)), 1e-4);
  EXPECT_NEAR(std::atan2(way.y(), way.x()), 0.7, 1e-6);
  // As if it were bent in one point on the interface.
  const double lateral_mm = path[deepest].head<2>().norm();
  EXPECT_NEAR(lateral_mm, (path[deepest].z() - 30) * way.head<2>().norm() / way.z(), 0.1);
  EXPECT_LT(path[2500].head<2>().norm(), 5e-3);   // before it is straight
  EXPECT_LT(path.back().head<2>().norm(), 1e-3);  // and is again, drawn back through it
  // Far to the side on which it lies deeper it is met later: at 30 + 0.5 * 20 mm.
  HiddenPhysics leaning = physics;
  leaning.entry_about_y_rad = std::numbers::pi / 6;
  leaning.interface_toward_rad = 0;
  leaning.interface_rad = 0.05;
  const TipPath aslant = travel(kStraight, motion, leaning, {}, 0);
  const auto lean_at = [&](std::size_t i) {
    const Eigen::Vector3d d = aslant[i + 10] - aslant[i - 10];
    return std::atan2(d.x(), d.z());
  };
  std::size_t half = 100;
  while (lean_at(half) < 0.5 * (lean_at(100) + lean_at(5900))) ++half;
  EXPECT_NEAR(aslant[half].z() - 0.5 * aslant[half].x(), 30, 0.2);
}

// u' = 1 / tau - (1 / tau + v / length) u from u = 1: heading = k (s - share * integral of u), by hand.
TEST(Reloading, BendsLessAtTheEntryAndAfterAHold) {
  HiddenPhysics physics;
  physics.reloading_share = 0.6;
  physics.reloading_tau_s = 2;
  physics.reloading_length_mm = 8;
  constexpr double kSpeed_mm_s = 10;
  const double per_mm = 1.0 / 8 + 1.0 / (2 * kSpeed_mm_s);  // at which u settles
  const double settled = 1 / (2 * kSpeed_mm_s) / per_mm;
  const auto bend_rad = [&](double u, double s_mm) {
    return 0.005 * (s_mm - 0.6 * (settled * s_mm + (u - settled) * (1 - std::exp(-per_mm * s_mm)) / per_mm));
  };
  const AxisMotion motion = motion_of({{4, kSpeed_mm_s, 0}, {3, 0, 0}, {3, kSpeed_mm_s, 0}, {0.3, 0, 0}});
  const TipPath path = travel(kBicycle, motion, physics, {}, 0);
  const auto heading_rad = [&](std::size_t i) {
    const Eigen::Vector3d d = path[i] - path[i - 2];
    return std::atan2(-d.y(), d.z());
  };
  EXPECT_NEAR(heading_rad(4000), bend_rad(1, motion.insertion_mm[4000]), 5e-4);
  const double before = settled + (1 - settled) * std::exp(-per_mm * 40);
  const double after = 1 - (1 - before) * std::exp(-3.0 / 2);
  const double further_mm = motion.insertion_mm[10000] - motion.insertion_mm[7000];
  EXPECT_NEAR(heading_rad(10000) - heading_rad(4000),
              bend_rad(after, further_mm) + 0.005 * (motion.insertion_mm[7000] - motion.insertion_mm[4000]) * 0.7,
              1e-3);
  // Without the hold it would have bent further.
  EXPECT_GT(bend_rad(before, further_mm) - bend_rad(after, further_mm), 5e-3);
}

// Against two pinholes at a distance D from the insertion axis, D / (D - x) and D / (D - y), to second order.
TEST(Perspective, IsThatOfAPinhole) {
  constexpr double kDistance_mm = 400, kCentre_mm = 35;
  HiddenPhysics physics;
  physics.perspective_per_mm = 1 / kDistance_mm;
  physics.perspective_centre_mm = kCentre_mm;
  for (const Eigen::Vector3d& tip : {Eigen::Vector3d(12, -15, 70), Eigen::Vector3d(-9, 4, 20)}) {
    const Eigen::Vector3d seen = view({tip, tip}, {0}, physics).col(0);
    const double stretch = kDistance_mm / (kDistance_mm - tip.x());
    const double second = 1.1 * std::pow(tip.head<2>().cwiseAbs().maxCoeff() / kDistance_mm, 2);
    EXPECT_NEAR(seen.x(), kDistance_mm / (kDistance_mm - tip.y()) * tip.x(), second * std::abs(tip.x()));
    EXPECT_NEAR(seen.y(), stretch * tip.y(), second * std::abs(tip.y()));
    EXPECT_NEAR(seen.z(), kCentre_mm + stretch * (tip.z() - kCentre_mm), second * std::abs(tip.z() - kCentre_mm));
    EXPECT_GT(std::abs(seen.z() - tip.z()), 0.3);
  }
  const Eigen::Vector3d on_axis(0, -15, 70);
  EXPECT_LT((view({on_axis, on_axis}, {0}, physics).col(0) - on_axis).norm(), 1e-12);
}

// An oscillator at rest that gets a kick: x = (kick / omega_d) exp(-zeta omega t) sin(omega_d t).
TEST(StandSway, RingsAfterAStartAndDiesAway) {
  HiddenPhysics physics;
  physics.sway_mm = 0.5;
  physics.sway_hz = 2;
  TipPath path;
  std::vector<double> times_s;
  constexpr double kStart_s = 1, kSpeed_mm_s = 20;
  for (int i = 0; i <= 20000; ++i) path.emplace_back(0.1, -0.2, kSpeed_mm_s * std::max(0.0, kStep_s * i - kStart_s));
  for (int i = 0; i < 600; ++i) times_s.push_back(i / 30.0);
  const Eigen::Matrix3Xd seen = view(path, times_s, physics), bare = view(path, times_s, {});
  const double omega = 2 * std::numbers::pi * 2, damped = omega * std::sqrt(1 - 0.05 * 0.05);
  for (Eigen::Index i = 0; i < seen.cols(); ++i) {
    const double t = times_s[static_cast<std::size_t>(i)] - kStart_s;
    const double sway_mm =
        t > 0 ? 0.5 * kSpeed_mm_s / 10 * omega / damped * std::exp(-0.05 * omega * t) * std::sin(damped * t) : 0;
    EXPECT_NEAR(seen(2, i) - bare(2, i), sway_mm, 0.015);
    EXPECT_EQ(seen(0, i), bare(0, i));
    EXPECT_EQ(seen(1, i), bare(1, i));
  }
  EXPECT_GT((seen - bare).row(2).maxCoeff(), 0.85);
  EXPECT_LT(std::abs(seen(2, 599) - bare(2, 599)), 1e-4);
}

}  // namespace
}  // namespace bevel::proof
