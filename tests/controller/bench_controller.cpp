// SPDX-License-Identifier: MIT
// One step of each law, at 100 mm to go: what a control period has to have room for.
#include <benchmark/benchmark.h>

#include <bevel/controller/arc_law.hpp>

namespace bevel::controller {
namespace {

model::NeedleParameters agar() {
  model::NeedleParameters needle;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}
const Eigen::Vector3d kTarget(6, -9, 100);

void arcs(benchmark::State& state, const ShaftConfig& shaft) {
  ArcLaw law;
  const ControllerConfig config;
  const model::Pose tip;
  for (auto _ : state)
    benchmark::DoNotOptimize(law.step(arc_geometry(tip, agar(), shaft, kTarget), 0, 10, 0.05, config).rotation_rad_s);
}
void Arcs(benchmark::State& state) { arcs(state, {}); }
void ArcsWithAStiffShaft(benchmark::State& state) { arcs(state, {40, 15}); }
void Spin(benchmark::State& state) {
  const ControllerConfig config;
  const model::Pose tip;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        steering_rates(steering_geometry(tip, agar(), kTarget, 5, 0.3), 0, 0.05, config).rotation_rad_s);
}
BENCHMARK(Arcs);
BENCHMARK(ArcsWithAStiffShaft);
BENCHMARK(Spin);

}  // namespace
}  // namespace bevel::controller

BENCHMARK_MAIN();
