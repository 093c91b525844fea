// SPDX-License-Identifier: MIT
// The filter with a stiff shaft against the beam itself, which shares nothing with it.
#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <iostream>
#include <random>

#include <bevel/estimator/error_state.hpp>
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/model/shaft_end.hpp>
#include <bevel/rig/plant/plant.hpp>

namespace bevel::estimator {
namespace {

model::BeamPlantConfig beam_of(double modulus_kPa, double force_N) {
  model::BeamPlantConfig beam;
  beam.foundation_modulus_kPa = modulus_kPa;
  beam.bevel_force_N = force_N;
  beam.max_depth_mm = 150;
  return beam;
}
double bending_of(const model::BeamPlantConfig& beam) {
  return std::pow(4 * beam.bending_stiffness_N_mm2 / (1e-3 * beam.foundation_modulus_kPa), 0.25);
}
EstimatorConfig config_for(const model::BeamPlantConfig& beam) {
  EstimatorConfig config;
  config.prior.needle = rig::bicycle_of(beam);
  config.prior.curvature_sd_per_mm = 0.2 * config.prior.needle.curvature_per_mm;
  config.prior.lambda1_sd_per_rad = config.prior.lambda2_sd = 0;
  config.prior.bending_mm = bending_of(beam);
  config.prior.bending_sd_mm = 0.2 * config.prior.bending_mm;
  config.prior.guide_mm = beam.guide_gap_mm;
  return config;
}

struct Leg {
  double insertion_mm, rotation_rad;
};
// In, a half turn at rest, in while turning, back a little, in.
const std::vector<Leg> kLegs{{40, 0}, {0, 3.14}, {30, 0}, {20, 2.0}, {0, -1.5}, {20, 0}};

template <class Each>
void follow(rig::Plant& plant, Each each) {
  for (const Leg& leg : kLegs) {
    const int steps =
        std::max(1, static_cast<int>(std::max(leg.insertion_mm / 0.05, std::abs(leg.rotation_rad) / 0.02)));
    for (int i = 0; i < steps; ++i) {
      plant.advance(leg.insertion_mm / steps, leg.rotation_rad / steps, 0.01);
      each(leg.insertion_mm / steps, leg.rotation_rad / steps);
    }
  }
}

TEST(StiffShaft, PredictsTheBeamFromTheAxesAlone) {
  for (const auto& [modulus, force] : {std::pair{100.0, 0.3}, {100.0, 1.0}, {50.0, 1.0}, {20.0, 0.5}, {5.0, 0.5}}) {
    const model::BeamPlantConfig beam = beam_of(modulus, force);
    rig::BeamNeedle plant(beam);
    const NeedleFilter filter(config_for(beam));
    FilterState state = filter.initial();
    const auto far_mm = [&] { return (filter.tip_pose(state).p_mm - plant.tip().p_mm).norm(); };
    double largest_mm = 0, heading_rad = 0;
    follow(plant, [&](double insertion_mm, double rotation_rad) {
      filter.predict(state, insertion_mm, rotation_rad);
      largest_mm = std::max(largest_mm, far_mm());
    });
    heading_rad = (filter.tip_pose(state).R.col(2) - plant.tip().R.col(2)).norm();
    const double bends_mm = plant.tip().p_mm.head<2>().norm();
    std::cout << modulus << " kPa, " << force << " N: largest error " << largest_mm << " mm, at the end " << far_mm()
              << " mm of " << bends_mm << ", heading " << heading_rad << " rad\n";
    // The needle has no force before it touches, the beam has: what it is bent by then, and its fifth.
    EXPECT_LT(largest_mm, 0.2) << modulus;
    EXPECT_LT(heading_rad, 0.01) << modulus;
  }
}

TEST(StiffShaft, DerivativesByEachOfTenAgreeWithPerturbation) {
  EstimatorConfig config = config_for(beam_of(30, 0.8));
  config.process = {0, 0, 0, 0, 0, 0, 0};
  const NeedleFilter filter(config);
  std::mt19937_64 rng(46);
  std::normal_distribution<double> normal(0, 1);
  for (int trial = 0; trial < 50; ++trial) {
    FilterState state = filter.initial();
    Error<10> off;
    // Deep: that the end yields less near the entry is not followed by the derivatives.
    off << 10 * normal(rng), 10 * normal(rng), 600, 0.1 * normal(rng), 0.1 * normal(rng), normal(rng),
        2e-4 * normal(rng), 0, 0, 4 * normal(rng);
    move<10>(state, off);
    const auto moved = [&](double step, int column) {
      FilterState s = state;
      move<10>(s, step * Error<10>::Unit(column));
      filter.predict(s, 1.3, 0.12);
      return s;
    };
    for (const int column : {0, 1, 2, 3, 4, 5, 6, 9}) {
      const double step = column == 6 ? 1e-6 : column == 9 ? 1e-3 : 1e-5;
      const FilterState middle = moved(0, column);
      const Error<10> numeric =
          (difference<10>(middle, moved(step, column)) - difference<10>(middle, moved(-step, column))) / (2 * step);
      FilterState s = state;
      set_covariance<10>(s, Covariance<10>(Error<10>::Unit(column).asDiagonal()));
      filter.predict(s, 1.3, 0.12);
      const Covariance<10> square = numeric * numeric.transpose();
      EXPECT_LT((covariance_of<10>(s) - square).norm(), 1e-5 * (1 + square.norm())) << trial << ", " << column;
    }
  }
}

TEST(StiffShaft, OneThatBendsOverNoLengthIsTheBicycle) {
  const EstimatorConfig plain = [] {
    EstimatorConfig config;
    config.prior.needle.lambda1_per_rad = config.prior.needle.lambda2 = 0;
    return config;
  }();
  EstimatorConfig stiff = plain;
  stiff.prior.bending_mm = 1e-3;
  stiff.prior.guide_mm = 1;
  const NeedleFilter one(plain), other(stiff);
  FilterState a = one.initial(), b = other.initial();
  for (int i = 0; i < 1000; ++i) {
    one.predict(a, 0.1, 0.005);
    other.predict(b, 0.1, 0.005);
  }
  EXPECT_LT((a.pose.p_mm - other.tip_pose(b).p_mm).norm(), 1e-3);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-2 * a.covariance.norm());
}

// Forty insertions of beams of which the filter is told a curvature and a bending length off by 20 % (standard
// deviation), two cameras.
TEST(StiffShaft, KnowsWhatItKnowsOfABeamItIsToldOnlyRoughly) {
  constexpr unsigned kSeed = 47;
  constexpr int kRuns = 40;
  std::mt19937_64 rng(kSeed);
  std::normal_distribution<double> normal(0, 1);
  double pose_nees = 0, position_nees = 0, parameter_nees = 0, nis = 0, worst_mm = 0, sd_share = 0;
  int readings = 0, ranks = 0, rejected = 0;
  for (int run = 0; run < kRuns; ++run) {
    model::BeamPlantConfig beam = beam_of(std::exp(std::uniform_real_distribution<>(std::log(5), std::log(100))(rng)),
                                          std::uniform_real_distribution<>(0.3, 1)(rng));
    EstimatorConfig config = config_for(beam);
    Prior& prior = config.prior;
    const double told_k = std::clamp(1 + 0.2 * normal(rng), 0.5, 1.5),
                 told_b = std::clamp(1 + 0.2 * normal(rng), 0.5, 1.5);
    prior.needle.curvature_per_mm *= told_k, prior.curvature_sd_per_mm *= told_k;
    prior.bending_mm *= told_b, prior.bending_sd_mm *= told_b;
    rig::BeamNeedle plant(beam);
    NeedleFilter filter(config);
    FilterState state = filter.initial();
    int step = 0;
    follow(plant, [&](double insertion_mm, double rotation_rad) {
      filter.predict(state, insertion_mm, rotation_rad);
      if (++step % 3 != 0) return;
      model::TipMeasurement m;
      m.camera = step / 3 % 2;
      m.utime = 1 + step;
      const Eigen::Vector3d sees = m.camera == 0 ? Eigen::Vector3d(0, 1, 1) : Eigen::Vector3d(1, 0, 1);
      m.information_per_mm2 = (sees / 0.04).asDiagonal();
      for (int i = 0; i < 3; ++i) m.position_mm[i] = sees[i] * (plant.tip().p_mm[i] + 0.2 * normal(rng));
      const Update update = filter.update(state, m);
      ++readings, ranks += update.rank, nis += update.mahalanobis2;
      if (!update.accepted) ++rejected;
    });
    const model::Vector6d error = model::log_se3(filter.tip_pose(state).inverse() * plant.tip());
    worst_mm = std::max(worst_mm, error.head<3>().norm());
    pose_nees += error.dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / 6 / kRuns;
    position_nees +=
        error.head<3>().dot(state.covariance.topLeftCorner<3, 3>().ldlt().solve(error.head<3>())) / 3 / kRuns;
    const Eigen::Vector2d off(rig::bicycle_of(beam).curvature_per_mm - state.curvature_per_mm,
                              bending_of(beam) - state.bending_mm);
    Eigen::Matrix2d P;
    P << state.covariance(6, 6), state.tenth_covariance[6], state.tenth_covariance[6], state.tenth_variance;
    parameter_nees += off.dot(P.ldlt().solve(off)) / 2 / kRuns;
    sd_share += std::sqrt(state.tenth_variance) / bending_of(beam) / kRuns;
  }
  std::cout << "seed " << kSeed << ", " << kRuns << " insertions of beams: pose NEES/6 " << pose_nees
            << ", position NEES/3 " << position_nees << ", k and bending length NEES/2 " << parameter_nees << ", NIS "
            << nis / ranks << ", rejected " << rejected << " of " << readings << ", largest error of the tip "
            << worst_mm << " mm, bending length known to " << 100 * sd_share << " %\n";
  EXPECT_EQ(rejected, 0);
  EXPECT_LT(pose_nees, 1.5);
  EXPECT_NEAR(nis / ranks, 1, 0.05);
  EXPECT_LT(worst_mm, 0.3);
  EXPECT_LT(sd_share, 0.06);
}

}  // namespace
}  // namespace bevel::estimator
