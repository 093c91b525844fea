// SPDX-License-Identifier: MIT
// Effects of a model file in the filter, on data simulated with them: innovations are what they should be with the
// effect in the model and not without.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include <bevel/analysis/replay/statistics.hpp>
#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/estimator/propagate.hpp>
#include <bevel/model/effects/open_loop.hpp>
#include "tests/estimator/insertion.hpp"

namespace bevel::estimator {
namespace {

constexpr unsigned kSeed = 31;
constexpr double kSigma_mm = 0.1;

model::ActiveEffect effect(std::string_view name, std::initializer_list<double> values) {
  model::ActiveEffect active;
  active.effect = model::find_effect(name);
  if (active.effect) std::copy(values.begin(), values.end(), active.parameters.begin());
  return active;
}

EstimatorConfig config_with(std::vector<model::ActiveEffect> effects) {
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  config.prior.position_sd_mm = 0.05;
  config.prior.tilt_sd_rad = 2e-3;
  config.prior.roll_sd_rad = 5e-3;
  config.process = {1e-4, 1e-6, 1e-6, 1e-6, 1e-8, 1e-6, 1e-6};
  config.effects = std::move(effects);
  return config;
}

// 100 mm with two turns of the shaft by half a turn and a stop, read every 33 ms.
testing::Insertion simulate(const EstimatorConfig& truth, std::mt19937_64& rng) {
  testing::Insertion data;
  std::vector<std::int64_t> times;
  double insertion_mm = 0, rotation_rad = 0;
  for (int ms = 0; ms <= 11'000; ++ms) {
    const bool rest = ms >= 6000 && ms < 7000;
    const bool turning = (ms >= 3000 && ms < 4000) || (ms >= 8000 && ms < 9000);
    if (ms % 10 == 0) {
      model::ActuatorState a;
      a.utime = testing::kStart_utime + std::int64_t{1000} * ms;
      a.insertion_mm = insertion_mm;
      a.rotation_rad = rotation_rad;
      data.actuators.push_back(a);
    }
    if (ms % 33 == 7 && ms > 400) times.push_back(testing::kStart_utime + std::int64_t{1000} * ms);
    insertion_mm += rest ? 0 : 0.01;
    rotation_rad += turning ? EIGEN_PI * 1e-3 : 0;
  }
  const model::AugmentedNeedle needle(truth.prior.needle, truth.effects);
  model::OpenLoop path;
  EXPECT_TRUE(model::predict(needle, model::make_motion(data.actuators, times), path));
  for (std::size_t i = 0; i < times.size(); ++i)
    data.measurements.push_back(
        testing::measure(path.position_mm[i], times[i], static_cast<std::int64_t>(i), 0, {1, 1, 1}, kSigma_mm, rng));
  return data;
}

analysis::ChiSquareMean innovations(const EstimatorConfig& config, const testing::Insertion& data) {
  NeedleEstimator estimator(config);
  analysis::ChiSquareMean nis;
  estimator.observe(
      [](void* context, const NeedleEstimator::Applied& a) {
        static_cast<analysis::ChiSquareMean*>(context)->add(a.update.mahalanobis2, a.update.rank);
      },
      &nis);
  std::size_t next = 0;
  for (const auto& actuator : data.actuators) {
    while (next < data.measurements.size() && data.measurements[next].utime < actuator.utime)
      estimator.add(data.measurements[next++]);
    estimator.add(actuator);
  }
  return nis;
}

TEST(EstimatorEffects, InnovationsAreInTheirBandWithTheEffectAndNotWithout) {
  const std::vector<model::ActiveEffect> effects = {
      effect("torsional_windup", {0.6}),     effect("camera_latency", {0.08}), effect("insertion_scale", {1.03}),
      effect("relaxation", {1.0, 0.8, 5.0}), effect("flip_transient", {10.0}), effect("camera_scale", {1.03}),
  };
  for (const auto& one : effects) {
    ASSERT_NE(one.effect, nullptr);
    std::mt19937_64 rng(kSeed);
    const EstimatorConfig with = config_with({one});
    const testing::Insertion data = simulate(with, rng);
    const auto known = innovations(with, data);
    const auto left_out = innovations(config_with({}), data);
    std::cout << one.effect->name() << ": NIS/axis " << known.mean() << " with, " << left_out.mean()
              << " without, band [" << known.lowest() << ", " << known.highest() << "], seed " << kSeed << "\n";
    EXPECT_TRUE(known.in_band()) << one.effect->name();
    EXPECT_GT(left_out.mean(), left_out.highest()) << one.effect->name();
  }
}

// Without a reading the filter goes where the model goes: what each effect remembers is kept from step to step. The
// needle is drawn back, turned and inserted again.
TEST(EstimatorEffects, WithoutReadingsTheFilterFollowsTheModel) {
  for (const model::Effect* one : model::all_effects()) {
    model::ActiveEffect active{.effect = one, .parameters = {}};
    const auto& parameters = one->parameters();
    const std::uint32_t kind = one->variants().back();
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const double usual = model::value_if_unsaid(parameters[i]);
      active.parameters[i] = (kind >> i & 1U) != 0 ? parameters[i].starts.front() : std::isnan(usual) ? 0 : usual;
    }
    const NeedleFilter filter(config_with({active}));
    FilterState state = filter.initial();
    const model::AugmentedNeedle needle(filter.config().prior.needle, {active});
    model::AugmentedState expected = needle.entry({});
    model::BaseMotion base;
    for (int i = 0; i < 800; ++i) {
      const double insertion_mm = i < 400 ? 0.1 : i < 500 ? -0.1 : i < 560 ? 0 : 0.1;
      const double rotation_rad = (i >= 200 && i < 300) || (i >= 500 && i < 560) ? 0.03 : 0;
      filter.predict(state, insertion_mm, rotation_rad, 0.01);
      base = {base.time_s + 0.01, base.insertion_mm + insertion_mm, base.rotation_rad + rotation_rad};
      ASSERT_TRUE(needle.advance(expected, base));
      if (i % 50 != 0) continue;
      model::TipReading reading{Eigen::Vector3d::Zero(), model::PointColumns(3, 0)};
      needle.point(expected, reading);
      needle.through_cameras(reading);
      ASSERT_LT((filter.seen_position_mm(state) - reading.position_mm).norm(), 1e-9) << one->name() << ", step " << i;
    }
  }
}

// The filter's step as it would stand without effects: the model's advance, its derivatives, the walk.
void plain_predict(FilterState& state, const EstimatorConfig& config, double insertion_mm, double rotation_rad) {
  const auto square = [](double x) { return x * x; };
  model::SlipParameters slip = model::slip_parameters(config.prior.needle);
  slip.lambda1_per_rad = state.lambda1_per_rad;
  slip.lambda2 = state.lambda2;
  model::NeedleJacobian jacobian;
  ASSERT_TRUE(model::advance(state.pose, {insertion_mm, rotation_rad, {state.curvature_per_mm, 0}}, slip, jacobian));
  propagate<9>(state.covariance, jacobian.pose, jacobian.needle.leftCols<3>());
  const ProcessNoise& noise = config.process;
  Vector9d walk;
  walk << Eigen::Vector3d::Constant(square(noise.position_mm)), square(noise.tilt_rad), square(noise.tilt_rad),
      square(noise.roll_rad), square(noise.curvature_per_mm), square(noise.lambda1_per_rad), square(noise.lambda2);
  walk *= std::abs(insertion_mm);
  walk[5] += square(noise.roll_per_sqrt_rad) * std::abs(rotation_rad);
  state.covariance.diagonal() += walk;
}

TEST(EstimatorEffects, NoEffectsIsThePlainFilterBitForBit) {
  std::mt19937_64 rng(kSeed);
  EstimatorConfig config = config_with({});
  config.midpoint_derivatives = false;
  config.process = {};
  config.prior.roll_sd_rad = 0.05;
  const testing::Insertion data = simulate(config, rng);
  const NeedleFilter filter(config);
  FilterState state = filter.initial(data.actuators[0].insertion_mm, data.actuators[0].rotation_rad);
  ASSERT_EQ(state.pose.p_mm, Eigen::Vector3d::Zero());
  ASSERT_EQ(state.pose.R, Eigen::Matrix3d::Identity());
  EXPECT_EQ(filter.latency_us(), 0);
  std::size_t accepted = 0;
  for (std::size_t i = 1; i < data.actuators.size(); ++i) {
    const double insertion_mm = data.actuators[i].insertion_mm - data.actuators[i - 1].insertion_mm;
    const double rotation_rad = data.actuators[i].rotation_rad - data.actuators[i - 1].rotation_rad;
    FilterState plain = state;
    filter.predict(state, insertion_mm, rotation_rad, 0.01);
    if (insertion_mm != 0 || rotation_rad != 0) plain_predict(plain, config, insertion_mm, rotation_rad);
    ASSERT_EQ(state.pose.p_mm, plain.pose.p_mm) << i;
    ASSERT_EQ(state.pose.R, plain.pose.R) << i;
    ASSERT_EQ(state.covariance, plain.covariance) << i;
    if (i % 3 != 0 || accepted >= data.measurements.size()) continue;
    // The measurement's part: the residual is to the pose itself.
    model::TipMeasurement m = data.measurements[accepted];
    m.position_mm = state.pose.p_mm + Eigen::Vector3d(0.03, -0.02, 0.01);
    ASSERT_EQ(filter.seen_position_mm(state), state.pose.p_mm);
    const Eigen::Vector3d residual = m.position_mm - state.pose.p_mm;
    const Update update = filter.update(state, m);
    ASSERT_TRUE(update.accepted);
    ASSERT_EQ(update.innovation, residual);
    ++accepted;
  }
  EXPECT_GT(accepted, 200U);
  // What effects would keep was never touched.
  EXPECT_EQ(state.effects.base.time_s, 0);
  EXPECT_EQ(state.effects.base.insertion_mm, 0);
  EXPECT_EQ(state.effects.tip_insertion_mm, 0);
}

void expect_plain_filter_of_an_effect_that_is_none(double wheelbase_sd_mm) {
  std::mt19937_64 rng(kSeed);
  EstimatorConfig plain = config_with({});
  plain.relinearised_steps = 0;
  plain.midpoint_derivatives = false;  // effects take those of the step itself
  const testing::Insertion data = simulate(plain, rng);
  EstimatorConfig none = config_with({effect("torsional_windup", {0.0})});
  plain.prior.wheelbase_sd_mm = none.prior.wheelbase_sd_mm = wheelbase_sd_mm;
  const auto end = [&data](const EstimatorConfig& config) {
    NeedleEstimator estimator(config);
    std::size_t next = 0;
    for (const auto& actuator : data.actuators) {
      while (next < data.measurements.size() && data.measurements[next].utime < actuator.utime)
        estimator.add(data.measurements[next++]);
      estimator.add(actuator);
    }
    return estimator.estimate(data.actuators.back().utime).state;
  };
  const FilterState a = end(plain), b = end(none);
  EXPECT_LT((a.pose.p_mm - b.pose.p_mm).norm(), 1e-9);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-9 * a.covariance.norm());
  EXPECT_NEAR(a.lambda1_per_rad, b.lambda1_per_rad, 1e-9);
  EXPECT_NEAR(a.wheelbase_mm, b.wheelbase_mm, 1e-6);
  EXPECT_NEAR(a.tenth_variance, b.tenth_variance, 1e-6);
}

TEST(EstimatorEffects, AnEffectThatIsNoneGivesThePlainFilter) { expect_plain_filter_of_an_effect_that_is_none(0); }

TEST(EstimatorEffects, AnEffectThatIsNoneGivesThePlainFilterWithEllToo) {
  expect_plain_filter_of_an_effect_that_is_none(4);
}

}  // namespace
}  // namespace bevel::estimator
