// SPDX-License-Identifier: MIT
// The parts of the beam plant against closed forms: band solver, beam, springs of the cut, wind-up.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include <bevel/error.hpp>
#include <bevel/model/beam/band_ldlt.hpp>
#include <bevel/model/beam/cut_path.hpp>
#include <bevel/model/beam/hermite_beam.hpp>
#include <bevel/model/beam/windup.hpp>

namespace bevel::model {
namespace {

constexpr double kEI_N_mm2 = 1.6e4;

TEST(BandLdlt, AgreesWithADenseSolverOnRandomMatrices) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (const int n : {1, 2, 3, 4, 5, 40}) {
    BandLdlt band(64);
    const auto size = static_cast<std::size_t>(n);
    band.reset(size);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXcd b(n);
    std::vector<std::complex<double>> x(64);
    for (int i = 0; i < n; ++i) {
      for (int j = std::max(0, i - 3); j <= i; ++j) {
        const double value = i == j ? 7.0 : uniform(random);  // dominant diagonal: positive definite
        band.add(static_cast<std::size_t>(i), static_cast<std::size_t>(j), value);
        dense(i, j) = dense(j, i) = value;
      }
      b(i) = {uniform(random), uniform(random)};
      x[static_cast<std::size_t>(i)] = b(i);
    }
    band.factor();
    band.solve(x);
    const Eigen::VectorXcd expected = dense.ldlt().solve(b);
    for (int i = 0; i < n; ++i) EXPECT_LT(std::abs(x[static_cast<std::size_t>(i)] - expected(i)), 1e-13);
  }
}

TEST(BandLdlt, RefusesWhatIsNotDefiniteOrTooLarge) {
  BandLdlt band(2);
  EXPECT_THROW(band.reset(3), bevel::DomainError);
  band.reset(2);
  band.add(0, 0, 1.0);
  band.add(1, 0, 2.0);
  band.add(1, 1, 1.0);
  EXPECT_THROW(band.factor(), bevel::DomainError);
}

TEST(HermiteBeam, CantileverHasTheTextbookDeflectionAndSlope) {
  HermiteBeam beam(kEI_N_mm2, 2.0, 13.0, 100.0);
  for (const double tip_mm : {-5.0, 0.3, 41.7, 100.0}) {
    beam.set_tip(tip_mm);
    const Lateral force_N(0.3, -0.4);
    beam.add_force(tip_mm, force_N);
    beam.solve();
    const double l = tip_mm + 13.0;
    EXPECT_LT(std::abs(beam.displacement_mm(tip_mm) - force_N * (l * l * l / (3.0 * kEI_N_mm2))), 1e-9);
    EXPECT_LT(std::abs(beam.slope(tip_mm) - force_N * (l * l / (2.0 * kEI_N_mm2))), 1e-11);
  }
}

// Hetenyi: a long beam on a foundation k, loaded by P at its end. At x from the end, with lambda^4 = k / (4 EI):
// w = 2 P lambda / k exp(-lambda x) cos(lambda x), and the slope at the end is 2 P lambda^2 / k.
struct HetenyiError {
  double displacement_mm;
  double slope;
};

HetenyiError hetenyi_error(double element_mm, double cell_mm) {
  constexpr double kLength_mm = 400.0;
  constexpr double kModulus_N_mm2 = 0.1;
  constexpr double kForce_N = 0.7;
  const double lambda = std::pow(kModulus_N_mm2 / (4.0 * kEI_N_mm2), 0.25);
  CutPath tissue({kModulus_N_mm2, 0.0, 1.0}, cell_mm, kLength_mm);
  tissue.cut(0.0, {}, kLength_mm, {});
  HermiteBeam beam(kEI_N_mm2, element_mm, 0.0, kLength_mm);
  beam.set_tip(kLength_mm);
  tissue.add_springs(beam, 0.0);
  beam.add_force(kLength_mm, kForce_N);
  beam.solve();
  HetenyiError error{0.0, std::abs(beam.slope(kLength_mm) - 2.0 * kForce_N * lambda * lambda / kModulus_N_mm2)};
  for (int i = 0; i < 55; ++i) {
    const double x = 3.7 * i;
    const double w = 2.0 * kForce_N * lambda / kModulus_N_mm2 * std::exp(-lambda * x) * std::cos(lambda * x);
    error.displacement_mm = std::max(error.displacement_mm, std::abs(beam.displacement_mm(kLength_mm - x) - w));
  }
  return error;
}

TEST(HermiteBeam, EndLoadOnAnElasticFoundationIsHetenyis) {
  const auto error = hetenyi_error(2.0, 0.5);  // of 0.49 mm and 0.0175
  EXPECT_LT(error.displacement_mm, 5e-5);
  EXPECT_LT(error.slope, 5e-6);
}

TEST(HermiteBeam, HalvingTheMeshConvergesToHetenyi) {
  EXPECT_LT(hetenyi_error(2.0, 1.0).displacement_mm, 0.3 * hetenyi_error(4.0, 2.0).displacement_mm);
  EXPECT_LT(hetenyi_error(1.0, 0.5).displacement_mm, 0.3 * hetenyi_error(2.0, 1.0).displacement_mm);
  // Long elements alone, fine cells: the error of the elements, not of the cells.
  EXPECT_LT(hetenyi_error(10.0, 0.1).displacement_mm, 0.15 * hetenyi_error(20.0, 0.1).displacement_mm);
}

TEST(HermiteBeam, IsReciprocal) {  // Maxwell-Betti: w at a for a force at b equals w at b for the same force at a
  const auto at_for = [](double at_mm, double force_mm) {
    HermiteBeam beam(kEI_N_mm2, 2.0, 7.0, 80.0);
    beam.set_tip(79.1);
    for (int i = 0; i < 158; ++i) beam.add_spring(0.25 + 0.5 * i, 0.01 + 5e-5 * i, 0.0);
    beam.add_force(force_mm, 1.0);
    beam.solve();
    return beam.displacement_mm(at_mm).real();
  };
  EXPECT_NEAR(at_for(30.3, 79.0), at_for(79.0, 30.3), 1e-12);
  EXPECT_GT(std::abs(at_for(30.3, 79.0)), 1e-3);
}

// A shaft that is fed, drawn back and fed again by drawn steps while its force turns: the beam that keeps what is
// settled beside one that is built anew each time.
TEST(HermiteBeam, WhatIsKeptOfTheProblemBeforeIsTheSameToTheLastDigit) {
  constexpr unsigned kSeed = 5;
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const double cell_mm : {0.5, 0.7}) {
    CutPath tissue({0.05, 0.0, 1.0}, cell_mm, 100.0);
    HermiteBeam kept(kEI_N_mm2, 2.0, 15.0, 100.0);
    double tip_mm = 0.0, settled_mm = 0.0, most_kept_mm = -15.0;
    Lateral at_mm;
    for (int i = 0; i < 1500; ++i) {
      const double from_mm = tip_mm;
      const bool back = i % 500 > 400;
      tip_mm = std::clamp(tip_mm + (back ? -0.6 : 0.4) * uniform(random), -10.0, 100.0);
      const double before_mm = settled_mm;
      settled_mm = tissue.settled_mm(tip_mm);
      kept.set_tip(tip_mm, std::min(before_mm, settled_mm));
      most_kept_mm = std::max(most_kept_mm, kept.kept_mm());
      HermiteBeam anew(kEI_N_mm2, 2.0, 15.0, 100.0);
      anew.set_tip(tip_mm);
      for (HermiteBeam* beam : {&kept, &anew}) {
        tissue.add_springs(*beam, 0.005);
        beam->add_force(tip_mm, std::polar(0.8, 0.01 * i));
        beam->solve();
      }
      for (const double share : {0.0, 0.2, 0.6, 0.9, 1.0}) {
        const double z_mm = -15.0 + share * (tip_mm + 15.0);
        ASSERT_EQ(kept.displacement_mm(z_mm), anew.displacement_mm(z_mm)) << "seed " << kSeed << ", step " << i;
      }
      const Lateral tip_at_mm = kept.displacement_mm(tip_mm);
      tissue.cut(from_mm, at_mm, tip_mm, tip_at_mm);
      at_mm = tip_at_mm;
    }
    EXPECT_GT(most_kept_mm, 60.0) << "something was kept";
  }
}

