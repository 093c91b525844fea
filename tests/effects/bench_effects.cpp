// SPDX-License-Identifier: MIT
// What a leg costs: AugmentedNeedle::advance per leg and model::predict per recording, by columns and effects.
#include <benchmark/benchmark.h>

#include "tests/effects/script.hpp"

namespace bevel::model::testing {
namespace {

AugmentedNeedle make_needle(int columns, int effects) {
  std::vector<ActiveEffect> all{active("torsional_windup", {0.5}), active("drilling", {1.5}),
                                active("relaxation", {1.0, 2.0, 5})};
  all.resize(static_cast<std::size_t>(effects));
  int column = 4;
  for (auto& one : all)
    for (std::size_t i = 0; i < one.effect->parameters().size() && column < columns; ++i)
      one.parameters[i] = Dual::unknown(one.parameters[i].value, column++);
  return {agar(), all, columns, columns ? NeedleColumns{0, 1, 2, 3} : NeedleColumns{}};
}

void advance_a_leg(benchmark::State& run) {
  const AugmentedNeedle needle = make_needle(static_cast<int>(run.range(0)), static_cast<int>(run.range(1)));
  const Motion motion = rich_script().recorded();
  for (auto _ : run) {
    AugmentedState state = needle.entry(motion.nodes.front());
    for (std::size_t i = 1; i < motion.nodes.size(); ++i)
      if (!needle.advance(state, motion.nodes[i])) run.SkipWithError("outside the domain");
    benchmark::DoNotOptimize(state);
  }
  run.counters["per_leg"] =
      benchmark::Counter(static_cast<double>(run.iterations()) * static_cast<double>(motion.nodes.size() - 1),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(advance_a_leg)->ArgNames({"columns", "effects"})->ArgsProduct({{0, 8}, {0, 1, 2, 3}});

// What is beneath it: the same legs by the plain model.
template <bool kJacobian>
void model_alone(benchmark::State& run) {
  const SlipParameters slip = slip_parameters(agar());
  const Motion motion = rich_script().recorded();
  for (auto _ : run) {
    Pose pose;
    StepJacobian J;
    for (std::size_t i = 1; i < motion.nodes.size(); ++i) {
      const BaseMotion &a = motion.nodes[i - 1], &b = motion.nodes[i];
      const StepInput input{b.insertion_mm - a.insertion_mm, b.rotation_rad - a.rotation_rad, {0.0047, 0}};
      if (!(kJacobian ? advance(pose, input, slip, J) : advance(pose, input, slip)))
        run.SkipWithError("outside the domain");
    }
    benchmark::DoNotOptimize(pose);
    benchmark::DoNotOptimize(J);
  }
  run.counters["per_leg"] =
      benchmark::Counter(static_cast<double>(run.iterations()) * static_cast<double>(motion.nodes.size() - 1),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(model_alone<false>);
BENCHMARK(model_alone<true>);

void predict_a_recording(benchmark::State& run) {
  const AugmentedNeedle needle = make_needle(static_cast<int>(run.range(0)), static_cast<int>(run.range(1)));
  const Motion motion = rich_script().recorded();
  OpenLoop path;
  for (auto _ : run) benchmark::DoNotOptimize(predict(needle, motion, path));
  run.counters["per_leg"] =
      benchmark::Counter(static_cast<double>(run.iterations()) * static_cast<double>(motion.nodes.size() - 1),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(predict_a_recording)->ArgNames({"columns", "effects"})->ArgsProduct({{0, 8}, {0, 3}});

}  // namespace
}  // namespace bevel::model::testing

BENCHMARK_MAIN();
