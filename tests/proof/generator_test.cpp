// The plant of the blind trial against closed forms, and against the SE(3) model with which it shares no code.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "model/kinematics.hpp"
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
  const AxisMotion motion = motion_of({{3, 12, 0}, {0.5, 0, 3}, {1.5, 9, -2}, {0.5, -8, 0}, {1, 9, 0}, {0.5, 0, 0}});
  const std::vector<AxisMotion> motions(kRecordings, motion);
  const BaseNeedle needle;
  const TipPath bare = travel(needle, motion, {}, {}, 0);
  std::vector<double> times_s;
  for (int i = 0; i < 140; ++i) times_s.push_back(0.05 * i);
  const Eigen::Matrix3Xd bare_view = view(bare, times_s, {});
  for (const EffectKind& kind : catalogue()) {
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
