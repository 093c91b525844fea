// SPDX-License-Identifier: MIT
// A needle that is drawn back goes through the channel it has cut, and inserted again to its front: the filter against
// the kinematic plant, which remembers poses, and the beam, which remembers where its tissue was cut.
#include <gtest/gtest.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <iostream>

#include "tests/estimator/drawn_back.hpp"
#include "tests/estimator/play.hpp"
#include "tests/support/count_allocations.hpp"

namespace bevel::estimator {
namespace {

using testing::Insertion;
using testing::kAgain;
using testing::kBack;
using testing::kIn;

EstimatorConfig agar_config() {
  EstimatorConfig config = testing::agar_config();
  config.through_channel = true;
  return config;
}

// Of a needle that turns from the start: one that goes in straight for 35 mm and is then turned over at rest is taken
// for known too well by the past that is run again, drawn back or not.
const std::vector<testing::Leg> kTurning{{35, 4}, {0, 3.14}, {20, -2}, {12, 2.2}, {0, -1.3}, {13, 0.5}};

// Gives an estimator what is new in the data.
class Feed {
 public:
  explicit Feed(NeedleEstimator& estimator) : estimator_(estimator) {}
  FilterState operator()(const Insertion& data) {
    for (; axes_ < data.actuators.size(); ++axes_) {
      estimator_.add(data.actuators[axes_]);
      for (; readings_ < data.measurements.size() && data.measurements[readings_].utime <= data.actuators[axes_].utime;
           ++readings_)
        estimator_.add(data.measurements[readings_]);
    }
    return estimator_.estimate(data.actuators.back().utime).state;
  }

