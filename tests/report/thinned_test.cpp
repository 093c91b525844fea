// SPDX-License-Identifier: MIT
// Thinning against its promise: every extreme stays, nothing aliases, gaps stay gaps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <bevel/report/figure.hpp>
#include <bevel/report/thinned.hpp>

namespace bevel::report {
namespace {

constexpr unsigned kSeed = 20261123;

TEST(Thinned, short_series_stay_as_they_are) {
  EXPECT_EQ(thinned({3, 1, 2}, 12), (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_TRUE(thinned(std::vector<double>{}, 12).empty());
}

TEST(Thinned, keeps_extremes_ends_and_order_within_its_bound) {
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t count = 50 + random() % 5000, most = 12 + random() % 300;
    std::vector<double> values(count);
    for (double& v : values) v = normal(random);
    values[random() % count] = 30;   // one sample that must be seen
    values[random() % count] = -30;  // and another (or the same)
    const auto kept = thinned(values, most);
    ASSERT_LE(kept.size(), std::max(most, count <= most ? count : most));
    ASSERT_TRUE(std::is_sorted(kept.begin(), kept.end()));
    ASSERT_TRUE(std::adjacent_find(kept.begin(), kept.end()) == kept.end());
    ASSERT_EQ(kept.front(), 0U);
    ASSERT_EQ(kept.back(), count - 1);
    for (const double extreme :
         {*std::min_element(values.begin(), values.end()), *std::max_element(values.begin(), values.end())})
      ASSERT_TRUE(std::any_of(kept.begin(), kept.end(), [&](std::size_t i) { return values[i] == extreme; }));
  }
}

// Within every stretch of the series, not only over all of it: the envelope of an oscillation stays.
TEST(Thinned, keeps_the_envelope) {
  std::vector<double> values;
  for (int i = 0; i < 20000; ++i) values.push_back((1 + i / 5000.0) * std::sin(2.0 * i));
  const auto kept = thinned(values, 400);
  for (std::size_t from = 0; from + 1000 <= values.size(); from += 1000) {
    double all = 0, shown = 0;
    for (std::size_t i = from; i < from + 1000; ++i) all = std::max(all, values[i]);
    for (const std::size_t i : kept)
      if (i >= from && i < from + 1000) shown = std::max(shown, values[i]);
    // What is largest at the end of these may be outdone within its stretch, of 200 samples, by as much as it grows.
    EXPECT_NEAR(shown, all, 200 / 5000.0 + 0.01) << "from " << from;
  }
}

// Two cameras that take turns, of which only one sees x: by counting, every second reading or a multiple of it would
// drop all of one.
TEST(Thinned, two_sources_that_take_turns_both_stay) {
  for (const std::size_t count : {1000U, 1024U, 3000U, 3138U, 4800U})  // 3138: stretches of 32, a multiple of 2 and 4
    for (const std::size_t period : {2U, 3U, 4U}) {
      std::vector<double> values(count);
      for (std::size_t i = 0; i < count; ++i)
        values[i] = i % period == 1 ? std::nan("") : static_cast<double>(i % period);
      const auto kept = thinned(values, 400);
      for (std::size_t source = 0; source < period; ++source)
        EXPECT_GE(std::count_if(kept.begin(), kept.end(), [&](std::size_t i) { return i % period == source; }), 40)
            << count << " samples, period " << period << ", source " << source;
    }
}

TEST(Thinned, figures_keep_the_ends_of_bands_and_the_keys_of_their_samples) {
  std::vector<double> x, low, high;
  for (int i = 0; i < 9000; ++i) {
    x.push_back(i);
    low.push_back(i == 4321 ? -50 : -1);
    high.push_back(i == 1234 ? 70 : 1);
  }
  Figure figure;
  figure.band("b", x, low, high);
  figure.series[0].key = x;
  const Figure few = thinned(figure, 300);
  const Series& s = few.series[0];
  EXPECT_LE(s.x.size(), 300U);
  EXPECT_EQ(s.key, s.x);
  EXPECT_EQ(*std::min_element(s.y.begin(), s.y.end()), -50);
  EXPECT_EQ(*std::max_element(s.y_high.begin(), s.y_high.end()), 70);
  EXPECT_EQ(range_of_y(few), range_of_y(figure));
}

}  // namespace
}  // namespace bevel::report
