// SPDX-License-Identifier: MIT
#include <bevel/controller/target_track.hpp>

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

#include <bevel/controller/rendezvous.hpp>

namespace bevel::controller {
namespace {

constexpr std::int64_t kStart_utime = 1'700'000'000'000'000;
constexpr std::int64_t kReading_us = 50'000;
constexpr double kReading_sd_mm = 0.3;

std::int64_t at(double t_s) { return kStart_utime + std::llround(1e6 * t_s); }

struct Truth {
  Eigen::Vector3d middle_mm{4, -3, 100}, drift_mm_s{0.1, -0.2, 0}, breath_mm{2.5, 1, 0.5};
  double hz = 0.23, phase_rad = 0.7;
  double skewness = 0;  // share of the second harmonic: breathing out is longer than breathing in
  Eigen::Vector3d operator()(double t_s) const {
    const double turned_rad = 2 * std::numbers::pi * hz * t_s + phase_rad;
    return middle_mm + drift_mm_s * t_s + breath_mm * (std::sin(turned_rad) + skewness * std::cos(2 * turned_rad));
  }
};

TargetTrack watched(const Truth& truth, double until_s, double noise_sd_mm, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> noise(0, noise_sd_mm);
  TargetTrack track({.reading_sd_mm = kReading_sd_mm});
  for (std::int64_t after_us = 0; after_us <= std::llround(1e6 * until_s); after_us += kReading_us)
    track.observe(kStart_utime + after_us,
                  truth(1e-6 * static_cast<double>(after_us)) + Eigen::Vector3d(noise(rng), noise(rng), noise(rng)));
  return track;
}

TEST(TargetTrack, ATargetAtRestStaysWhereItIs) {
  TargetTrack track;
  EXPECT_TRUE(track.empty());
  track.observe(at(0), {1, 2, 100});
  EXPECT_EQ(track.position_mm(at(20)), Eigen::Vector3d(1, 2, 100)) << "one position is all there is";
  EXPECT_GT(track.position_sd_mm(at(20)), 5) << "of which little is known";
  for (int i = 1; i <= 400; ++i) track.observe(at(0.05 * i), {1, 2, 100});
  EXPECT_NEAR((track.position_mm(at(30)) - Eigen::Vector3d(1, 2, 100)).norm(), 0, 0.05);
  EXPECT_LT(track.position_sd_mm(at(22)), 1.2) << "it may begin to move";
}

// 20 s of readings, then ahead by 1, 3 and 6 s; frequencies between those of the grid, phases drawn.
TEST(TargetTrack, FindsTheBreathAndSaysHowWellItPredicts) {
  constexpr unsigned kSeed = 5;
  constexpr int kTargets = 60;
  std::mt19937_64 rng(kSeed);
  std::uniform_real_distribution<double> hz(0.12, 0.45), phase(0, 2 * std::numbers::pi);
  double squares = 0, normalised = 0, periods = 0;
  int count = 0;
  for (int i = 0; i < kTargets; ++i) {
    Truth truth;
    truth.hz = hz(rng), truth.phase_rad = phase(rng);
    const TargetTrack track = watched(truth, 20, kReading_sd_mm, kSeed + 1 + static_cast<unsigned>(i));
    periods += std::pow(track.period_s() * truth.hz - 1, 2);
    for (const double ahead_s : {1.0, 3.0, 6.0}) {
      const Eigen::Vector3d error_mm = track.position_mm(at(20 + ahead_s)) - truth(20 + ahead_s);
      squares += error_mm.squaredNorm() / 3,
          normalised += error_mm.squaredNorm() / 3 / std::pow(track.position_sd_mm(at(20 + ahead_s)), 2);
      ++count;
    }
  }
  std::cout << "seed " << kSeed << ", " << kTargets << " targets, " << count
            << " predictions: " << std::sqrt(squares / count) << " mm RMS along an axis, " << normalised / count
            << " normalised, periods off by " << 100 * std::sqrt(periods / kTargets) << " % RMS\n";
  EXPECT_LT(std::sqrt(squares / count), 0.3);
  EXPECT_LT(normalised / count, 1.2);
  EXPECT_LT(std::sqrt(periods / kTargets), 0.03);
}

TEST(TargetTrack, NoReadingIsTakenTwiceOrFromThePast) {
  const Truth truth;
  TargetTrack track = watched(truth, 10, 0, 1);
  const Eigen::Vector3d before = track.position_mm(at(12));
  track.observe(at(10), {0, 0, 0});
  track.observe(at(3), {0, 0, 0});
  EXPECT_EQ(track.position_mm(at(12)), before);
}

TEST(TargetTrack, OneReadingFarOffIsLeftOutAndTwoAreAnotherTarget) {
  const Truth truth;
  TargetTrack track = watched(truth, 15, 0.1, 1);
  track.observe(at(15.1), {30, 0, 100});
  track.observe(at(15.2), truth(15.2));
  EXPECT_NEAR((track.position_mm(at(16)) - truth(16)).norm(), 0, 0.4);
  track.observe(at(15.3), {30, 0, 100});
  track.observe(at(15.4), {30, 0, 100});
  EXPECT_EQ(track.position_mm(at(15.4)), Eigen::Vector3d(30, 0, 100));
}

TEST(TargetTrack, TurnsWhereItsVelocityAlongTheBreathIsNought) {
  Truth truth;
  truth.drift_mm_s.setZero();
  const TargetTrack track = watched(truth, 20, 0, 1);
  for (const double from_s : {20.5, 22.0, 27.3}) {
    const double turn_s = 1e-6 * static_cast<double>(track.next_turn_utime(at(from_s)) - kStart_utime);
    EXPECT_GE(turn_s, from_s);
    EXPECT_LE(turn_s, from_s + 0.5 / truth.hz + 0.05);
    // sin has its ends at a quarter of a turn and every half after that.
    const double halves = 2 * (truth.hz * turn_s + truth.phase_rad / (2 * std::numbers::pi) - 0.25);
    EXPECT_NEAR(halves, std::round(halves), 0.1);
  }
}

// Meets what it was told of, gating or not, when the way is walked at the planned rate; a breath that is no sine, and
// from another phase each time.
TEST(Rendezvous, ArrivesWhereTheTargetTurnsRound) {
  constexpr unsigned kSeed = 9;
  constexpr double kRate_mm_s = 5, kStep_s = 0.05;
  std::mt19937_64 rng(kSeed);
  std::normal_distribution<double> noise(0, 0.1);
  double worst_mm = 0, longest_s = 0;
  for (int i = 0; i < 24; ++i) {
    Truth truth;
    truth.phase_rad = i * 2 * std::numbers::pi / 24;
    truth.skewness = 0.1;
    Rendezvous rendezvous({.motion = {.reading_sd_mm = 0.3}, .gate_breathing = true});
    double left_mm = 100, t_s = 0;
    rendezvous.restart(at(0), truth(0));
    for (; left_mm > 0 && t_s < 100; t_s += kStep_s) {
      rendezvous.observe(at(t_s), truth(t_s) + Eigen::Vector3d(noise(rng), noise(rng), noise(rng)));
      rendezvous.plan(at(t_s), left_mm, kRate_mm_s);
      left_mm -= kStep_s * std::min(kRate_mm_s, rendezvous.rate_limit_mm_s(at(t_s), left_mm));
      if (left_mm < 1e-2) break;
    }
    const double halves = 2 * (truth.hz * t_s + truth.phase_rad / (2 * std::numbers::pi) - 0.25);
    worst_mm = std::max(worst_mm, (rendezvous.target_mm() - truth(t_s)).norm());
    EXPECT_NEAR(halves, std::round(halves), 0.2) << i;
    longest_s = std::max(longest_s, t_s);
  }
  std::cout << "seed " << kSeed << ", 24 phases: aimed at most " << worst_mm << " mm beside the target, after at most "
            << longest_s << " s\n";
  EXPECT_LT(worst_mm, 0.5);
  EXPECT_LT(longest_s, 100 / (0.8 * kRate_mm_s) + 1 / 0.23 + 1);
}

}  // namespace
}  // namespace bevel::controller
