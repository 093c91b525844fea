// SPDX-License-Identifier: MIT
// The needle filter beside its peers on the same insertions, and on a plant that is not its model. Prints two tables.
#include <Eigen/Cholesky>
#include <ctime>
#include <iomanip>
#include <iostream>

#include <bevel/estimator/needle_estimator.hpp>
#include <bevel/model/beam/beam_plant.hpp>
#include "tests/estimator/batch_map.hpp"
#include "tests/estimator/insertion.hpp"
#include "tests/estimator/ukf.hpp"

namespace bevel::estimator {
namespace {

using testing::Insertion;

struct Sums {
  const char* name;
  double nees = 0, squares = 0, nis = 0, seconds = 0;
  long axes = 0, rejected = 0;
  int runs = 0;

  void end(const FilterState& state, const Insertion& data, const model::NeedleParameters& truth) {
    Vector9d error;
    error << model::log_se3(state.pose.inverse() * data.final_pose), truth.curvature_per_mm - state.curvature_per_mm,
        truth.lambda1_per_rad - state.lambda1_per_rad, truth.lambda2 - state.lambda2;
    nees += error.dot(state.covariance.ldlt().solve(error));
    squares += (state.pose.p_mm - data.final_pose.p_mm).squaredNorm();
    ++runs;
  }
  void print() const {
    std::cout << std::left << std::setw(34) << name << std::right << std::fixed << std::setprecision(4) << std::setw(10)
              << std::sqrt(squares / runs) << std::setprecision(3) << std::setw(10) << nees / (9 * runs)
              << std::setw(10);
    axes > 0 ? std::cout << nis / static_cast<double>(axes) : std::cout << "-";
    std::cout << std::setw(12) << 1e3 * seconds / runs << "\n";
  }
};

double now_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

template <class Predict, class Update>
void in_order(const Insertion& data, Predict&& predict, Update&& update) {
  std::size_t next = 0;
  for (std::size_t i = 1; i < data.actuators.size(); ++i) {
    const auto& a = data.actuators[i - 1];
    const auto& b = data.actuators[i];
    double done = 0;
    for (; next < data.measurements.size() && data.measurements[next].utime <= b.utime; ++next) {
      const auto& m = data.measurements[next];
      const double share = static_cast<double>(m.utime - a.utime) / static_cast<double>(b.utime - a.utime);
      predict((share - done) * (b.insertion_mm - a.insertion_mm), (share - done) * (b.rotation_rad - a.rotation_rad));
      done = share;
      update(m);
    }
    predict((1 - done) * (b.insertion_mm - a.insertion_mm), (1 - done) * (b.rotation_rad - a.rotation_rad));
  }
}

void estimate(const EstimatorConfig& config, const Insertion& data, Sums& sums, FilterState& state) {
  const double start = now_s();
  NeedleEstimator estimator(config);
  estimator.observe(
      [](void* context, const NeedleEstimator::Applied& a) {
        auto& s = *static_cast<Sums*>(context);
        s.rejected += a.update.accepted ? 0 : 1;
        if (a.update.accepted) s.nis += a.update.mahalanobis2, s.axes += a.update.rank;
      },
      &sums);
  std::size_t next = 0;
  for (const auto& actuator : data.actuators) {
    while (next < data.measurements.size() && data.measurements[next].utime < actuator.utime)
      estimator.add(data.measurements[next++]);
    estimator.add(actuator);
  }
  state = estimator.estimate(data.actuators.back().utime).state;
  sums.seconds += now_s() - start;
}

void against_peers(int runs, unsigned seed) {
  EstimatorConfig config;
  config.prior.needle.lambda1_per_rad = 0.49;
  config.prior.needle.lambda2 = 0.22;
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};
  EstimatorConfig once = config;
  once.relinearised_steps = 0;
  Sums ekf{"extended, derivatives taken once"}, full{"extended, past run again (default)"}, ukf{"unscented"},
      batch{"batch maximum a posteriori"};
  std::mt19937_64 rng(seed);
  for (int run = 0; run < runs; ++run) {
    testing::InsertionPlan plan;
    plan.cameras = 1 + run % 2;
    plan.lost_share = 0.1;
    const auto [truth, data, redrawn] = testing::draw_insertion(config.prior, plan, rng);
    FilterState state;
    estimate(once, data, ekf, state);
    ekf.end(state, data, truth);
    estimate(config, data, full, state);
    full.end(state, data, truth);
    double start = now_s();
    testing::Ukf unscented(config);
    in_order(
        data, [&](double mm, double rad) { unscented.predict(mm, rad); },
        [&](const model::TipMeasurement& m) {
          ukf.nis += unscented.update(m);
          ukf.axes += (m.information_per_mm2.diagonal().array() > 0).count();
        });
    ukf.seconds += now_s() - start;
    ukf.end(unscented.state(), data, truth);
    start = now_s();
    const FilterState map = testing::solve_batch_map(config, data).state;
    batch.seconds += now_s() - start;
    batch.end(map, data, truth);
  }
  std::cout << runs << " insertions of the kinematic plant, seed " << seed << "\n"
            << "                                   RMSE (mm)    NEES/9  NIS/axis  ms a piece\n";
  for (const Sums* s : {&ekf, &full, &ukf, &batch}) s->print();
}

// The same insertion by the beam: 100 mm at 10 mm/s, the shaft turned to and fro.
Insertion insert_beam(const model::BeamPlantConfig& config, double sigma_mm, std::mt19937_64& rng) {
  Insertion out;
  model::BeamPlant plant(config);
  double rotation_rad = 0;
  for (int ms = 0; ms <= 10'000; ++ms) {
    const std::int64_t utime = testing::kStart_utime + std::int64_t{1000} * ms;
    const double rate = (ms / 2000) % 2 ? -0.6 : 0.6;
    if (ms % 10 == 0) {
      model::ActuatorState a;
      a.utime = utime;
      a.insertion_mm = ms * 0.01;
      a.rotation_rad = rotation_rad;
      out.actuators.push_back(a);
    }
    if (ms % 33 == 7)
      out.measurements.push_back(
          testing::measure(plant.tip_position_mm(), utime, ms / 33, 0, {1, 1, 1}, sigma_mm, rng));
    out.final_pose = {plant.tip_rotation(), plant.tip_position_mm()};
    plant.advance(0.01, rate * 1e-3, 1e-3);
    rotation_rad += rate * 1e-3;
  }
  return out;
}

void on_beam(int runs, unsigned seed) {
  std::cout << "\n"
            << runs << " insertions of the beam plant, seed " << seed << ", 2-100 kPa, 0.2-1 N\n"
            << "process noise                     RMSE (mm)  pose NEES/6  NIS/axis  rejected\n";
  for (const double scale : {0.0, 1.0, 4.0}) {
    EstimatorConfig config;
    config.prior.needle = {0.002, 20, 0.144, 0.032, {}, {}};
    config.process.position_mm *= scale;
    config.process.tilt_rad *= scale;
    config.process.roll_rad *= scale;
    config.process.curvature_per_mm *= scale;
    config.process.lambda1_per_rad *= scale;
    config.process.lambda2 *= scale;
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    Sums sums{""};
    double pose_nees = 0, squares = 0;
    for (int run = 0; run < runs; ++run) {
      model::BeamPlantConfig beam;
      beam.foundation_modulus_kPa = 2 * std::pow(50.0, unit(rng));
      beam.bevel_force_N = 0.2 + 0.8 * unit(rng);
      const Insertion data = insert_beam(beam, 0.15, rng);
      FilterState state;
      estimate(config, data, sums, state);
      const model::Vector6d error = model::log_se3(state.pose.inverse() * data.final_pose);
      pose_nees += error.dot(state.covariance.topLeftCorner<6, 6>().ldlt().solve(error));
      squares += (state.pose.p_mm - data.final_pose.p_mm).squaredNorm();
    }
    std::cout << std::setprecision(3) << "times " << std::setw(5) << std::left << scale << std::right << std::setw(32)
              << std::sqrt(squares / runs) << std::setw(13) << pose_nees / (6 * runs) << std::setw(10)
              << sums.nis / static_cast<double>(sums.axes) << std::setw(10) << sums.rejected << "\n";
  }
}

}  // namespace
}  // namespace bevel::estimator

int main(int argc, char** argv) {
  const int runs = argc > 1 ? std::atoi(argv[1]) : 200;
  if (runs < 1) {
    std::cerr << "usage: study_estimator [insertions]\n";
    return 2;
  }
  bevel::estimator::against_peers(runs, 4);
  bevel::estimator::on_beam(std::max(1, runs / 5), 4);
}
