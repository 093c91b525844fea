// SPDX-License-Identifier: MIT
// Trajectory fit of 12 recordings of 300 measurements, 3 parameters. The peer is tests/peers/scipy_trajectory_fit.py:
// `--export FILE` writes the same data for it.
#include <benchmark/benchmark.h>

#include <cstring>
#include <fstream>
#include <iostream>

#include <bevel/diagnosis/identification/trajectory_fit.hpp>
#include "tests/identification/simulated_insertion.hpp"

namespace {
using namespace bevel;

model::NeedleParameters truth() {
  model::NeedleParameters needle;
  needle.lambda1_per_rad = 0.49;
  needle.lambda2 = 0.22;
  return needle;
}

diagnosis::FitOptions options() {
  diagnosis::FitOptions o;
  o.start = truth();
  o.start.curvature_per_mm = 0.0035;
  o.start.lambda1_per_rad = 0.144;
  o.start.lambda2 = 0.032;
  return o;
}

std::vector<diagnosis::Insertion> recordings() {
  std::mt19937_64 random(20150928);
  std::vector<diagnosis::Insertion> all;
  diagnosis::SimulatedInsertion plan;
  plan.measurements = 300;
  for (int i = 0; i < 12; ++i) all.push_back(diagnosis::simulate_insertion(truth(), plan, random));
  return all;
}

void fit(benchmark::State& state, diagnosis::Loss loss) {
  const auto data = recordings();
  auto o = options();
  o.loss = loss;
  o.threads = static_cast<int>(state.range(0));
  int iterations = 0;
  for (auto _ : state) {
    const auto result = diagnosis::fit_trajectory(data, o);
    iterations = result.iterations;
    benchmark::DoNotOptimize(result.cost);
  }
  state.counters["iterations"] = iterations;
}
void square_loss(benchmark::State& state) { fit(state, diagnosis::Loss::square); }
void huber_loss(benchmark::State& state) { fit(state, diagnosis::Loss::huber); }
BENCHMARK(square_loss)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(huber_loss)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

int export_data(const char* path) {
  std::ofstream file(path);
  file.precision(17);
  const auto data = recordings();
  for (std::size_t i = 0; i < data.size(); ++i)
    for (const auto& o : data[i].observations)
      file << i << ',' << o.insertion_mm << ',' << o.position_mm.y() << ',' << o.position_mm.z() << '\n';
  auto o = options();
  o.loss = diagnosis::Loss::square;
  const auto r = diagnosis::fit_trajectory(data, o);
  std::cout.precision(12);
  std::cout << "estimate " << r.needle.curvature_per_mm << ' ' << r.needle.lambda1_per_rad << ' ' << r.needle.lambda2
            << "\nsquares " << r.squares << '\n';
  return file ? 0 : 1;
}
}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--export") == 0) return export_data(argv[2]);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
