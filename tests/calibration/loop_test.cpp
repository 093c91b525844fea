// SPDX-License-Identifier: MIT
// The loop with two calibrated cameras that look obliquely through walls: what estimator and controller make of rays.
// The same steering as with two planar views, so that a needle is as near its target as there.
#include <gtest/gtest.h>

#include <chrono>
#include <iostream>

#include <bevel/drivers/camera/calibrated_view.hpp>
#include "tests/calibration/true_optics.hpp"
#include "tests/loop/simulated_loop.hpp"

namespace bevel {
namespace {

constexpr unsigned kSeed = 5;

struct Outcome {
  double miss_mm = 0, estimate_mm = 0, seconds = 0;
};

// One insertion to `target`, seen by `see` or, without it, by planar views.
Outcome steer(const Eigen::Vector3d& target, const std::function<void(test::SimulatedLoop&)>& set_up) {
  test::SimulatedLoop loop(kSeed);
  set_up(loop);
  Eigen::Vector3d estimate = Eigen::Vector3d::Zero();
  loop.port.subscribe<needle_state_t>(io::channel::kNeedleState,
                                      [&](const needle_state_t& m) { estimate = Eigen::Vector3d(m.position_mm); });
  const auto begun = std::chrono::steady_clock::now();
  EXPECT_EQ(loop.steer_to(target), "");
  EXPECT_TRUE(loop.run(60, [&] { return loop.state() != controller::State::steering; }));
  EXPECT_EQ(loop.state(), controller::State::hold) << controller::to_string(loop.reason());
  loop.run(0.5);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  return {(loop.tip() - target).norm(), (loop.tip() - estimate).norm(), took.count()};
}

TEST(CalibratedLoop, SteersByRaysAsWellAsByPlanarViews) {
  auto cameras = test::two_cameras();
  const cv::Matx33d R = test::turned(0.03, 0, 0.02) * cv::Matx33d(0, 1, 0, 0, 0, 1, 1, 0, 0);  // world from {A}
  const cv::Vec3d entry = test::kBox_mm + cv::Vec3d(0, -45, 0);
  std::vector<camera::CalibratedView> views;
  for (size_t c = 0; c < 2; ++c) {
    cameras[c].t_mm += cameras[c].R * entry;
    cameras[c].R = cameras[c].R * R;
    views.emplace_back(cameras[c].model(static_cast<int>(c)));
  }
  std::mt19937_64 random(kSeed);
  const Eigen::Vector3d target(5, -4, 85);
  const Outcome planar = steer(target, [](test::SimulatedLoop&) {});
  const Outcome rays = steer(target, [&](test::SimulatedLoop& loop) {
    loop.see = [&](const Eigen::Vector3d& tip, std::int64_t, int which) -> std::optional<tip_measurement_t> {
      const auto c = static_cast<size_t>(which);
      const double noise_px = 0.2 * views[c].px_per_mm();  // 0.2 mm, as the planar views have
      std::normal_distribution<double> noise(0, noise_px);
      const cv::Point2d px =
          cameras[c].pixel({tip.x(), tip.y(), tip.z()}, true) + cv::Point2d(noise(random), noise(random));
      tip_measurement_t m = loop.picture(tip, which);  // stamp and number
      const auto p = views[c].position_mm(px);
      const auto W = views[c].information_per_mm2(px, cv::Matx22d::eye() * (noise_px * noise_px));
      std::copy(p.begin(), p.end(), m.position_mm);
      std::copy(W.begin(), W.end(), m.information_per_mm2);
      return m;
    };
  });
  std::cout << "seed " << kSeed << ": tip to target " << rays.miss_mm << " mm by rays, " << planar.miss_mm
            << " mm by planar views; estimate " << rays.estimate_mm << ", " << planar.estimate_mm << " mm; "
            << rays.seconds << ", " << planar.seconds << " s of computing\n";
  EXPECT_LT(rays.miss_mm, 0.6);
  EXPECT_LT(rays.estimate_mm, 0.4);
}

}  // namespace
}  // namespace bevel
