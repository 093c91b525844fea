// SPDX-License-Identifier: MIT
// Figures of the beam plant: deflection and best circle over the range of tissues, convergence, cost, allocations.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include <bevel/model/beam/beam_plant.hpp>
#include "tests/support/count_allocations.hpp"

namespace bevel::model {
namespace {

struct Sample {
  double z_mm;
  double y_mm;
};

std::vector<Sample> path_to_130mm(const BeamPlantConfig& config) {
  BeamPlant plant(config);
  std::vector<Sample> path;
  for (int i = 0; i < 260; ++i) {
    plant.advance(0.5, 0.0, 0.025);
    path.push_back({plant.tip_position_mm().z(), plant.tip_position_mm().y()});
  }
  return path;
}

// The bicycle: a circle tangent to the insertion axis at the entry point. Curvature by least squares; largest error.
double largest_circle_error_mm(const std::vector<Sample>& path) {
  const auto error = [](const Sample& s, double curvature) {
    const double kz = curvature * s.z_mm;
    return s.y_mm + s.z_mm * kz / (1.0 + std::sqrt(1.0 - kz * kz));
  };
  const auto squares = [&](double curvature) {
    double sum = 0.0;
    for (const auto& s : path) sum += error(s, curvature) * error(s, curvature);
    return sum;
  };
  double low = 0.0;
  double high = 0.0076;  // a radius of 131 mm: every circle reaches the deepest sample
  while (high - low > 1e-9) {
    const double third = (high - low) / 3.0;
    const bool left = squares(low + third) < squares(high - third);
    (left ? high : low) = left ? high - third : low + third;
  }
  double largest = 0.0;
  for (const auto& s : path) largest = std::max(largest, std::abs(error(s, low)));
  return largest;
}

TEST(BeamPlantFigures, DeflectionAndBestCircleOverTheRangeOfTissues) {
  std::printf("  k kPa   F N  deflection mm  largest error of the best circle mm (130 mm)\n");
  double smallest = 1e9;
  double greatest = 0.0;
  for (const double modulus_kPa : {2.0, 20.0, 100.0}) {
    for (const double force_N : {0.2, 0.5, 1.0}) {
      BeamPlantConfig config;
      config.foundation_modulus_kPa = modulus_kPa;
      config.bevel_force_N = force_N;
      config.feed_is_arc_length = false;
      const auto path = path_to_130mm(config);
      const double deflection_mm = -path.back().y_mm;
      const double error_mm = largest_circle_error_mm(path);
      std::printf("%7.0f %5.1f %14.2f %12.2f\n", modulus_kPa, force_N, deflection_mm, error_mm);
      smallest = std::min(smallest, deflection_mm);
      greatest = std::max(greatest, deflection_mm);
      EXPECT_GT(error_mm, 0.1);  // no circle
      EXPECT_LT(error_mm, 1.3);  // but near one
    }
  }
  EXPECT_NEAR(smallest, 3.5, 0.2);
  EXPECT_NEAR(greatest, 42.0, 2.0);
}

double tip_mm(double element_mm, double step_mm) {
  BeamPlantConfig config;
  config.element_length_mm = element_mm;
  config.max_step_mm = step_mm;
  config.feed_is_arc_length = false;
  BeamPlant plant(config);
  plant.advance(65.0, 0.0, 0.0);
  plant.advance(65.0, 2.0, 0.0);
  return plant.tip_position_mm().y();
}

TEST(BeamPlantFigures, HalvingElementsAndStepsConverges) {
  EXPECT_NEAR(tip_mm(2.0, 0.5), tip_mm(1.0, 0.5), 1e-4);
  EXPECT_NEAR(tip_mm(8.0, 0.5), tip_mm(1.0, 0.5), 1e-3);
  const double coarse = std::abs(tip_mm(2.0, 2.0) - tip_mm(2.0, 1.0));
  const double middle = std::abs(tip_mm(2.0, 1.0) - tip_mm(2.0, 0.5));
  const double fine = std::abs(tip_mm(2.0, 0.5) - tip_mm(2.0, 0.25));
  std::printf("change of the tip on halving the step 2, 1, 0.5 mm: %.5f %.5f %.5f mm\n", coarse, middle, fine);
  EXPECT_LT(middle, 0.6 * coarse);
  EXPECT_LT(fine, 0.6 * middle);
  EXPECT_LT(fine, 0.01);
}

TEST(BeamPlantFigures, AdvanceDoesNotAllocate) {
  BeamPlantConfig config;
  config.relaxing_fraction = 0.4;
  config.windup_at_100mm_rad = 0.5;
  BeamPlant plant(config);
  const long before = bevel::testing::allocations;
  for (int i = 0; i < 300; ++i) plant.advance(i < 240 ? 0.5 : -0.5, 0.1, 0.025);
  EXPECT_EQ(bevel::testing::allocations, before);
  EXPECT_GT(before, 0U);  // the counter is in place
}

TEST(BeamPlantFigures, CostOfAnInsertion) {
  for (const double relaxing : {0.0, 0.4}) {
    BeamPlantConfig config;
    config.relaxing_fraction = relaxing;
    std::vector<double> times_ms;
    for (int i = 0; i < 15; ++i) {
      const auto start = std::chrono::steady_clock::now();
      EXPECT_EQ(path_to_130mm(config).size(), 260U);
      times_ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    std::nth_element(times_ms.begin(), times_ms.begin() + 7, times_ms.end());
    std::printf("130 mm in 260 steps, relaxing fraction %.1f: median %.2f ms\n", relaxing, times_ms[7]);
  }
}

}  // namespace
}  // namespace bevel::model
