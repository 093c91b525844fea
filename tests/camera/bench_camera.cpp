// SPDX-License-Identifier: MIT
// Cost of one frame: `bench_camera --benchmark_min_time=1`. One thread, as in the camera process.
#include <benchmark/benchmark.h>

#include <bevel/drivers/camera/tip_tracker.hpp>
#include "tests/camera/scenes.hpp"

namespace {

using bevel::camera::Frame;
using bevel::camera::PlanarView;
using bevel::camera::TipTracker;

std::vector<cv::Mat> pictures(cv::Size size_px, const PlanarView& view) {
  bevel::rig::SceneConfig scene;
  scene.size_px = size_px;
  bevel::rig::NeedleRenderer renderer(scene, view);
  constexpr int count = 4;
  std::vector<cv::Mat> out;
  out.reserve(count);
  for (int i = 0; i < count; ++i)
    out.push_back(renderer.render(bevel::test::arc(60.0 + 0.1 * i, 0.004, 0.0), 0.5).gray);
  return out;
}

void track(benchmark::State& state, bool full) {
  cv::setNumThreads(1);
  const cv::Size size_px(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  auto config = bevel::test::side_view();
  const double scale = size_px.width / 640.0;
  config.px_per_mm *= scale;
  config.origin_px *= scale;
  const PlanarView view(config);
  const auto tracker_config = bevel::test::tracker_config();
  TipTracker tracker(tracker_config, view.px_per_mm());
  const auto frames = pictures(size_px, view);
  Frame frame;
  int64_t not_ok = 0;
  for (auto _ : state) {
    frame.capture_utime += 33'333;
    frame.gray = frames[static_cast<size_t>(++frame.seq) % frames.size()];
    if (full) tracker.forget();
    const auto tip = tracker.track(frame);
    not_ok += tip.status == bevel::camera::TipStatus::ok ? 0 : 1;
    benchmark::DoNotOptimize(tip.tip_px.x);
  }
  state.counters["not_ok"] = static_cast<double>(not_ok);
}

void region_of_interest(benchmark::State& state) { track(state, false); }
void full_search(benchmark::State& state) { track(state, true); }

void render(benchmark::State& state) {
  const PlanarView view(bevel::test::side_view());
  bevel::rig::NeedleRenderer renderer({}, view);
  const auto path = bevel::test::arc(70.0, 0.004, 0.0);
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(path, 0.5).gray.data);
}

BENCHMARK(region_of_interest)->Args({640, 480})->Args({1920, 1080})->Unit(benchmark::kMicrosecond);
BENCHMARK(full_search)->Args({640, 480})->Args({1920, 1080})->Unit(benchmark::kMicrosecond);
BENCHMARK(render)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
