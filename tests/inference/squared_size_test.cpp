// SPDX-License-Identifier: MIT
// Sums of squares of normals with means, against exact distributions and draws.
#include <bevel/diagnosis/inference/squared_size.hpp>

#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/non_central_chi_squared.hpp>
#include <cmath>
#include <random>

namespace bevel::inference {
namespace {

TEST(SquaredSize, OfEqualWeightsIsTheChiSquare) {
  for (const double squared_mean : {0.0, 0.7, 9.0}) {
    SquaredSize size;
    for (int i = 0; i < 5; ++i) size.add(0.5, squared_mean);
    for (const double value : {0.5, 2.0, 6.0, 40.0}) {
      const double exact =
          squared_mean > 0
              ? boost::math::cdf(complement(boost::math::non_central_chi_squared(5, 5 * squared_mean), value / 0.5))
              : boost::math::cdf(complement(boost::math::chi_squared(5), value / 0.5));
      EXPECT_NEAR(size.above(value), exact, 1e-6) << squared_mean << " " << value;
    }
  }
}

// Four cumulants say least of the tail below, where one weight is far above the others.
TEST(SquaredSize, OfAnyIsThatOfDraws) {
  constexpr unsigned kSeed = 20091;
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  for (int trial = 0; trial < 8; ++trial) {
    const Eigen::VectorXd mean = 2 * Eigen::VectorXd::NullaryExpr(6, draw);
    const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(6, 6, draw);
    const Eigen::MatrixXd half = Eigen::MatrixXd::NullaryExpr(4, 6, draw);  // of rank 4
    const Eigen::MatrixXd square = half.transpose() * half;
    const SquaredSize size(mean, root * root.transpose(), square);
    constexpr int kDraws = 40000;
    int above[3] = {0, 0, 0};
    double sum = 0;
    for (int i = 0; i < kDraws; ++i) {
      const double one = (half * (mean + root * Eigen::VectorXd::NullaryExpr(6, draw))).squaredNorm();
      sum += one / kDraws;
      for (int k = 0; k < 3; ++k)
        above[k] += one > std::array{0.3, 1.0, 2.0}[static_cast<std::size_t>(k)] * size.mean();
    }
    EXPECT_NEAR(size.mean(), sum, 0.03 * sum) << kSeed;
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(size.above(std::array{0.3, 1.0, 2.0}[static_cast<std::size_t>(k)] * size.mean()),
                  static_cast<double>(above[k]) / kDraws, k == 0 ? 0.08 : 0.03)
          << kSeed << ", trial " << trial;
  }
}

TEST(SquaredSize, KnownForSureIsAboveOrNot) {
  const Eigen::VectorXd mean{{3, 4}};
  const SquaredSize size(mean, 1e-10 * Eigen::MatrixXd::Identity(2, 2), Eigen::MatrixXd::Identity(2, 2));
  EXPECT_NEAR(size.above(24.9), 1, 1e-9);
  EXPECT_NEAR(size.above(25.1), 0, 1e-9);
  EXPECT_EQ(SquaredSize().above(1), 0);
}

}  // namespace
}  // namespace bevel::inference