 private:
  NeedleEstimator& estimator_;
  std::size_t axes_ = 0, readings_ = 0;
};

struct Far {
  double in_mm = 0, back_mm = 0, again_mm = 0;
};

// The tip's largest error from the axes alone, on the way in, back and again.
Far far_off(const EstimatorConfig& config, rig::Plant& plant) {
  const NeedleFilter filter(config);
  FilterState state = filter.initial();
  Far far;
  for (const auto& [legs, largest] : {std::pair(&kIn, &far.in_mm), {&kBack, &far.back_mm}, {&kAgain, &far.again_mm}})
    testing::follow(*legs, [&, error_mm = largest](double mm, double rad) {
      plant.advance(mm, rad, 0.01);
      filter.predict(state, mm, rad);
      *error_mm = std::max(*error_mm, (filter.tip_pose(state).p_mm - plant.tip().p_mm).norm());
    });
  return far;
}

void print(const char* what, const Far& with, const Far& without) {
  std::cout << what << ": largest error of the tip going in " << with.in_mm << " mm, drawn back 30 mm " << with.back_mm
            << ", again " << with.again_mm << "; without the channel " << without.back_mm << ", " << without.again_mm
            << "\n";
}

TEST(Channel, IsGoneThroughFromTheAxesAlone) {
  const EstimatorConfig config = agar_config();
  EstimatorConfig without = config;
  without.through_channel = false;
  const auto plant = [&] { return rig::KinematicPlant(config.prior.needle, {}, 0, {}, rig::Cut::kept); };
  auto one = plant(), other = plant();
  const Far far = far_off(config, one), far_without = far_off(without, other);
  print("kinematic", far, far_without);
  EXPECT_LT(far.in_mm, 0.001);
  EXPECT_LT(far.back_mm, 0.01);
  EXPECT_LT(far.again_mm, 0.01);
  EXPECT_GT(far_without.back_mm, 1) << "it would do without";
  // A plant that forgets its cut is what the filter without the channel believes in.
  rig::KinematicPlant forgets(config.prior.needle);
  EXPECT_LT(far_off(without, forgets).again_mm, 0.001);
}

model::BeamPlantConfig beam_of(double modulus_kPa, double force_N) {
  model::BeamPlantConfig beam;
  beam.foundation_modulus_kPa = modulus_kPa;
  beam.bevel_force_N = force_N;
  beam.max_depth_mm = 150;
  return beam;
}

EstimatorConfig config_for(const model::BeamPlantConfig& beam) {
  EstimatorConfig config;
  config.through_channel = true;
  config.prior.needle = rig::bicycle_of(beam);
  config.prior.curvature_sd_per_mm = 0.2 * config.prior.needle.curvature_per_mm;
  config.prior.lambda1_sd_per_rad = config.prior.lambda2_sd = 0;
  config.prior.bending_mm = std::pow(4 * beam.bending_stiffness_N_mm2 / (1e-3 * beam.foundation_modulus_kPa), 0.25);
  config.prior.bending_sd_mm = 0.2 * config.prior.bending_mm;
  config.prior.guide_mm = beam.guide_gap_mm;
  return config;
}

TEST(Channel, IsWhereTheBeamGoesToo) {
  for (const auto& [modulus, force] : {std::pair{100.0, 0.3}, {100.0, 1.0}, {50.0, 1.0}, {20.0, 0.5}}) {
    const model::BeamPlantConfig beam = beam_of(modulus, force);
    const EstimatorConfig config = config_for(beam);
    EstimatorConfig without = config;
    without.through_channel = false;
    rig::BeamNeedle one(beam), other(beam);
    const Far far = far_off(config, one), far_without = far_off(without, other);
    print((std::to_string(modulus) + " kPa, " + std::to_string(force) + " N").c_str(), far, far_without);
    EXPECT_LT(far.back_mm, 0.3) << modulus;
    EXPECT_LT(far.again_mm, 0.3) << modulus;
    EXPECT_GT(far_without.back_mm, 3 * far.back_mm) << modulus;
  }
}

// Numerically, for nine states, ten with ell, and ten of a stiff shaft; the channel is that of the state in the middle.
TEST(Channel, DerivativesAgreeWithPerturbation) {
  EstimatorConfig ell = agar_config(), stiff = config_for(beam_of(30, 0.8));
  ell.prior.wheelbase_sd_mm = 4;
  std::mt19937_64 rng(61);
  std::normal_distribution<double> normal(0, 1);
  for (EstimatorConfig config : {ell, stiff}) {
    config.process = {0, 0, 0, 0, 0, 0, 0};
    config.midpoint_derivatives = false;
    const NeedleFilter filter(config);
    FilterState state = filter.initial();
    for (int i = 0; i < 100; ++i) filter.predict(state, 0.3, 0.1 * normal(rng));
    filter.predict(state, -8.3, 0.7);
    if (state.bending_mm > 0) state.pose.p_mm.z() += 600;  // deep, as stiff_shaft_test.cpp
    const auto moved = [&](double step, int column) {
      FilterState s = state;
      move<10>(s, step * Error<10>::Unit(column));
      filter.predict(s, -1.3, 0.12);
      return s;
    };
    for (int column = 0; column < 10; ++column) {
      if (state.bending_mm > 0 && (column == 7 || column == 8)) continue;
      const double step = column == 6 ? 1e-6 : column == 9 ? 1e-3 : 1e-5;
      const FilterState middle = moved(0, column);
      const Error<10> numeric =
          (difference<10>(middle, moved(step, column)) - difference<10>(middle, moved(-step, column))) / (2 * step);
      FilterState s = state;
      set_covariance<10>(s, Covariance<10>(Error<10>::Unit(column).asDiagonal()));
      filter.predict(s, -1.3, 0.12);
      const Covariance<10> square = numeric * numeric.transpose();
      EXPECT_LT((covariance_of<10>(s) - square).norm(), 1e-4 * (1 + square.norm())) << column;
    }
  }
}

// Back and forth in the channel leaves what is known as it was, but for the roll by what turning adds.
TEST(Channel, ComingBackIsAsIfNothingHadBeen) {
  EstimatorConfig config = agar_config();
  config.process = {0, 0, 0, 0, 0, 0, 0};
  const NeedleFilter filter(config);
  FilterState state = filter.initial();
  testing::follow(kIn, [&](double mm, double rad) { filter.predict(state, mm, rad); });
  const FilterState before = state;
  for (const double mm : {-30.0, 12.25, -20.0, 37.75}) filter.predict(state, mm, 0);
  EXPECT_NEAR(state.channel.drawn_back_mm(), 0, 1e-12);
  EXPECT_LT((state.pose.p_mm - before.pose.p_mm).norm(), 1e-3);
  EXPECT_LT((state.covariance - before.covariance).norm(), 1e-3 * before.covariance.norm());
}

TEST(Channel, ShuffledInputGivesTheSameStateBitForBit) {
  constexpr unsigned kSeed = 62;
  std::mt19937_64 rng(kSeed);
  const EstimatorConfig config = agar_config();
  rig::KinematicPlant plant(config.prior.needle, {}, 0, {}, rig::Cut::kept);
  Insertion data;
  testing::record(plant, {{6, 0}, {2, 1.5}, {0, 1}, {-5, 0}, {0, 1}, {7, 0.3}}, 0.15, rng, data);
  NeedleEstimator sorted(config, 4096), shuffled(config, 4096);
  play(sorted, data);
  play_shuffled(shuffled, data, rng);
  const auto now = data.actuators.back().utime;
  const FilterState a = sorted.estimate(now).state, b = shuffled.estimate(now).state;
  EXPECT_GT(shuffled.counters().positions.late, 50);
  EXPECT_EQ(a.pose.p_mm, b.pose.p_mm);
  EXPECT_EQ(a.pose.R, b.pose.R);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.channel.inserted_mm(), b.channel.inserted_mm());
}

// In steps as coarse as a slow bus has: the path of a channel is the same however the bevel turns on the way.
TEST(Channel, TurningOnTheWayIsTurningAtRest) {
  const EstimatorConfig config = agar_config();
  const NeedleFilter filter(config);
  FilterState state = filter.initial();
  rig::KinematicPlant plant(config.prior.needle, {}, 0, {}, rig::Cut::kept);
  const auto step = [&](double mm, double rad) {
    plant.advance(mm, rad, 0.1);
    filter.predict(state, mm, rad);
  };
  testing::follow(kIn, step);
  double far_mm = 0, turned_rad = 0;
  for (const auto& [mm, rad] : {std::pair{-1.0, 0.08}, {1.0, -0.08}, {-1.0, -0.08}})
    for (int i = 0; i < 30; ++i) {
      step(mm, rad);
      far_mm = std::max(far_mm, (state.pose.p_mm - plant.tip().p_mm).norm());
      turned_rad = std::max(turned_rad, model::log_so3(state.pose.R.transpose() * plant.tip().R).norm());
    }
  EXPECT_LT(far_mm, 0.01);
  EXPECT_LT(turned_rad, 1e-3);
}

// With errors that readings share, too: where the model has the tip, a reading of it is no news.
TEST(Channel, OfAStiffShaftWithColouredReadings) {
  EstimatorConfig white = config_for(beam_of(20, 0.5)), coloured = white;
  coloured.reading = {.correlated_share = 0.8, .correlation_mm = 2};
  for (const EstimatorConfig& config : {white, coloured}) {
    const NeedleFilter filter(config);
    FilterState state = filter.initial();
    testing::follow(kIn, [&](double mm, double rad) { filter.predict(state, mm, rad); });
    testing::follow(kBack, [&](double mm, double rad) { filter.predict(state, mm, rad); });
    const Eigen::Vector3d tip_mm = filter.tip_pose(state).p_mm;
    ASSERT_GT((tip_mm - state.pose.p_mm).norm(), 0.5);
    model::TipMeasurement m;
    m.utime = 1;
    m.position_mm = tip_mm;
    m.information_per_mm2 = Eigen::Vector3d(0, 100, 100).asDiagonal();
    const Update update = filter.update(state, m);
    EXPECT_TRUE(update.accepted);
    EXPECT_LT(update.innovation.norm(), 1e-9) << config.reading.correlated_share;
  }
}

// At rest every frame shows the same error, and the past that is run again learns nothing from it; it goes on.
TEST(Channel, HalfATurnAtRestBetweenReadingsThatAreForgottenByInsertion) {
  std::mt19937_64 rng(66);
  EstimatorConfig config = agar_config();
  config.reading = {.correlated_share = 0.8, .correlation_mm = 2};
  rig::KinematicPlant plant(config.prior.needle, {}, 0, {}, rig::Cut::kept);
  NeedleEstimator estimator(config, 256);
  Feed feed(estimator);
  Insertion data;
  std::int64_t ran_again = 0;
  for (int part = 0; part < 3; ++part) {
    testing::record(plant, {{10, 1}, {0, 3.14}, {35, 2}}, 0.15, rng, data);
    const FilterState state = feed(data);
    EXPECT_TRUE(state.pose.p_mm.allFinite() && state.covariance.allFinite());
    EXPECT_LT((state.pose.p_mm - data.final_pose.p_mm).norm(), 0.5);
    const auto so_far = static_cast<std::int64_t>(estimator.counters().relinearised);
    EXPECT_GT(so_far, ran_again) << part;
    ran_again = so_far;
  }
}

// The clock is set while the needle is drawn back: a past that began there would have the tip cut its way to the front.
TEST(Channel, APastThatBeginsDrawnBackBeginsAnewAtTheFront) {
  std::mt19937_64 rng(67);
  const EstimatorConfig config = agar_config();
  rig::KinematicPlant plant(config.prior.needle, {}, 0, {}, rig::Cut::kept);
  NeedleEstimator estimator(config, 128);
  Feed feed(estimator);
  Insertion data;
  for (const auto& legs : {kTurning, kBack}) testing::record(plant, legs, 0.15, rng, data);
  feed(data);
  const auto before = estimator.counters().relinearised;
  estimator.shift_time(1'000'000);
  for (auto& a : data.actuators) a.utime += 1'000'000;
  for (auto& m : data.measurements) m.utime += 1'000'000;
  testing::record(plant, {{0, 1.5}, {30, -0.6}, {45, 1}}, 0.15, rng, data);
  const FilterState state = feed(data);
  EXPECT_GT(estimator.counters().relinearised, before);
  const double nees = testing::nees_of(state, data.final_pose, config.prior.needle);
  std::cout << "NEES " << nees << ", off by " << (state.pose.p_mm - data.final_pose.p_mm).norm() << " mm, run again "
            << estimator.counters().relinearised - before << " times\n";
  EXPECT_LT(nees, boost::math::quantile(boost::math::chi_squared(9), 0.999));
}

TEST(Channel, AllocatesNothing) {
  std::mt19937_64 rng(63);
  for (const bool stiff : {false, true}) {
    const EstimatorConfig config = stiff ? config_for(beam_of(50, 1)) : agar_config();
    rig::KinematicPlant plant(config.prior.needle, {}, 0, {}, rig::Cut::kept);
    Insertion data;
    for (const auto* legs : {&kIn, &kBack, &kAgain}) testing::record(plant, *legs, 0.15, rng, data);
    NeedleEstimator estimator(config);
    const long before = bevel::testing::allocations;
    play(estimator, data, 60'000);
    EXPECT_EQ(bevel::testing::allocations - before, 0);
  }
}

// A needle in tissue that is what the filter's process noise says it is: at each tenth of a millimetre that it cuts,
// pose and parameters take a random step. The channel is where it was.
class WanderingNeedle : public rig::Plant {
 public:
  WanderingNeedle(const model::NeedleParameters& needle, const model::Pose& start, const ProcessNoise& noise,
                  std::mt19937_64& rng)
      : model_(needle), needle_(needle), noise_(noise), rng_(rng), tip_(start), cut_{start} {}
  void advance(double insertion_mm, double rotation_rad, double) override {
    inserted_mm_ += insertion_mm, rolled_rad_ += rotation_rad;
    const auto turned = [&](const model::Pose& pose) {
      return model::Pose{pose.R * model::exp_so3({0, 0, rolled_rad_}), pose.p_mm};
    };
    while (inserted_mm_ >= kStep_mm * static_cast<double>(cut_.size()) - 1e-9)
      cut_.push_back(cut_on(turned(cut_.back())));
    const double at = std::max(inserted_mm_ / kStep_mm, 0.0);
    const auto i = std::min(static_cast<std::size_t>(at), cut_.size() - 1);
    if (i + 1 < cut_.size()) {
      const model::Vector6d to_next = model::log_se3(cut_[i].inverse() * cut_[i + 1]);
      tip_ = turned(cut_[i] * model::exp_se3((at - static_cast<double>(i)) * to_next));
      return;
    }
    tip_ = turned(cut_[i]);
    model::advance(tip_, {inserted_mm_ - kStep_mm * static_cast<double>(i), 0, {needle_.curvature_per_mm, 0}},
                   model::slip_parameters(needle_));
  }
  model::Pose tip() const override { return tip_; }
  std::vector<Eigen::Vector3d> shaft_mm() const override { return {}; }
  const model::AugmentedNeedle& model() const override { return model_; }

 private:
  static constexpr double kStep_mm = 0.1;
  // Unrolled, a step further.
  model::Pose cut_on(model::Pose pose) {
    std::normal_distribution<double> normal(0, std::sqrt(kStep_mm));
    model::advance(pose, {kStep_mm, 0, {needle_.curvature_per_mm, 0}}, model::slip_parameters(needle_));
    model::Vector6d step;
    for (int i = 0; i < 3; ++i) step[i] = noise_.position_mm * normal(rng_);
    step.tail<3>() << noise_.tilt_rad * normal(rng_), noise_.tilt_rad * normal(rng_), noise_.roll_rad * normal(rng_);
    needle_.curvature_per_mm += noise_.curvature_per_mm * normal(rng_);
    needle_.lambda1_per_rad += noise_.lambda1_per_rad * normal(rng_);
    needle_.lambda2 += noise_.lambda2 * normal(rng_);
    pose = pose * model::exp_se3(step);
    return {pose.R * model::exp_so3({0, 0, -rolled_rad_}), pose.p_mm};
  }
  model::AugmentedNeedle model_;
  model::NeedleParameters needle_;
  ProcessNoise noise_;
  std::mt19937_64& rng_;
  double inserted_mm_ = 0, rolled_rad_ = 0;
  model::Pose tip_;
  std::vector<model::Pose> cut_;  // at each step, unrolled
};

TEST(Channel, OfTissueThatIsAsUnevenAsTheFilterTakesIt) {
  constexpr int kRuns = 200;
  constexpr unsigned kSeed = 65;
  EstimatorConfig config = agar_config();
  config.process.roll_per_sqrt_rad = 1e-6;
  Prior& prior = config.prior;
  prior.lambda1_sd_per_rad *= 0.3, prior.lambda2_sd *= 0.3;
  std::mt19937_64 rng(kSeed);
  std::array<double, 4> nees{};
  for (int run = 0; run < kRuns; ++run) {
    const model::NeedleParameters truth = testing::draw_needle(prior, rng);
    WanderingNeedle plant(truth, testing::draw_start(prior, rng), config.process, rng);
    NeedleEstimator estimator(config);
    Insertion data;
    Feed feed(estimator);
    const std::vector<std::vector<testing::Leg>> parts{kTurning, {{0, 1.2}, {-15, 0}}, {{-15, 0}}, kAgain};
    for (std::size_t part = 0; part < 4; ++part) {
      testing::record(plant, parts[part], 0.15, rng, data);
      const FilterState state = feed(data);
      const Error<9> error = testing::error_of(state, data.final_pose, truth);
      const model::Vector6d pose = error.head<6>();
      nees.at(part) += pose.dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(pose)) / (6.0 * kRuns);
    }
  }
  std::cout << "seed " << kSeed << ", " << kRuns << " needles in uneven tissue: pose NEES/6 in " << nees[0]
            << ", drawn back 15 mm " << nees[1] << ", 30 mm " << nees[2] << ", again and beyond " << nees[3] << "\n";
  // One walk in and another back are taken for independent, where the second is the first: wide, and never narrow.
  const double high = boost::math::quantile(boost::math::chi_squared(6.0 * kRuns), 0.975) / (6.0 * kRuns);
  for (const double one : nees) {
    EXPECT_LT(one, high);
    EXPECT_GT(one, 0.6);
  }
}

// The plant is the filter's model with its channel, drawn from the prior; nine degrees of freedom each.
TEST(Channel, TwoHundredNeedlesAreDrawnBackConsistently) {
  constexpr int kRuns = 200;
  constexpr unsigned kSeed = 64;
  EstimatorConfig config = agar_config();
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};  // as in needle_estimator_test.cpp
  Prior& prior = config.prior;
  prior.lambda1_sd_per_rad *= 0.3, prior.lambda2_sd *= 0.3;
  std::mt19937_64 rng(kSeed);
  std::normal_distribution<double> normal(0, 1);
  std::array<double, 3> nees{}, lateral_sd_mm{};
  double ran_again = 0;
  for (int run = 0; run < kRuns; ++run) {
    const model::NeedleParameters truth = testing::draw_needle(prior, rng);
    const model::OwnValues own{.tilt_x_rad = prior.tilt_sd_rad * normal(rng),
                               .tilt_y_rad = prior.tilt_sd_rad * normal(rng),
                               .roll_rad = prior.roll_sd_rad * normal(rng),
                               .entry_x_mm = prior.position_sd_mm * normal(rng),
                               .entry_y_mm = prior.position_sd_mm * normal(rng)};
    rig::KinematicPlant plant(truth, {}, 0, own, rig::Cut::kept);
    NeedleEstimator estimator(config);
    Insertion data;
    Feed feed(estimator);
    for (std::size_t part = 0; part < 3; ++part) {
      testing::record(plant, std::array{kTurning, kBack, kAgain}.at(part), 0.15, rng, data);
      const FilterState state = feed(data);
      nees.at(part) += testing::nees_of(state, data.final_pose, truth) / (9.0 * kRuns);
      lateral_sd_mm.at(part) += std::sqrt(state.covariance(0, 0) + state.covariance(1, 1)) / kRuns;
    }
    ran_again += static_cast<double>(estimator.counters().relinearised) / kRuns;
  }
  const boost::math::chi_squared chi2(9.0 * kRuns);
  const double low = boost::math::quantile(chi2, 0.025) / (9.0 * kRuns),
               high = boost::math::quantile(chi2, 0.975) / (9.0 * kRuns);
  std::cout << "seed " << kSeed << ", " << kRuns << " needles: NEES/9 in " << nees[0] << ", drawn back " << nees[1]
            << ", again and beyond " << nees[2] << ", 95 % band [" << low << ", " << high
            << "]; lateral standard deviation " << lateral_sd_mm[0] << ", " << lateral_sd_mm[1] << ", "
            << lateral_sd_mm[2] << " mm; past run again " << ran_again << " times each\n";
  for (const double one : nees) {
    EXPECT_GT(one, low);
    EXPECT_LT(one, high);
  }
  EXPECT_LT(lateral_sd_mm[1], lateral_sd_mm[0]) << "where it was is known no worse";
}

}  // namespace
}  // namespace bevel::estimator
