// SPDX-License-Identifier: MIT
// The plant of the blind trial against closed forms, and against the SE(3) model with which it shares no code.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include <bevel/model/kinematics.hpp>
#include "proof/needle_path.hpp"

namespace bevel::proof {
namespace {

AxisMotion motion_of(std::vector<Segment> segments) { return follow({"test", std::move(segments)}); }

TEST(NeedlePath, IsACircleWithoutSlip) {
  const BaseNeedle bicycle{0.005, 22, 0, 0};
  const AxisMotion motion = motion_of({{6, 12, 0}, {0.3, 0, 0}});
  const TipPath path = travel(bicycle, motion, {}, {}, 0);
  for (std::size_t i = 0; i < path.size(); i += 500) {
    const double angle = bicycle.curvature_per_mm * motion.insertion_mm[i];
    EXPECT_NEAR(path[i].x(), 0, 1e-9);
    EXPECT_NEAR(path[i].y(), -(1 - std::cos(angle)) / bicycle.curvature_per_mm, 1e-5);
    EXPECT_NEAR(path[i].z(), std::sin(angle) / bicycle.curvature_per_mm, 1e-5);
  }
}

TEST(NeedlePath, AgreesWithTheModelOnSE3WhileTurning) {
  const BaseNeedle needle{0.0047, 22, 0.3, 0.1};
  const AxisMotion motion =
      motion_of({{2, 10, 0}, {1, 0, 3}, {2, 9, 0}, {2, 8, -2.5}, {1, -10, 0}, {1, 0, 2}, {2, 10, 6}, {0.3, 0, 0}});
  for (const double other_slip : {0.0, 1.0}) {
    HiddenPhysics physics;
    physics.other_slip = other_slip;
    const TipPath path = travel(needle, motion, physics, {}, 0);
    model::Pose pose;
    model::SlipParameters slip{needle.lambda1_per_rad, needle.lambda2, needle.wheelbase_mm,
                               other_slip != 0.0 ? model::SlipDirection::bevel_plane : model::SlipDirection::isotropic,
                               model::FrontWheel::published};
    double largest_mm = 0;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const model::StepInput input{motion.insertion_mm[i] - motion.insertion_mm[i - 1],
                                   motion.rotation_rad[i] - motion.rotation_rad[i - 1],
                                   {needle.curvature_per_mm, 0}};
      ASSERT_TRUE(model::step(pose, input, slip));
      largest_mm = std::max(largest_mm, (pose.p_mm - path[i]).norm());
    }
    EXPECT_LT(largest_mm, 2e-4) << (other_slip != 0.0 ? "bevel-plane" : "isotropic");
  }
}

TEST(NeedlePath, EffectsOfNoSizeChangeNothing) {
  Random random(3);
  const AxisMotion motion = motion_of({{3, 12, 0}, {0.5, 0, 6}, {1.5, 9, -2}, {0.5, -8, 0}, {1, 9, 0}, {0.5, 0, 0}});
  const std::vector<AxisMotion> motions(kRecordings, motion);
  const BaseNeedle needle;
  const TipPath bare = travel(needle, motion, {}, {}, 0);
  std::vector<double> times_s;
  for (int i = 0; i < 140; ++i) times_s.push_back(0.05 * i);
  const Eigen::Matrix3Xd bare_view = view(bare, times_s, {});
  std::vector<EffectKind> kinds = catalogue(1);
  kinds.insert(kinds.end(), catalogue().begin(), catalogue().end());
  for (const EffectKind& kind : kinds) {
    if (std::string(kind.name) == "slip_direction") continue;  // has no size
    const ConcealedEffect effect = draw_effect(kind, random, motions);
    const HiddenPhysics full = physics_of({effect}, 1.0);
    const HiddenPhysics none = physics_of({scaled(effect, 0.0)}, 1.0);
    EXPECT_EQ(view(travel(needle, motion, none, {}, 0), times_s, none), bare_view) << kind.name;
    // ... and of full size they change something in some recording.
    double change_mm = 0;
    for (int recording = 0; recording < kRecordings; ++recording)
      change_mm = std::max(
          change_mm,
          (view(travel(needle, motion, full, {}, recording), times_s, full) - bare_view).cwiseAbs().maxCoeff());
    EXPECT_GT(change_mm, 0.01) << kind.name;
  }
}

// A shaft under uniform friction lags lag_at_100mm (L / 100)^2, and its tip stands still for twice that after a
// reversal: Reed, Okamura and Cowan 2009.
TEST(ShaftChain, LagsAsAContinuousShaft) {
  constexpr double kLag = 0.6;
  for (const double inserted_mm : {23.0, 60.0, 87.5}) {
    ShaftChain chain(kLag, 6.0, 150.0);
    const double lag = kLag * std::pow(inserted_mm / 100, 2);
    double tip = 0;
    for (int i = 0; i <= 4000; ++i) tip = chain.follow(1e-3 * i, inserted_mm);
    EXPECT_NEAR(4.0 - tip, lag, 0.02 * kLag) << inserted_mm;
    const double held = tip;
    double back = 4.0;
    while (std::abs(chain.follow(back, inserted_mm) - held) < 1e-3) back -= 1e-3;
    EXPECT_NEAR(4.0 - back, 2 * lag, 0.05 * kLag) << inserted_mm;
  }
}

TEST(LooseGear, OpensItsWholeWidthOnReversal) {
  for (const double give : {0.0, 0.05}) {
    LooseGear gear(0.4, give);
    double out = 0;
    for (int i = 0; i <= 2000; ++i) out = gear.follow(1e-3 * i);
    EXPECT_NEAR(2.0 - out, 0.2, 3e-3);
    for (int i = 2000; i >= 1000; --i) out = gear.follow(1e-3 * i);
    EXPECT_NEAR(out - 1.0, 0.2, 3e-3);
  }
}

TEST(DriveTrain, MembraneHoldsTheTipByItsIndentationThenLetsGo) {
  HiddenPhysics physics;
  physics.puncture_depth_mm = 10;
  physics.indentation_mm = 3;
  physics.departure = 0;
  DriveTrain drive(physics, {}, 0);
  double depth_mm = 0;
  double largest_lag_mm = 0;
  double depth_of_lag_mm = 0;
  for (int i = 0; i <= 3000; ++i) {
    depth_mm = drive.step(kStep_s * i, 0.01 * i, 0, depth_mm).advance_mm;
    if (0.01 * i - depth_mm > largest_lag_mm) {
      largest_lag_mm = 0.01 * i - depth_mm;
      depth_of_lag_mm = depth_mm;
    }
  }
  EXPECT_NEAR(largest_lag_mm, 3.0, 0.05);
  EXPECT_NEAR(depth_of_lag_mm, 10.0, 0.1);
  EXPECT_NEAR(depth_mm, 30.0, 1e-6);
}

TEST(DriveTrain, StickSlipHoldsTheTipForAJumpThenLetsItGo) {
  HiddenPhysics physics;
  physics.stick_slip_mm = 1.6;
  for (const double departure : {0.0, 1.0}) {
    physics.departure = departure;
    DriveTrain drive(physics, {}, 0);
    double tip_mm = 0;
    double largest_lag_mm = 0;
    int held = 0;
    for (int i = 0; i <= 4000; ++i) {
      const double before_mm = tip_mm;
      tip_mm = drive.step(kStep_s * i, 0.01 * i, 0, 0).advance_mm;
      largest_lag_mm = std::max(largest_lag_mm, 0.01 * i - tip_mm);
      held += std::abs(tip_mm - before_mm) < 1e-4;
    }
    EXPECT_NEAR(largest_lag_mm, 1.6, 0.02);
    EXPECT_NEAR(tip_mm, 1.6 * std::floor(40.0 / 1.6 - 1e-9), 0.05)
        << departure;  // as many jumps, however long they take
    EXPECT_GT(held, departure > 0 ? 2800 : 3900);
    // Drawn back it holds for a jump and, with friction while it slides, for twice that much more.
    const double from_mm = tip_mm;
    double base_mm = 40.0;
    for (int i = 4001; std::abs(tip_mm - from_mm) < 0.2; ++i) {
      base_mm -= 0.01;
      tip_mm = drive.step(kStep_s * i, base_mm, 0, 0).advance_mm;
    }
    EXPECT_NEAR(from_mm - base_mm, 1.6 * (1 + 0.3 * departure), 0.03);
  }
}

// Two Kelvin bodies: a shaft at rest has only the slow one left after a while, and e times less of it every 4 s.
TEST(DriveTrain, AxialCreepRecoversWithTwoTimeConstants) {
  HiddenPhysics physics;
  physics.creep_at_100mm_mm = 4;
  DriveTrain drive(physics, {}, 0);
  std::vector<double> lag_mm;
  for (int i = 0; i <= 20000; ++i) {
    const double base_mm = std::min(0.01 * i, 60.0);
    lag_mm.push_back(base_mm - drive.step(kStep_s * i, base_mm, 0, 0).advance_mm);
  }
  const double moving_mm = lag_mm[6000];
  EXPECT_GT(moving_mm, 0.5 * 4 * 0.6);  // the quick one is nearly there
  EXPECT_LT(moving_mm, 4 * 0.6);
  EXPECT_LT(lag_mm[7000], 0.75 * moving_mm);  // and gone a second after the stop
  EXPECT_NEAR(lag_mm[14000] / lag_mm[10000], std::exp(-1.0), 0.01);
}

TEST(NeedlePath, WindingStraightensByTheNetTurn) {
  const BaseNeedle bicycle{0.005, 22, 0, 0};
  HiddenPhysics physics;
  physics.winding_per_rad = 0.1;
  for (const double back : {0.0, -3.0}) {
    const AxisMotion motion = motion_of({{1, 0, 5}, {1, 0, back}, {5, 12, 0}, {0.3, 0, 0}});
    const TipPath path = travel(bicycle, motion, physics, {}, 0);
    const double turned = motion.rotation_rad.back();
    EXPECT_NEAR(turned, 5 + back, 0.4);
    const double k = 0.005 / (1 + 0.1 * turned);
    const double angle = k * motion.insertion_mm.back();
    EXPECT_NEAR(path.back().head<2>().norm(), (1 - std::cos(angle)) / k, 1e-3);
  }
}

// y'' = -k (1 + g y) for a tip that leans little, toward the stiffer side: y = -(1 - cos(sqrt(k g) s)) / g.
TEST(NeedlePath, SideGradientChangesCurvatureAcross) {
  const BaseNeedle bicycle{0.002, 22, 0, 0};
  HiddenPhysics physics;
  physics.side_per_mm = 0.06;
  const AxisMotion motion = motion_of({{5, 10, 0}, {0.3, 0, 0}});
  const double s = motion.insertion_mm.back();
  const double straight = -0.5 * 0.002 * s * s;
  physics.side_direction_rad = std::numbers::pi / 2;
  const double toward_mm = travel(bicycle, motion, physics, {}, 0).back().y();
  EXPECT_NEAR(toward_mm, -(1 - std::cos(std::sqrt(0.002 * 0.06) * s)) / 0.06, 0.02);
  EXPECT_GT(toward_mm, straight);
  physics.side_direction_rad = 0;  // across the plane in which it bends
  EXPECT_NEAR(travel(bicycle, motion, physics, {}, 0).back().y(), travel(bicycle, motion, {}, {}, 0).back().y(), 1e-6);
}

TEST(Catalogue, EditionsDifferInStickSlipAndWhatCameForIt) {
  const auto names = [](int edition, bool listed) {
    std::vector<std::string> all;
    for (const EffectKind& kind : catalogue(edition))
      if (kind.listed == listed) all.emplace_back(kind.name);
    return all;
  };
  EXPECT_THAT(names(1, false), testing::Contains("stick_slip"));
  EXPECT_THAT(names(1, true), testing::Not(testing::Contains("stick_slip")));
  EXPECT_THAT(names(2, true), testing::Contains("stick_slip"));
  EXPECT_THAT(names(2, false), testing::IsSupersetOf({"winding", "side_gradient", "axial_creep"}));
  EXPECT_THAT(names(2, false), testing::Not(testing::Contains("stick_slip")));
  // The same word for two laws, told apart by whether it is on the list.
  const HiddenPhysics first = physics_of({{"unknown", "stick_slip", {{"jump_mm", 1.5}}, {}}}, 1);
  const HiddenPhysics second = physics_of({{"stick_slip", "", {{"jump_mm", 1.5}}, {}}}, 1);
  EXPECT_EQ(first.first_stick_slip_mm, 1.5);
  EXPECT_EQ(first.stick_slip_mm, 0);
  EXPECT_EQ(second.stick_slip_mm, 1.5);
  EXPECT_EQ(second.first_stick_slip_mm, 0);
}

TEST(Script, MotionStaysWithinTravelAndAcceleration) {
  for (const bool rich : {true, false})
    for (int seed = 0; seed < 20; ++seed) {
      Random random(static_cast<std::uint64_t>(seed));
      const auto scripts = draw_scripts(random, rich);
      ASSERT_EQ(scripts.size(), 8U);
      for (const Script& script : scripts) {
        const AxisMotion motion = follow(script);
        EXPECT_GT(motion.duration_s(), 3.0) << script.kind;
        EXPECT_LT(motion.duration_s(), 18.0) << script.kind;
        for (std::size_t i = 1; i < motion.size(); ++i) {
          ASSERT_GE(motion.insertion_mm[i], -0.5) << script.kind;
          ASSERT_LE(motion.insertion_mm[i], 95.0) << script.kind;
          ASSERT_LE(std::abs(motion.insertion_rate_mm_s[i] - motion.insertion_rate_mm_s[i - 1]), 0.181);
        }
      }
    }
}

}  // namespace
}  // namespace bevel::proof
