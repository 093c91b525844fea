// SPDX-License-Identifier: MIT
// What the headings of cameras bring: insertions whose pictures are rendered and tracked, through the filter with their
// headings and without. `study_headings [INSERTIONS [SEED]]`.
//
// Headings go in three ways: left out; as of the needle's own axis, which is wrong by the slip angle; as of the shaft
// (EstimatorConfig::shaft_cameras). Errors of neighbouring frames are alike, so their white equivalent over many frames
// is what the filter must be told: a floor of the standard deviation, as floor_heading_rad of a [[camera]].
// A second table is of a filter that begins with the needle deep in the tissue and sees it stand still: there the
// positions say nothing of the attitude.
#include <cstdio>
#include <cstdlib>

#include <bevel/estimator/needle_estimator.hpp>
#include "tests/estimator/play.hpp"
#include "tests/estimator/rendered_insertion.hpp"

namespace bevel::estimator {
namespace {

using testing::RenderedInsertion;

struct Drawn {
  model::NeedleParameters needle;
  RenderedInsertion seen;
};

Drawn draw(const Prior& prior, std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0, 1);
  for (;;) {
    const model::NeedleParameters needle = testing::draw_needle(prior, rng);
    model::OwnValues own;
    own.tilt_x_rad = prior.tilt_sd_rad * normal(rng);
    own.tilt_y_rad = prior.tilt_sd_rad * normal(rng);
    own.roll_rad = prior.roll_sd_rad * normal(rng);
    own.entry_x_mm = prior.position_sd_mm * normal(rng);
    own.entry_y_mm = prior.position_sd_mm * normal(rng);
    RenderedInsertion seen = testing::watch(needle, own, {}, rng());
    if (seen.data.in_domain) return {needle, std::move(seen)};
  }
}

// How alike errors of one camera are, so many frames apart.
void print_errors(const std::vector<Drawn>& all) {
  constexpr std::size_t kLags = 60;
  std::array<double, kLags> product{}, pairs{};
  double of_shaft = 0, of_body = 0, claimed = 0, count = 0;
  for (const Drawn& drawn : all) {
    const auto& errors = drawn.seen.heading_errors;  // the two cameras in turn
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const testing::HeadingError& e = errors[i];
      of_shaft += e.of_shaft_rad * e.of_shaft_rad / (e.claimed_rad * e.claimed_rad);
      of_body += e.of_body_rad * e.of_body_rad / (e.claimed_rad * e.claimed_rad);
      claimed += e.claimed_rad * e.claimed_rad;
      ++count;
      for (std::size_t k = 0; k < kLags && i + 2 * k < errors.size(); ++k)
        if (errors[i + 2 * k].camera == e.camera)
          product[k] += e.of_shaft_rad * errors[i + 2 * k].of_shaft_rad, ++pairs[k];
    }
  }
  const double variance = product[0] / pairs[0];
  double sum = 1;
  for (std::size_t k = 1; k < kLags; ++k) sum += 2 * product[k] / pairs[k] / variance;
  std::printf("%.0f headings: RMSE %.4f rad, claimed %.4f; normalised squared error of the shaft %.2f, of R e3 %.2f\n",
              count, std::sqrt(variance), std::sqrt(claimed / count), of_shaft / count, of_body / count);
  std::printf("errors 1, 3, 5, 10 frames apart: correlation %.2f %.2f %.2f %.2f; white equivalent %.4f rad\n",
              product[1] / pairs[1] / variance, product[3] / pairs[3] / variance, product[5] / pairs[5] / variance,
              product[10] / pairs[10] / variance, std::sqrt(variance * sum));
}

enum class Taken { not_at_all, as_axis, as_shaft };

EstimatorConfig config_for(EstimatorConfig config, Taken taken) {
  if (taken == Taken::as_shaft) config.shaft_cameras = {0, 1};
  return config;
}

std::vector<model::TipHeading> headings_of(const Drawn& drawn, Taken taken, double floor_rad) {
  if (taken == Taken::not_at_all) return {};
  std::vector<model::TipHeading> headings = drawn.seen.data.headings;
  for (std::size_t i = 0; i < headings.size(); ++i) {
    const double claimed = drawn.seen.heading_errors[i].claimed_rad;
    headings[i].information_per_rad2 *= claimed * claimed / (claimed * claimed + floor_rad * floor_rad);
  }
  return headings;
}

struct Sums {
  std::array<double, 6> errors{}, variances{};  // squares: x and y of the tip, tilt, roll, k, lambda2
  double attitude_nees = 0, nis = 0, axes = 0, rejected = 0;
  int runs = 0;

