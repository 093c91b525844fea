// SPDX-License-Identifier: MIT
// The beam plant's behaviour: signs, symmetry, closed form of the moving needle, memory, relaxation, wind-up, errors.
#include <bevel/model/beam/beam_plant.hpp>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <bevel/error.hpp>

namespace bevel::model {
namespace {

constexpr double kPi = std::numbers::pi;

Lateral lateral(const BeamPlant& plant) { return {plant.tip_position_mm().x(), plant.tip_position_mm().y()}; }

BeamPlant inserted(const BeamPlantConfig& config, double feed_mm, double feed_per_call_mm = 0.5) {
  BeamPlant plant(config);
  while (plant.fed_mm() < feed_mm - 1e-9) plant.advance(feed_per_call_mm, 0.0, feed_per_call_mm / 20.0);
  return plant;
}

TEST(BeamPlant, BendsTowardMinusYWithoutRoll) {
  const auto plant = inserted({}, 100.0);
  EXPECT_LT(plant.tip_position_mm().y(), -3.0);
  EXPECT_EQ(plant.tip_position_mm().x(), 0.0);
  EXPECT_LT(plant.tip_heading().y(), -0.05);
  EXPECT_NEAR(plant.tip_heading().norm(), 1.0, 1e-14);
  const Eigen::Matrix3d r = plant.tip_rotation();
  EXPECT_TRUE((r.transpose() * r).isIdentity(1e-12));
  EXPECT_TRUE(r.col(2).isApprox(plant.tip_heading(), 1e-12));
  EXPECT_NEAR(r.col(0).x(), 1.0, 1e-12);  // no roll: e1 stays
}

TEST(BeamPlant, WithoutBevelForceGoesStraight) {
  BeamPlantConfig config;
  config.bevel_force_N = 0.0;
  auto plant = inserted(config, 100.0);
  plant.advance(10.0, 3.0, 0.5);
  EXPECT_EQ(lateral(plant), Lateral{});
  EXPECT_DOUBLE_EQ(plant.tip_position_mm().z(), 110.0);
}

TEST(BeamPlant, RollingTheProblemRollsThePath) {
  BeamPlantConfig config;
  config.relaxing_fraction = 0.3;
  config.windup_at_100mm_rad = 0.2;
  // To rounding, which the beam's stiff equations amplify by some 1e6.
  for (const double roll : {0.3, kPi / 2.0, 2.5, -1.9}) {
    BeamPlant plain(config);
    BeamPlant rolled(config);
    rolled.advance(0.0, roll, 0.0);  // outside the tissue the shaft does not wind up
    const Lateral turn = std::polar(1.0, roll);
    for (int i = 0; i < 200; ++i) {
      const double feed_mm = i < 120 ? 0.8 : -0.3;
      const double rotation_rad = i % 40 > 30 ? 0.15 : 0.0;
      plain.advance(feed_mm, rotation_rad, 0.04);
      rolled.advance(feed_mm, rotation_rad, 0.04);
      ASSERT_LT(std::abs(lateral(rolled) - turn * lateral(plain)), 1e-9);
      ASSERT_NEAR(rolled.tip_position_mm().z(), plain.tip_position_mm().z(), 1e-9);
    }
    EXPECT_GT(std::abs(lateral(plain)), 0.5);
  }
}

// Deep in uniform tissue the path has curvature F / (EI lambda) and the tip slips at the angle F / (2 EI lambda^2)
// beside its own tangent: derivation in beam_plant.hpp's terms, w = path + (curvature / (2 lambda^2)) exp(-lambda x)
// sin(lambda x), x from the tip.
TEST(BeamPlant, SteadySteeringHasTheClosedFormCurvatureAndSlip) {
  BeamPlantConfig config;
  config.foundation_modulus_kPa = 100.0;
  config.bevel_force_N = 0.2;
  config.feed_is_arc_length = false;
  config.max_depth_mm = 450.0;
  const double lambda = std::pow(0.1 / (4.0 * 1.6e4), 0.25);
  const double curvature = 0.2 / (1.6e4 * lambda);
  auto plant = inserted(config, 400.0);
  const double y0 = plant.tip_position_mm().y();
  plant.advance(10.0, 0.0, 0.0);
  const double y1 = plant.tip_position_mm().y();
  const double tangent = plant.tip_heading().y() / plant.tip_heading().z();
  plant.advance(10.0, 0.0, 0.0);
  const double y2 = plant.tip_position_mm().y();
  EXPECT_NEAR((2.0 * y1 - y0 - y2) / 100.0, curvature, 1e-3 * curvature);
  const double slip = 0.2 / (2.0 * 1.6e4 * lambda * lambda);
  EXPECT_NEAR(tangent - (y2 - y0) / 20.0, slip, 1e-2 * slip);
}

// Tissue has no direction of its own: deep down the path is the circle of the closed form, whichever way the needle has
// come to point.
TEST(BeamPlant, ABentNeedleBendsOnAsItBegan) {
  BeamPlantConfig config;
  config.foundation_modulus_kPa = 100.0;
  config.bevel_force_N = 2.0;
  config.max_depth_mm = 450.0;
  const double lambda = std::pow(0.1 / (4.0 * 1.6e4), 0.25);
  const double curvature = 2.0 / (1.6e4 * lambda);
  BeamPlant plant(config);
  std::vector<Eigen::Vector3d> tips;
  for (int i = 0; i < 44; ++i) {
    plant.advance(10.0, 0.0, 0.0);
    tips.push_back(plant.tip_position_mm());
  }
  for (std::size_t i = 20; i + 1 < tips.size(); ++i) {
    const Eigen::Vector3d a = tips[i] - tips[i - 1], b = tips[i + 1] - tips[i];
    const double through_three = 2.0 * a.cross(b).norm() / (a.norm() * b.norm() * (a + b).norm());
    EXPECT_NEAR(through_three, curvature, 1e-3 * curvature) << 10 * (i + 1) << " mm";
  }
  EXPECT_GT(plant.tip_heading().y() * plant.tip_heading().y(), 0.9);  // it has come to point far aside
}

TEST(BeamPlant, FeedIsArcLengthOfTheShaft) {
  BeamPlantConfig config;
  config.foundation_modulus_kPa = 2.0;
  config.bevel_force_N = 1.0;
  const auto plant = inserted(config, 130.0);
  const auto line = plant.shaft_polyline_mm(2000);
  double arc_mm = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i) arc_mm += (line[i] - line[i - 1]).norm();
  EXPECT_NEAR(arc_mm, config.guide_gap_mm + 130.0, 0.05);
  EXPECT_LT(plant.tip_position_mm().z(), 128.0);
  EXPECT_TRUE(line.back().isApprox(plant.tip_position_mm()));
}

TEST(BeamPlant, SpinningGoesNearlyStraight) {
  BeamPlant plant({});
  for (int i = 0; i < 200; ++i) plant.advance(0.5, 2.0 * kPi / 20.0, 0.025);  // a turn every 10 mm
  EXPECT_LT(std::abs(lateral(plant)), 0.25 * std::abs(lateral(inserted({}, 100.0))));
}

TEST(BeamPlant, HoldingElasticTissueChangesNothing) {
  BeamPlantConfig config;
  config.feed_is_arc_length = false;
  auto plant = inserted(config, 100.0);
  const Lateral before = lateral(plant);
  for (int i = 0; i < 50; ++i) plant.advance(0.0, 0.0, 1.0);
  EXPECT_LT(std::abs(lateral(plant) - before), 1e-3);
}

TEST(BeamPlant, TurningAtRestSwingsTheTipAndBack) {
  BeamPlantConfig config;
  config.feed_is_arc_length = false;
  auto plant = inserted(config, 100.0);
  plant.advance(0.0, 0.0, 0.0);
  const Lateral before = lateral(plant);
  plant.advance(0.0, kPi, 1.0);
  // Long shaft: the end compliance is Hetenyi's 2 lambda / k, and the force has turned by 2 F.
  const double lambda = std::pow(0.02 / (4.0 * 1.6e4), 0.25);
  EXPECT_NEAR((lateral(plant) - before).imag(), 2.0 * 0.5 * 2.0 * lambda / 0.02, 0.05);
  plant.advance(0.0, -kPi, 1.0);
  EXPECT_LT(std::abs(lateral(plant) - before), 1e-9);
}

TEST(BeamPlant, RetractsAlongItsCutAndReentersIt) {
  BeamPlantConfig config;
  config.foundation_modulus_kPa = 100.0;
  config.bevel_force_N = 1.0;
  config.feed_is_arc_length = false;
  auto plant = inserted(config, 120.0);
  const CutPath cut = plant.cut_path();
  std::vector<Lateral> back;
  const auto cut_at = [&](double z_mm) { return cut.anchor_mm(static_cast<std::size_t>(z_mm / 0.5)); };
  for (int i = 11; i >= 5; --i) {
    const double z_mm = 10.0 * i;
    plant.advance(z_mm - plant.fed_mm(), kPi / 7.0,
                  0.5);  // rolled on the way: behind the front there is no bevel force
    EXPECT_EQ(plant.bevel_force_N(), 0.0);
    EXPECT_LT(std::abs(lateral(plant) - cut_at(z_mm)), 0.3 * std::abs(cut_at(z_mm)) + 0.1) << z_mm;
    back.push_back(lateral(plant));
  }
  for (int i = 5; i <= 11; ++i) {
    const double z_mm = 10.0 * i;
    plant.advance(z_mm - plant.fed_mm(), 0.0, 0.5);
    EXPECT_LT(std::abs(lateral(plant) - back.back()), 1e-9) << z_mm;
    back.pop_back();
  }
  EXPECT_EQ(plant.cut_path().size(), cut.size());
  plant.advance(-125.0 - (plant.fed_mm() - 110.0), 0.0, 1.0);  // fully out, to the guide's mouth
  EXPECT_LT(std::abs(lateral(plant)), 1e-9);
}

// Every mode of a loaded viscous foundation creeps at a rate between (1 - r) / T (the tissue alone carries the load)
// and 1 / T (the shaft holds the displacement). From rest, the answer at the tip to a change of the force at the tip is
// a sum of modes with positive weights (w_i(L)^2), so its decay has to lie in between. Turning by pi is such a change.
TEST(BeamPlant, RelaxesAtStopsWithinTheRatesTheSpringsAllow) {
  for (const double time_s : {0.5, 4.0}) {
    BeamPlantConfig config;
    config.relaxing_fraction = 0.5;
    config.relaxation_time_s = time_s;
    config.feed_is_arc_length = false;
    auto plant = inserted(config, 100.0);
    const auto wait = [&](double times) {
      plant.advance(0.0, 0.0, times * time_s);
      return lateral(plant).imag();
    };
    const double moving = lateral(plant).imag();
    const double at_rest = wait(1e6);
    EXPECT_GT(std::abs(at_rest - moving), 0.02);
    EXPECT_NEAR(wait(1.0), at_rest, 1e-6);
    plant.advance(0.0, kPi, 0.0);
    const double y0 = wait(0.0);
    const double y1 = wait(1.0);
    const double y2 = wait(1.0);
    const double y3 = wait(1.0);
    EXPECT_GT(std::abs(y1 - y0), 0.02);
    for (const double ratio : {(y2 - y1) / (y1 - y0), (y3 - y2) / (y2 - y1)}) {
      EXPECT_GT(ratio, std::exp(-1.0));
      EXPECT_LT(ratio, std::exp(-0.5));
    }
  }
}

TEST(BeamPlant, RelaxationScalesWithItsTime) {
  const auto tip = [](double time_s) {
    BeamPlantConfig config;
    config.relaxing_fraction = 0.5;
    config.relaxation_time_s = time_s;
    BeamPlant plant(config);
    for (int i = 0; i < 160; ++i) plant.advance(0.5, 0.01, 0.1 * time_s);
    return lateral(plant);
  };
  EXPECT_LT(std::abs(tip(1.0) - tip(8.0)), 1e-12);
}

TEST(BeamPlant, WindupDelaysTheTipsRoll) {
  BeamPlantConfig config;
  config.windup_at_100mm_rad = 0.5;
  config.bevel_force_N = 0.0;
  auto plant = inserted(config, 100.0);
  plant.advance(0.0, 0.4, 0.1);
  EXPECT_EQ(plant.tip_roll_rad(), 0.0);
  plant.advance(0.0, 1.0, 0.1);
  EXPECT_NEAR(plant.tip_roll_rad(), 0.9, 1e-9);
  EXPECT_NEAR(plant.base_roll_rad(), 1.4, 1e-12);
  plant.advance(0.0, -0.9, 0.1);
  EXPECT_NEAR(plant.tip_roll_rad(), 0.9, 1e-9);
}

TEST(BeamPlant, BadInputIsNamedAndChangesNothing) {
  using ::testing::HasSubstr;
  using ::testing::ThrowsMessage;
  const auto with = [](double BeamPlantConfig::*field, double value) {
    BeamPlantConfig config;
    config.*field = value;
    return config;
  };
  EXPECT_THAT([&] { BeamPlant(with(&BeamPlantConfig::relaxing_fraction, 1.0)); },
              ThrowsMessage<bevel::ArgumentError>(HasSubstr("relaxing_fraction = 1, allowed: 0 to below 1")));
  EXPECT_THAT([&] { BeamPlant(with(&BeamPlantConfig::element_length_mm, 0.0)); },
              ThrowsMessage<bevel::ArgumentError>(HasSubstr("element_length_mm")));
  EXPECT_THAT([&] { BeamPlant(with(&BeamPlantConfig::bevel_force_N, -0.5)); },
              ThrowsMessage<bevel::ArgumentError>(HasSubstr("bevel_force_N")));
  auto plant = inserted({}, 50.0);
  const Eigen::Vector3d before = plant.tip_position_mm();
  EXPECT_THROW(plant.advance(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.1), bevel::ArgumentError);
  EXPECT_THROW(plant.advance(1.0, std::numeric_limits<double>::infinity(), 0.1), bevel::ArgumentError);
  EXPECT_THROW(plant.advance(1.0, 0.0, -0.1), bevel::ArgumentError);
  EXPECT_THAT([&] { plant.advance(151.0, 0.0, 0.1); },
              ThrowsMessage<bevel::DomainError>(HasSubstr("max_depth_mm = 200")));
  EXPECT_EQ(plant.tip_position_mm(), before);
  EXPECT_EQ(plant.fed_mm(), 50.0);
}

}  // namespace
}  // namespace bevel::model
