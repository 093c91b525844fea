// SPDX-License-Identifier: MIT
// Cost of predict + update, of the whole estimator per message, and of a plain dense product-sum of the same flops.
#include <benchmark/benchmark.h>

#include <bevel/estimator/needle_estimator.hpp>
#include "tests/estimator/insertion.hpp"

namespace bevel::estimator {
namespace {

EstimatorConfig coloured_config() {
  EstimatorConfig config = testing::agar_config();
  config.reading = {.correlated_share = 0.9, .correlation_mm = 2};
  return config;
}

void run_predict_update(benchmark::State& bench, const EstimatorConfig& config) {
  const NeedleFilter filter(config);
  FilterState state = filter.initial();
  model::TipMeasurement m;
  m.information_per_mm2 = Eigen::Vector3d(0, 44, 44).asDiagonal();  // one camera
  long i = 0;
  for (auto _ : bench) {
    filter.predict(state, (i++ / 500) % 2 ? -0.1 : 0.1, 0.006);
    m.position_mm = state.pose.p_mm;
    benchmark::DoNotOptimize(filter.update(state, m));
  }
}
void BM_predict_update(benchmark::State& bench) { run_predict_update(bench, testing::agar_config()); }
BENCHMARK(BM_predict_update);
// With the errors that neighbouring readings share as six more states.
void BM_predict_update_coloured(benchmark::State& bench) { run_predict_update(bench, coloured_config()); }
BENCHMARK(BM_predict_update_coloured);

// With wind-up and latencies as three more.
void BM_predict_update_nuisance(benchmark::State& bench) {
  EstimatorConfig config = testing::agar_config();
  config.nuisance = {.windup_sd_rad = 0.4, .latency_sd_s = 0.02};
  run_predict_update(bench, config);
}
BENCHMARK(BM_predict_update_nuisance);

void BM_predict_heading(benchmark::State& bench) {
  const NeedleFilter filter(testing::agar_config());
  FilterState state = filter.initial();
  model::TipHeading m;
  long i = 0;
  for (auto _ : bench) {
    filter.predict(state, (i++ / 500) % 2 ? -0.1 : 0.1, 0.006);
    m.heading = state.pose.R.col(2);
    m.information_per_rad2 = 2500 * (Eigen::Matrix3d::Identity() - m.heading * m.heading.transpose());
    benchmark::DoNotOptimize(filter.update(state, m));
  }
}
BENCHMARK(BM_predict_heading);

void BM_predict(benchmark::State& bench) {
  const NeedleFilter filter(testing::agar_config());
  FilterState state = filter.initial();
  long i = 0;
  for (auto _ : bench) {
    filter.predict(state, (i++ / 500) % 2 ? -0.1 : 0.1, 0.006);
    if (i % 1000 == 0) state = filter.initial();
    benchmark::DoNotOptimize(state.pose.p_mm[0]);
  }
}
BENCHMARK(BM_predict);

// Insertions to and fro, one step at a time.
template <class Jacobian, class Step>
void run_steps_with(benchmark::State& bench, Step step) {
  model::Pose pose;
  Jacobian jacobian;
  const auto slip = model::slip_parameters(testing::agar_config().prior.needle);
  long i = 0;
  for (auto _ : bench) {
    const model::StepInput input{(i++ / 500) % 2 ? -0.1 : 0.1, 0.006, {0.0047, 0}};
    benchmark::DoNotOptimize(step(pose, input, slip, jacobian));
    benchmark::DoNotOptimize(jacobian.pose(0, 0));
  }
}

void BM_model_step_with_jacobian(benchmark::State& bench) {
  run_steps_with<model::StepJacobian>(bench, [](auto&... with) { return model::step(with...); });
}
BENCHMARK(BM_model_step_with_jacobian);

void BM_model_step_with_needle_jacobian(benchmark::State& bench) {
  run_steps_with<model::NeedleJacobian>(bench, [](auto&... with) { return model::advance(with...); });
}
BENCHMARK(BM_model_step_with_needle_jacobian);

void BM_model_step_with_midpoint_jacobian(benchmark::State& bench) {
  run_steps_with<model::NeedleJacobian>(bench, [](auto&... with) { return model::advance_by_midpoint(with...); });
}
BENCHMARK(BM_model_step_with_midpoint_jacobian);

void BM_model_step(benchmark::State& bench) {
  model::Pose pose;
  const auto slip = model::slip_parameters(testing::agar_config().prior.needle);
  long i = 0;
  for (auto _ : bench) {
    benchmark::DoNotOptimize(model::advance(pose, {(i++ / 500) % 2 ? -0.1 : 0.1, 0.006, {0.0047, 0}}, slip));
    benchmark::DoNotOptimize(pose.p_mm[0]);
  }
}
BENCHMARK(BM_model_step);

// F P F^T + Q and the Joseph form of rank 2 as plain dense 9 x 9 arithmetic: four products and three sums.
void BM_floor_dense_9x9(benchmark::State& bench) {
  Matrix9d P = Matrix9d::Identity();
  Matrix9d F = Matrix9d::Identity() + 1e-3 * Matrix9d::Ones();
  const Matrix9d Q = 1e-6 * Matrix9d::Identity();
  for (auto _ : bench) {
    benchmark::DoNotOptimize(F.data());
    Matrix9d A;
    A.noalias() = F * P;
    P.noalias() = A * F.transpose();
    P += Q;
    A.noalias() = F * P;
    P.noalias() = A * F.transpose();
    P = 0.4 * (P + P.transpose()) + Q;
    benchmark::DoNotOptimize(P.data());
  }
}
BENCHMARK(BM_floor_dense_9x9);

void run_whole_insertion(benchmark::State& bench, const EstimatorConfig& config) {
  std::mt19937_64 rng(1);
  const testing::Insertion data = testing::insert(config.prior.needle, {}, {}, rng);
  for (auto _ : bench) {
    NeedleEstimator estimator(config);
    std::size_t next = 0;
    for (const auto& actuator : data.actuators) {
      while (next < data.measurements.size() && data.measurements[next].utime < actuator.utime)
        estimator.add(data.measurements[next++]);
      estimator.add(actuator);
    }
    benchmark::DoNotOptimize(estimator.counters().positions.late);
  }
  bench.SetItemsProcessed(bench.iterations() *
                          static_cast<std::int64_t>(data.actuators.size() + data.measurements.size()));
}
void BM_whole_insertion_per_message(benchmark::State& bench) { run_whole_insertion(bench, testing::agar_config()); }
BENCHMARK(BM_whole_insertion_per_message)->Unit(benchmark::kMillisecond);
void BM_whole_insertion_coloured(benchmark::State& bench) { run_whole_insertion(bench, coloured_config()); }
BENCHMARK(BM_whole_insertion_coloured)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace bevel::estimator

BENCHMARK_MAIN();