TEST(HermiteBeam, RefusesATipOutsideItsRoom) {
  HermiteBeam beam(kEI_N_mm2, 2.0, 5.0, 50.0);
  EXPECT_THROW(beam.set_tip(-5.0), bevel::DomainError);
  EXPECT_THROW(beam.set_tip(51.0), bevel::DomainError);
}

TEST(CutPath, AnchorsAreWhereTheTipFirstPassed) {
  CutPath tissue({0.02, 0.0, 1.0}, 0.5, 20.0);
  const auto at = [](double z) { return Lateral(0.3 * z, -0.1 * z); };
  for (int i = 0; i < 70; ++i) tissue.cut(0.13 * i, at(0.13 * i), 0.13 * (i + 1), at(0.13 * (i + 1)));
  EXPECT_NEAR(tissue.front_mm(), 9.1, 1e-12);
  ASSERT_EQ(tissue.size(), 19U);
  tissue.cut(2.0, Lateral(50.0), 8.0, Lateral(50.0));  // a second passage
  for (std::size_t c = 0; c < tissue.size(); ++c) {
    EXPECT_LT(std::abs(tissue.anchor_mm(c) - at(tissue.cell_centre_mm(c))), 1e-12);
  }
}

TEST(CutPath, SpringForceDecaysWithTheSetTimeAtConstantStretch) {
  // A beam without bending stiffness to speak of, on one cell, held by a very stiff spring at 1 mm: e = 1 from the
  // start.
  constexpr double kStiff = 1e9;
  constexpr double kTime_s = 2.0;
  const TissueSpring spring{0.05, 0.4, kTime_s};
  CutPath tissue(spring, 4.0, 4.0);
  tissue.cut(0.0, {}, 4.0, {});
  HermiteBeam beam(1e-6, 4.0, 0.0, 4.0);
  double t_s = 0.0;
  for (const double dt_s : {0.0, 0.1, 0.7, 1.2, 5.0}) {
    beam.set_tip(4.0);
    tissue.add_springs(beam, dt_s);
    beam.add_spring(2.0, kStiff, kStiff * Lateral(1.0));
    beam.solve();
    tissue.relax(beam, dt_s);
    t_s += dt_s;
    const double force_N = kStiff * (1.0 - beam.displacement_mm(2.0).real());
    const double expected_N = 4.0 * 0.05 * (0.6 + 0.4 * std::exp(-t_s / kTime_s));
    EXPECT_NEAR(force_N, expected_N, 1e-5) << "t = " << t_s;
  }
}

TEST(Windup, TipStandsStillInsideTheDeadBand) {
  Windup windup(0.5);
  EXPECT_DOUBLE_EQ(windup.lag_rad(100.0), 0.5);
  EXPECT_DOUBLE_EQ(windup.lag_rad(50.0), 0.125);
  EXPECT_DOUBLE_EQ(windup.lag_rad(-1.0), 0.0);
  EXPECT_DOUBLE_EQ(windup.follow(0.4, 100.0), 0.0);
  EXPECT_DOUBLE_EQ(windup.follow(2.0, 100.0), 1.5);
  EXPECT_DOUBLE_EQ(windup.follow(1.1, 100.0), 1.5);  // reversed by less than 2 x 0.5
  EXPECT_DOUBLE_EQ(windup.follow(0.0, 100.0), 0.5);
  EXPECT_DOUBLE_EQ(windup.follow(0.0, 50.0), 0.125);  // a shorter shaft holds less
}

}  // namespace
}  // namespace bevel::model