  void end(const FilterState& state, const Drawn& drawn, const model::Pose& pose) {
    const Vector9d e = testing::error_of(state, pose, drawn.needle);
    const auto P = state.covariance.diagonal();
    const auto add = [this](std::size_t i, double squares, double variance) {
      errors.at(i) += squares, variances.at(i) += variance;
    };
    add(0, e.head<2>().squaredNorm(), P[0] + P[1]);
    add(1, e.segment<2>(3).squaredNorm(), P[3] + P[4]);
    add(2, e[5] * e[5], P[5]);
    add(3, e[6] * e[6], P[6]);
    add(4, e[8] * e[8], P[8]);
    Eigen::Matrix<double, 5, 1> part;
    part << e.head<2>(), e.segment<3>(3);
    Eigen::Matrix<double, 5, 5> C;
    const std::array<Eigen::Index, 5> at{0, 1, 3, 4, 5};
    for (std::size_t r = 0; r < 5; ++r)
      for (std::size_t c = 0; c < 5; ++c)
        C(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = state.covariance(at[r], at[c]);
    attitude_nees += part.dot(C.ldlt().solve(part)) / 5;
    ++runs;
  }
  void print(const char* name) const {
    std::printf("%-28s", name);
    for (const std::size_t i : {0U, 1U, 2U})
      std::printf(" %.4f (%.4f)", std::sqrt(errors.at(i) / runs), std::sqrt(variances.at(i) / runs));
    std::printf(" %.2e (%.1e) %.4f (%.4f)  %.2f", std::sqrt(errors[3] / runs), std::sqrt(variances[3] / runs),
                std::sqrt(errors[4] / runs), std::sqrt(variances[4] / runs), attitude_nees / runs);
    if (axes > 0) std::printf("  %.3f, %.0f rejected", nis / axes, rejected);
    std::printf("\n");
  }
  static void take(void* context, const NeedleEstimator::Applied& a) {
    if (a.heading == nullptr) return;
    auto& sums = *static_cast<Sums*>(context);
    sums.nis += a.update.mahalanobis2, sums.axes += a.update.rank, sums.rejected += a.update.accepted ? 0 : 1;
  }
};

void whole(const EstimatorConfig& config, const Drawn& drawn, const std::vector<model::TipHeading>& headings,
           Sums& sums) {
  NeedleEstimator estimator(config);
  estimator.observe(&Sums::take, &sums);
  testing::Insertion data = drawn.seen.data;
  data.headings = headings;
  testing::play(estimator, data, 30'000);
  sums.end(estimator.estimate(data.actuators.back().utime).state, drawn, data.final_pose);
}

// The filter begins where 70 mm are inserted, and the axes stand: the pictures of half a millimetre of the insertion
// are what it gets of a needle at rest, with the noise of fifteen frames.
void deep(EstimatorConfig config, const Drawn& drawn, const std::vector<model::TipHeading>& headings, Sums& sums) {
  constexpr double kDeep_mm = 70, kSeen_mm = 0.5;
  config.start_at_axes = true;
  NeedleEstimator estimator(config);
  estimator.observe(&Sums::take, &sums);
  testing::Insertion data;
  for (std::size_t i = 0; i < drawn.seen.data.actuators.size(); ++i) {
    const model::ActuatorState& a = drawn.seen.data.actuators[i];
    if (a.insertion_mm < kDeep_mm || a.insertion_mm > kDeep_mm + kSeen_mm) continue;
    data.actuators.push_back(a);
    data.final_pose = drawn.seen.data.poses[i];
  }
  const auto inside = [&data](const auto& m) {
    return m.utime > data.actuators.front().utime && m.utime < data.actuators.back().utime;
  };
  std::ranges::copy_if(drawn.seen.data.measurements, std::back_inserter(data.measurements), inside);
  std::ranges::copy_if(headings, std::back_inserter(data.headings), inside);
  testing::play(estimator, data);
  sums.end(estimator.estimate(data.actuators.back().utime).state, drawn, data.final_pose);
}

template <class Play>
void table(const char* title, const std::vector<Drawn>& all, const EstimatorConfig& config, const Play& play_one) {
  std::printf(
      "\n%s; RMSE at the end (as the filter claims)\n%-28s tip across, mm   tilt, rad       roll, rad       "
      "k, 1/mm            lambda2          NEES/5  heading NIS\n",
      title, "headings");
  struct Way {
    const char* name;
    Taken taken;
    double floor_rad;
  };
  for (const Way& way :
       {Way{"left out", Taken::not_at_all, 0}, Way{"as the axis, floor 0.03", Taken::as_axis, 0.03},
        Way{"as the shaft, no floor", Taken::as_shaft, 0}, Way{"as the shaft, floor 0.03", Taken::as_shaft, 0.03}}) {
    Sums sums;
    for (const Drawn& drawn : all)
      play_one(config_for(config, way.taken), drawn, headings_of(drawn, way.taken, way.floor_rad), sums);
    sums.print(way.name);
  }
}

}  // namespace
}  // namespace bevel::estimator

int main(int argc, char** argv) {
  using namespace bevel::estimator;
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 40;
  const auto seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 4ULL;
  std::mt19937_64 rng(seed);
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};  // the plant is the model
  std::vector<Drawn> all;
  for (int i = 0; i < runs; ++i) all.push_back(draw(config.prior, rng));
  std::printf("%d insertions, seed %llu\n", runs, seed);
  print_errors(all);
  table("from the entry, 100 mm", all, config, whole);
  table("begun at 70 mm, half a millimetre seen", all, config, deep);
}
