// SPDX-License-Identifier: MIT
// The slowly known states of the rig: wind-up against the beam and the library's effect, latencies of cameras
// against readings that are late.
#include <gtest/gtest.h>

#include <array>
#include <boost/math/distributions/chi_squared.hpp>
#include <iostream>

#include <bevel/rig/plant/plant.hpp>
#include "tests/estimator/play.hpp"

namespace bevel::estimator {
namespace {

using testing::agar_config;

EstimatorConfig with(const NuisancePrior& nuisance, bool coloured = false) {
  EstimatorConfig config = agar_config();
  config.process = {0, 0, 0, 0, 0, 0, 0};
  config.nuisance = nuisance;
  if (coloured) config.reading = {.correlated_share = 0.5, .correlation_mm = 2};
  return config;
}

// A needle somewhere, wound up as far as it goes, whose cameras are late.
FilterState somewhere(const NeedleFilter& filter) {
  FilterState state = filter.initial();
  state.nuisance.mean << 0.3, 0.012, 0.02;
  for (int i = 0; i < 400; ++i) filter.predict(state, 0.2, 0.01, 0.01);
  return state;
}

void expect_turns_by_windup(const EstimatorConfig& config) {
  const NeedleFilter filter(config);
  const FilterState state = somewhere(filter);
  constexpr double kStep_rad = 1e-5;
  const auto turned_over = [&](double off_rad) {
    FilterState s = state;
    move<kAllStates>(s, off_rad * Error<kAllStates>::Unit(kFiltered<kAllStates> + kWindup));
    for (int i = 0; i < 100; ++i) filter.predict(s, 0.01, -0.02, 0.01);  // through its play to the other side
    return s;
  };
  const model::Vector6d numeric =
      model::log_se3(turned_over(-kStep_rad).pose.inverse() * turned_over(kStep_rad).pose) / (2 * kStep_rad);
  EXPECT_GT(std::abs(numeric[5]), 0.5) << "twice (80 / 100)^2, by a tip that turns late";
  FilterState s = state;
  set_covariance<kAllStates>(
      s, Covariance<kAllStates>(Error<kAllStates>::Unit(kFiltered<kAllStates> + kWindup).asDiagonal()));
  for (int i = 0; i < 100; ++i) filter.predict(s, 0.01, -0.02, 0.01);
  const model::Vector6d derivative = s.nuisance.with_state.col(kWindup).head<6>();
  EXPECT_LT((derivative - numeric).norm(), 2e-3 * numeric.norm()) << derivative.transpose() << "\n"
                                                                  << numeric.transpose();
  EXPECT_LT((s.covariance.topLeftCorner<6, 6>() - derivative * derivative.transpose()).norm(), 1e-9);
}

TEST(Nuisance, DerivativesByTheWindUpAgreeWithPerturbation) {
  EstimatorConfig config = with({.windup_sd_rad = 0.4});
  expect_turns_by_windup(config);
  config.through_channel = true;
  expect_turns_by_windup(config);
  config.prior.wheelbase_sd_mm = 3;
  expect_turns_by_windup(config);
  config.prior.wheelbase_sd_mm = 0;
  config.prior.bending_mm = 40, config.prior.bending_sd_mm = 8, config.prior.guide_mm = 15;
  config.prior.needle.lambda1_per_rad = config.prior.needle.lambda2 = 0;
  expect_turns_by_windup(config);
}

// Along one axis that is seen S = (n . h)^2 + variance, where all that is not known is one state; h by perturbation.
void expect_sees_each(const EstimatorConfig& config) {
  const NeedleFilter filter(config);
  const FilterState state = somewhere(filter);
  model::TipMeasurement m;
  m.utime = 1;
  const Eigen::Vector3d n = Eigen::Vector3d(0.3, -0.8, 0.5).normalized();
  for (const int camera : {0, 1})
    for (int i = 0; i < kNuisance; ++i) {
      m.camera = camera;
      m.information_per_mm2 = n * n.transpose() / 0.04;
      m.position_mm = filter.seen_position_mm(state) + Eigen::Vector3d(0.1, 0.1, 0.1);
      const auto innovation = [&](double off, double variance) {
        FilterState s = state;
        Covariance<kAllStates> P = Covariance<kAllStates>::Zero();
        P(kFiltered<kAllStates> + i, kFiltered<kAllStates> + i) = variance;
        set_covariance<kAllStates>(s, P);
        s.nuisance.mean[i] += off;
        return filter.update(s, m);
      };
      const double step = 1e-6;
      const double numeric = (innovation(step, 0).innovation[0] - innovation(-step, 0).innovation[0]) / (2 * step);
      const Update update = innovation(0, 1e-4);
      const double variance = update.innovation[0] * update.innovation[0] / update.mahalanobis2;
      EXPECT_NEAR(variance - 0.04 * (config.reading.correlated_share > 0 ? 0.5 : 1.0), 1e-4 * numeric * numeric,
                  1e-5 + 3e-2 * 1e-4 * numeric * numeric)
          << camera << ", " << i;
      const bool of_camera = i == latency_of(camera);
      EXPECT_EQ(std::abs(numeric) > 1e-3, of_camera) << camera << ", " << i << ": " << numeric;
    }
}

TEST(Nuisance, EachCameraSeesItsOwnLatencyByThePerturbedReading) {
  expect_sees_each(with({.windup_sd_rad = 0.4, .latency_sd_s = 0.02}));
  expect_sees_each(with({.windup_sd_rad = 0.4, .latency_sd_s = 0.02}, true));
}

TEST(Nuisance, OfNextToNoWidthIsThePlainFilter) {
  EstimatorConfig plain = agar_config(), held = agar_config();
  plain.relinearised_steps = 0;
  held.nuisance = {.windup_sd_rad = 1e-9, .latency_sd_s = 1e-9};
  std::mt19937_64 rng(5);
  testing::InsertionPlan plan;
  plan.cameras = 2;
  const auto drawn = testing::draw_insertion(plain.prior, plan, rng);
  NeedleEstimator one(plain), other(held);
  testing::play(one, drawn.data, 50'000);
  testing::play(other, drawn.data, 50'000);
  const std::int64_t end = drawn.data.actuators.back().utime;
  const FilterState a = one.estimate(end).state, b = other.estimate(end).state;
  EXPECT_LT((difference<9>(a, b).cwiseAbs2().cwiseQuotient(a.covariance.diagonal())).maxCoeff(), 1e-8);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-6 * a.covariance.norm());
}

// Where no width is given nothing of them is so much as looked at: a state in which they are not numbers moves as any.
TEST(Nuisance, OfNoWidthIsThePlainFilterBitForBit) {
  for (const double correlated_share : {0.0, 0.8})
    for (const double bending_mm : {0.0, 40.0}) {
      EstimatorConfig config = agar_config();
      config.reading = {.correlated_share = correlated_share, .correlation_mm = 2};
      config.through_channel = true;
      config.prior.bending_mm = bending_mm, config.prior.bending_sd_mm = 8;
      if (bending_mm > 0) config.prior.needle.lambda1_per_rad = config.prior.needle.lambda2 = 0;
      const NeedleFilter filter(config);
      FilterState plain = filter.initial(), spoilt = plain;
      const double nan = std::nan("");
      spoilt.nuisance.mean.setConstant(nan), spoilt.nuisance.covariance.setConstant(nan);
      spoilt.nuisance.with_state.setConstant(nan), spoilt.nuisance.with_shared.setConstant(nan);
      spoilt.nuisance.lag_rad = spoilt.nuisance.lag_by_windup = spoilt.nuisance.inserted_mm = nan;
      spoilt.nuisance.tip_velocity_mm_s.setConstant(nan);
      std::mt19937_64 rng(6);
      std::normal_distribution<double> normal(0, 0.2);
      int accepted = 0;
      for (int i = 0; i < 900; ++i) {
        const double mm = i > 600 ? -0.1 : 0.1;  // in, and back through the channel
        for (FilterState* state : {&plain, &spoilt}) filter.predict(*state, mm, 0.02 * std::sin(0.01 * i), 0.01);
        if (i % 3 != 0) continue;
        model::TipMeasurement m;
        m.camera = i / 3 % 2;
        m.utime = 1 + i;
        m.information_per_mm2 = Eigen::Vector3d(m.camera, 1 - m.camera, 1).asDiagonal().toDenseMatrix() / 0.04;
        m.position_mm = filter.seen_position_mm(plain) + Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
        accepted += filter.update(plain, m).accepted ? 1 : 0;
        filter.update(spoilt, m);
      }
      EXPECT_GT(accepted, 200);
      EXPECT_EQ(plain.pose.p_mm, spoilt.pose.p_mm);
      EXPECT_EQ(plain.pose.R, spoilt.pose.R);
      EXPECT_EQ(plain.curvature_per_mm, spoilt.curvature_per_mm);
      EXPECT_EQ(plain.lambda1_per_rad, spoilt.lambda1_per_rad);
      EXPECT_EQ(plain.lambda2, spoilt.lambda2);
      EXPECT_EQ(plain.bending_mm, spoilt.bending_mm);
      EXPECT_EQ(plain.covariance, spoilt.covariance);
      EXPECT_EQ(plain.tenth_covariance, spoilt.tenth_covariance);
      EXPECT_EQ(plain.tenth_variance, spoilt.tenth_variance);
      EXPECT_EQ(plain.shared.mean, spoilt.shared.mean);
      EXPECT_EQ(plain.shared.covariance, spoilt.shared.covariance);
      EXPECT_EQ(plain.shared.with_state, spoilt.shared.with_state);
    }
}

// A plant and what of it the filter estimates: k, lambda1, lambda2, or k and b of a stiff shaft.
struct Made {
  std::unique_ptr<rig::Plant> plant;
  model::NeedleParameters needle;
  double bending_mm = 0;
};
double parameters_nees(const FilterState& state, const Made& made) {
  if (made.bending_mm == 0) {
    const Eigen::Vector3d error = testing::error_of<9>(state, state.pose, made.needle).tail<3>();
    return error.dot(state.covariance.bottomRightCorner<3, 3>().ldlt().solve(error)) / 3;
  }
  const Eigen::Vector2d error(made.needle.curvature_per_mm - state.curvature_per_mm,
                              made.bending_mm - state.bending_mm);
  Eigen::Matrix2d P;
  P << state.covariance(6, 6), state.tenth_covariance[6], state.tenth_covariance[6], state.tenth_variance;
  return error.dot(P.ldlt().solve(error)) / 2;
}

struct Seen {
  double pose = 0, parameters = 0, windup = 0, off_rad = 0, sd_rad = 0;
  int rejected = 0, readings = 0;
};
// Insertions with half turns at rest and turns on the way, of a plant whose wind-up is drawn; NEES per degree.
template <class MakePlant>
Seen wound_up(unsigned seed, double most_rad, double told_sd_rad, const MakePlant& make) {
  constexpr int kRuns = 24;
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal(0, 1);
  Seen seen;
  for (int run = 0; run < kRuns; ++run) {
    const double windup_rad = most_rad * std::uniform_real_distribution<>(0, 1)(rng);
    EstimatorConfig config;
    const Made made = make(windup_rad, rng, config);
    rig::Plant* const plant = made.plant.get();
    config.nuisance.windup_sd_rad = told_sd_rad;
    const NeedleFilter filter(config);
    FilterState state = filter.initial();
    const std::pair<double, double> legs[] = {{30, 0}, {0, 3.14}, {25, 0},   {0, -2.2}, {20, 2.0},
                                              {0, -3}, {15, 0},   {0, 1.57}, {20, 0}};
    int step = 0;
    for (const auto& [mm, rad] : legs) {
      const int steps = static_cast<int>(std::max(mm / 0.05, std::abs(rad) / 0.02));
      for (int i = 0; i < steps; ++i) {
        plant->advance(mm / steps, rad / steps, 0.01);
        filter.predict(state, mm / steps, rad / steps, 0.01);
        if (++step % 3 != 0) continue;
        model::TipMeasurement m;
        m.camera = step / 3 % 2;
        m.utime = 1 + step;
        const Eigen::Vector3d sees = m.camera == 0 ? Eigen::Vector3d(0, 1, 1) : Eigen::Vector3d(1, 0, 1);
        m.information_per_mm2 = (sees / 0.04).asDiagonal();
        for (int j = 0; j < 3; ++j) m.position_mm[j] = sees[j] * (plant->tip().p_mm[j] + 0.2 * normal(rng));
        seen.rejected += filter.update(state, m).accepted ? 0 : 1;
        ++seen.readings;
      }
    }
    const model::Vector6d error = model::log_se3(filter.tip_pose(state).inverse() * plant->tip());
    seen.pose += error.dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / 6 / kRuns;
    seen.parameters += parameters_nees(state, made) / kRuns;
    const double off_rad = state.nuisance.mean[kWindup] - windup_rad, variance = state.nuisance.covariance(0, 0);
    if (variance > 0) seen.windup += off_rad * off_rad / variance / kRuns;
    seen.off_rad += std::abs(off_rad) / kRuns, seen.sd_rad += std::sqrt(variance) / kRuns;
  }
  std::cout << "seed " << seed << ", wind-up of 0 to " << most_rad << " rad, told " << told_sd_rad << ": pose NEES/6 "
            << seen.pose << ", of parameters " << seen.parameters << ", of the wind-up " << seen.windup
            << ", which is off by " << seen.off_rad << " rad (claimed " << seen.sd_rad << "), rejected "
            << seen.rejected << " of " << seen.readings << "\n";
  return seen;
}

Made beam(double windup_rad, std::mt19937_64& rng, EstimatorConfig& config) {
  std::normal_distribution<double> normal(0, 1);
  model::BeamPlantConfig beam;
  beam.foundation_modulus_kPa = std::exp(std::uniform_real_distribution<>(std::log(20), std::log(100))(rng));
  beam.bevel_force_N = std::uniform_real_distribution<>(0.5, 1)(rng);
  beam.max_depth_mm = 150;
  beam.windup_at_100mm_rad = windup_rad;
  const double told_k = std::clamp(1 + 0.2 * normal(rng), 0.5, 1.5),
               told_b = std::clamp(1 + 0.2 * normal(rng), 0.5, 1.5);
  Prior& prior = config.prior;
  prior.needle = rig::bicycle_of(beam);
  prior.needle.curvature_per_mm *= told_k;
  prior.curvature_sd_per_mm = 0.2 * prior.needle.curvature_per_mm;
  prior.lambda1_sd_per_rad = prior.lambda2_sd = 0;
  const double bending_mm = std::pow(4 * beam.bending_stiffness_N_mm2 / (1e-3 * beam.foundation_modulus_kPa), 0.25);
  prior.bending_mm = told_b * bending_mm;
  prior.bending_sd_mm = 0.2 * prior.bending_mm;
  prior.guide_mm = beam.guide_gap_mm;
  return {std::make_unique<rig::BeamNeedle>(beam), rig::bicycle_of(beam), bending_mm};
}

Made kinematic(double windup_rad, std::mt19937_64& rng, EstimatorConfig& config) {
  config.prior = agar_config().prior;
  config.prior.lambda1_sd_per_rad *= 0.3, config.prior.lambda2_sd *= 0.3;  // else linearisation is what is looked at
  config.prior.position_sd_mm = config.prior.tilt_sd_rad = 1e-3;           // the plant begins at the entry
  model::ActiveEffect windup{.effect = model::find_effect("torsional_windup"), .parameters = {}};
  windup.parameters[0] = windup_rad;
  std::normal_distribution<double> normal(0, 1);
  const model::NeedleParameters needle = testing::draw_needle(config.prior, rng);
  const double roll_rad = config.prior.roll_sd_rad * normal(rng);
  return {std::make_unique<rig::KinematicPlant>(needle, std::vector{windup}, roll_rad), needle};
}

TEST(Nuisance, AnUnknownWindUpIsFoundOnBeamsAndThePoseIsAsSureAsItSays) {
  const Seen without = wound_up(51, 0.8, 0, beam);
  EXPECT_GT(without.pose, 10) << "what it is for";
  const Seen known = wound_up(51, 0.8, 0.4, beam);
  EXPECT_LT(known.pose, 1.5);
  EXPECT_LT(known.parameters, 1.2);
  EXPECT_LT(known.off_rad, 0.1);
  EXPECT_LT(known.windup, 2.5);
  EXPECT_LT(known.rejected, 0.001 * known.readings);
  const Seen none = wound_up(52, 0, 0.4, beam);
  EXPECT_LT(none.pose, 1.5) << "a shaft that does not wind up";
  EXPECT_LT(none.parameters, 1.2);
  EXPECT_LT(none.off_rad, 0.05);
}

TEST(Nuisance, AnUnknownWindUpIsFoundOnTheModelsOwnNeedle) {
  const Seen known = wound_up(53, 0.8, 0.4, kinematic);
  EXPECT_LT(known.pose, 1.5);
  EXPECT_LT(known.parameters, 1.2);
  EXPECT_LT(known.off_rad, 0.1);
  EXPECT_LT(known.windup, 2.5);
}

// Cameras that are late, of drawn insertions that rest for a second each 25 mm.
using Late = std::array<double, 2>;  // s
struct Consistency {
  double pose = 0, parameters = 0, latencies = 0, tip_mm = 0, latency_off_s = 0, latency_sd_s = 0;
};
template <class DrawLate>
Consistency through_cameras(unsigned seed, double told_sd_s, const DrawLate& draw_late) {
  constexpr int kRuns = 60;
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal(0, 1);
  EstimatorConfig config = agar_config();
  config.prior.lambda1_sd_per_rad *= 0.3, config.prior.lambda2_sd *= 0.3;
  config.prior.tilt_sd_rad = config.entry_slope_sd_rad;
  config.process = {0, 0, 0, 0, 0, 0, 0};
  config.relinearised_steps = 0;
  config.nuisance.latency_sd_s = told_sd_s;
  testing::InsertionPlan plan;
  plan.rate_mm_s = 5;
  Consistency out;
  for (int run = 0; run < kRuns; ++run) {
    const auto drawn = testing::draw_insertion(config.prior, plan, rng);
    const Late late_s = draw_late(rng);
    NeedleEstimator estimator(config, 128);
    std::int64_t utime = testing::kStart_utime, seq = 0;
    for (std::size_t i = 0; i < drawn.data.actuators.size(); ++i) {
      const int repeated = i % 500 == 0 ? 100 : 1;
      for (int r = 0; r < repeated; ++r, utime += 10'000) {
        model::ActuatorState axes = drawn.data.actuators[i];
        axes.utime = utime;
        estimator.add(axes);
        if (seq++ % 2 != 0) continue;
        const int camera = static_cast<int>(seq / 2 % 2);
        const double by_s = late_s.at(static_cast<std::size_t>(camera));
        estimator.add(testing::measure(drawn.data.poses[i].p_mm, utime + std::llround(1e6 * by_s), seq, camera,
                                       camera == 0 ? Eigen::Vector3d(0, 1, 1) : Eigen::Vector3d(1, 0, 1), 0.15, rng));
      }
    }
    const FilterState state = estimator.estimate(utime).state;
    const model::Vector6d error = model::log_se3(state.pose.inverse() * drawn.data.final_pose);
    out.pose += error.dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / 6 / kRuns;
    out.parameters += parameters_nees(state, {nullptr, drawn.needle}) / kRuns;
    out.tip_mm += error.head<3>().norm() / kRuns;
    const Eigen::Vector2d wrong_s = state.nuisance.mean.tail<2>() - Eigen::Vector2d(late_s[0], late_s[1]);
    out.latency_off_s += wrong_s.cwiseAbs().mean() / kRuns;
    out.latency_sd_s += std::sqrt(state.nuisance.covariance(latency_of(0), latency_of(0))) / kRuns;
    if (!(told_sd_s > 0)) continue;
    const Eigen::Matrix2d P = state.nuisance.covariance.bottomRightCorner<2, 2>();
    out.latencies += wrong_s.dot(P.ldlt().solve(wrong_s)) / 2 / kRuns;
  }
  std::cout << "seed " << seed << ", told " << told_sd_s << " s: pose NEES/6 " << out.pose << ", of parameters "
            << out.parameters << ", of latencies NEES/2 " << out.latencies << ", tip off by " << out.tip_mm
            << " mm, latencies off by " << 1e3 * out.latency_off_s << " ms (claimed " << 1e3 * out.latency_sd_s
            << ")\n";
  return out;
}

TEST(Nuisance, LatenciesDrawnFromThePriorAreKnownAsWellAsItSays) {
  constexpr double kTold_s = 0.02;
  const Consistency all = through_cameras(54, kTold_s, [](std::mt19937_64& rng) {
    std::normal_distribution<double> normal(0, kTold_s);
    return Late{std::abs(normal(rng)), std::abs(normal(rng))};  // a stamp from the future is none
  });
  const auto of = [](int degrees, double p) {
    return quantile(boost::math::chi_squared(60.0 * degrees), p) / (60.0 * degrees);
  };
  EXPECT_LT(all.pose, of(6, 0.999));
  EXPECT_LT(all.parameters, of(3, 0.999));
  EXPECT_LT(all.latencies, of(2, 0.999));
}

// Of one camera, so that the other shows it, and of both.
TEST(Nuisance, FiftyMillisecondsAreFound) {
  for (const bool both : {false, true}) {
    const auto made = [both](std::mt19937_64&) { return Late{0.05, both ? 0.05 : 0}; };
    const Consistency plain = through_cameras(55, 0, made);
    EXPECT_GT(plain.pose, 5) << "what it is for";
    const Consistency known = through_cameras(55, 0.05, made);
    EXPECT_LT(known.pose, 1.5);
    EXPECT_LT(known.parameters, 1.5);
    EXPECT_LT(known.latencies, 2.5);
    EXPECT_LT(known.tip_mm, 0.6 * plain.tip_mm);
    EXPECT_LT(known.latency_off_s, 0.006);
  }
}

}  // namespace
}  // namespace bevel::estimator
