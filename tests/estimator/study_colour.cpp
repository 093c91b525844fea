// SPDX-License-Identifier: MIT
// How alike the errors of neighbouring frames are, and what that does to the filter. `study_colour WHAT [N [SEED]]`:
//   frames    autocorrelation of the tip's error in rendered and tracked frames, N insertions a row
//   colour    N insertions of the kinematic plant whose readings' errors are alike, the shaft turned to and fro or on
//             and on: consistency of the filter, told of it in several ways
//   rendered  the same of rendered and tracked insertions, and with half turns
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <numbers>
#include <string>

#include <bevel/estimator/needle_estimator.hpp>
#include "tests/estimator/coloured.hpp"
#include "tests/estimator/play.hpp"
#include "tests/estimator/rendered_insertion.hpp"

namespace bevel::estimator {
namespace {

using testing::Insertion;
using testing::RenderedInsertion;
using testing::RenderedPlan;

EstimatorConfig exact_model() {
  EstimatorConfig config = testing::agar_config();
  config.process = {1e-6, 1e-8, 1e-8, 1e-8, 1e-9, 1e-9, 1e-9};  // the plant is the model
  return config;
}

struct Drawn {
  model::NeedleParameters needle;
  RenderedInsertion seen;
};
Drawn draw_rendered(const Prior& prior, const RenderedPlan& plan, std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0, 1);
  for (;;) {
    const model::NeedleParameters needle = testing::draw_needle(prior, rng);
    model::OwnValues own;
    own.tilt_x_rad = prior.tilt_sd_rad * normal(rng);
    own.tilt_y_rad = prior.tilt_sd_rad * normal(rng);
    own.roll_rad = prior.roll_sd_rad * normal(rng);
    own.entry_x_mm = prior.position_sd_mm * normal(rng);
    own.entry_y_mm = prior.position_sd_mm * normal(rng);
    RenderedInsertion seen = testing::watch(needle, own, plan, rng());
    if (seen.data.in_domain) return {needle, std::move(seen)};
  }
}

// The needle and the roll of config/demo.toml's rig, which the filter of that file does not know.
Drawn demo_rendered(const Prior& prior, const RenderedPlan& plan, std::mt19937_64& rng) {
  model::NeedleParameters needle = prior.needle;
  needle.curvature_per_mm = 0.0052, needle.lambda1_per_rad = 0.40, needle.lambda2 = 0.17;
  model::OwnValues own;
  own.roll_rad = 0.05;
  return {needle, testing::watch(needle, own, plan, rng())};
}

// Products of errors so many frames apart, of one axis of one camera; the mean is left in: no filter knows it.
struct Alike {
  static constexpr int kLags = 61;
  std::array<double, kLags> product{}, pairs{};
  double sum = 0, claimed = 0;

  void add(const std::map<int, double>& by_frame, int from, int to) {
    for (const auto& [frame, error] : by_frame) {
      if (frame < from || frame >= to) continue;
      sum += error;
      for (int k = 0; k < kLags; ++k)
        if (const auto other = by_frame.find(frame + k); other != by_frame.end() && other->first < to)
          product.at(k) += error * other->second, ++pairs.at(k);
    }
  }
  double at(int lag) const { return product.at(lag) / pairs.at(lag) / (product[0] / pairs[0]); }
  double rms() const { return std::sqrt(product[0] / pairs[0]); }
};

void print_alike(const char* name, const Alike& a, double frame_s, double mm_s) {
  std::printf("  %-6s rms %.4f mean %+.4f |", name, a.rms(), a.sum / a.pairs[0]);
  for (const int lag : {1, 2, 3, 4, 6, 8, 10, 15, 20, 30, 60}) std::printf(" %.2f", a.at(lag));
  // Where it falls through 1/e.
  double lag = 0;
  for (int k = 1; k < Alike::kLags; ++k)
    if (a.at(k) < 1 / std::numbers::e) {
      lag = k - 1 + (a.at(k - 1) - 1 / std::numbers::e) / (a.at(k - 1) - a.at(k));
      break;
    }
  std::printf(" | 1/e at %.1f frames, %.3f s, %.2f mm\n", lag, lag * frame_s, lag * frame_s * mm_s);
}

void frames(int runs, std::uint64_t seed) {
  struct Row {
    double mm_s, hz, rad_s;
    bool one_way;
    double rest_s;
  };
  std::printf("%d insertions a row, seed %llu; lags 1 2 3 4 6 8 10 15 20 30 60 frames\n", runs,
              static_cast<unsigned long long>(seed));
  for (const Row& row :
       {Row{10, 30, 0.6, false, 0}, Row{5, 30, 0.6, false, 0}, Row{20, 30, 0.6, false, 0}, Row{10, 60, 0.6, false, 0},
        Row{10, 15, 0.6, false, 0}, Row{10, 30, 0, false, 0}, Row{5, 30, 8, true, 0}, Row{10, 30, 0.6, false, 4}}) {
    RenderedPlan plan;
    plan.rate_mm_s = row.mm_s, plan.frame_rate_hz = row.hz, plan.rotation_rate_rad_s = row.rad_s;
    plan.one_way = row.one_way, plan.rest_s = row.rest_s;
    std::mt19937_64 rng(seed);
    Alike y, z, x, z1;
    double both = 0, z_square = 0, z1_square = 0;
    for (int run = 0; run < runs; ++run) {
      const Drawn drawn = draw_rendered(exact_model().prior, plan, rng);
      std::map<int, double> ys, zs, xs, z1s;
      for (const testing::TipError& e : drawn.seen.tip_errors) {
        if (e.camera == 0) ys[e.frame] = e.error_mm.y(), zs[e.frame] = e.error_mm.z();
        if (e.camera == 1) xs[e.frame] = e.error_mm.x(), z1s[e.frame] = e.error_mm.z();
      }
      const int frame_of_rest = static_cast<int>(plan.length_mm / plan.rate_mm_s * plan.frame_rate_hz) + 2;
      // The first 15 mm are left out where it moves: the shaft is still short.
      const int from = row.rest_s > 0 ? frame_of_rest : static_cast<int>(0.15 * frame_of_rest);
      const int to = row.rest_s > 0 ? 1 << 20 : frame_of_rest;
      y.add(ys, from, to), z.add(zs, from, to), x.add(xs, from, to), z1.add(z1s, from, to);
      for (const auto& [frame, e] : zs)
        if (const auto other = z1s.find(frame); other != z1s.end())
          both += e * other->second, z_square += e * e, z1_square += other->second * other->second;
    }
    std::printf("%g mm/s, %g Hz, %g rad/s %s%s; z of both cameras correlate %.2f\n", row.mm_s, row.hz, row.rad_s,
                row.one_way ? "on and on" : "to and fro", row.rest_s > 0 ? ", at rest afterwards" : "",
                both / std::sqrt(z_square * z1_square));
    const double frame_s = 1 / row.hz;
    print_alike("0, y", y, frame_s, row.mm_s), print_alike("1, x", x, frame_s, row.mm_s);
    print_alike("0, z", z, frame_s, row.mm_s), print_alike("1, z", z1, frame_s, row.mm_s);
    std::fflush(stdout);
  }
}

// Of many insertions at their ends.
struct Sums {
  double pose = 0, parameters = 0, nees = 0, tip2 = 0, nis = 0, axes = 0, rejected = 0, k_by_sd = 0;
  Vector9d squares = Vector9d::Zero(), claimed = Vector9d::Zero();
  int runs = 0, relinearised = 0;

  void end(const FilterState& state, const model::Pose& pose_at_end, const model::NeedleParameters& truth) {
    const Vector9d e = testing::error_of(state, pose_at_end, truth);
    const Matrix9d& P = state.covariance;
    nees += e.dot(P.ldlt().solve(e)) / 9;
    pose += e.head<6>().dot(P.topLeftCorner<6, 6>().ldlt().solve(e.head<6>())) / 6;
    parameters += e.tail<3>().dot(P.bottomRightCorner<3, 3>().ldlt().solve(e.tail<3>())) / 3;
    k_by_sd += -e[6] / std::sqrt(P(6, 6));
    squares += e.cwiseAbs2(), claimed += P.diagonal();
    tip2 += e.head<3>().squaredNorm();
    ++runs;
  }
  static void take(void* context, const NeedleEstimator::Applied& a) {
    auto& sums = *static_cast<Sums*>(context);
    if (a.heading) return;
    a.update.accepted ? void((sums.nis += a.update.mahalanobis2, sums.axes += a.update.rank)) : void(++sums.rejected);
  }
  void print(const char* name) const {
    const auto rms = [this](int i) { return std::sqrt(squares[i] / runs); };
    const auto sd = [this](int i) { return std::sqrt(claimed[i] / runs); };
    std::printf(
        "  %-46s NEES: all %.3f pose %.3f parameters %.3f | NIS %.3f rejected %.0f | tip %.4f mm, "
        "roll %.3f (%.3f) k %.2e (%.2e, %+.2f sd) l1 %.3f (%.3f) l2 %.4f (%.4f)  rerun %d\n",
        name, nees / runs, pose / runs, parameters / runs, nis / std::max(axes, 1.0), rejected, std::sqrt(tip2 / runs),
        rms(5), sd(5), rms(6), sd(6), k_by_sd / runs, rms(7), sd(7), rms(8), sd(8), relinearised / std::max(runs, 1));
    std::fflush(stdout);
  }
};

void run(const EstimatorConfig& config, const Insertion& data, const model::NeedleParameters& truth, Sums& sums) {
  NeedleEstimator estimator(config);
  estimator.observe(&Sums::take, &sums);
  testing::play(estimator, data, 50'000);
  sums.relinearised += static_cast<int>(estimator.counters().relinearised);
  sums.end(estimator.estimate(data.actuators.back().utime).state, data.final_pose, truth);
}

EstimatorConfig told(EstimatorConfig config, const ReadingNoise& noise) {
  config.reading = noise;
  return config;
}

// Each reading as a white one of what it is worth to a filter that has no states for what it shares with others.
Insertion as_white(Insertion data, const ReadingNoise& noise) {
  const NeedleFilter filter(told({}, noise));
  std::map<int, std::int64_t> last;
  for (model::TipMeasurement& m : data.measurements) {
    if (const auto before = last.find(m.camera); before != last.end())
      m.information_per_mm2 *=
          filter.worth(filter.forgotten(0, 0, static_cast<double>(m.utime - before->second) * 1e-6));
    last[m.camera] = m.utime;
  }
  return data;
}

void print(const char* title, const std::map<std::string, Sums>& sums) {
  std::printf("%s\n", title);
  for (const auto& [name, one] : sums) one.print(name.c_str());
}

void coloured(int runs, std::uint64_t seed) {
  constexpr double kSigma_mm = 0.15, kShare = 0.8;
  std::printf("%d insertions a row, seed %llu, rho from frame to frame of 33 ms of %g of the variance\n", runs,
              static_cast<unsigned long long>(seed), kShare);
  for (const bool on_and_on : {false, true})
    for (const double rho : {0.0, 0.6, 0.9}) {
      testing::InsertionPlan plan;
      plan.cameras = 2, plan.lost_share = 0.1;
      if (on_and_on) plan.one_way = true, plan.rate_mm_s = 5, plan.rotation_rate_rad_s = 8;
      ReadingNoise noise;
      if (rho > 0) noise = {.correlated_share = kShare, .correlation_s = -0.033 / std::log(rho)};
      plan.sigma_mm = kSigma_mm * std::sqrt(1 - noise.correlated_share);
      std::map<std::string, Sums> sums;
      std::mt19937_64 rng(seed);
      for (int i = 0; i < runs; ++i) {
        auto drawn = testing::draw_insertion(exact_model().prior, plan, rng);
        testing::colour(drawn.data, {noise.correlated_share, noise.correlation_s}, kSigma_mm, plan.rate_mm_s, rng);
        run(exact_model(), drawn.data, drawn.needle, sums["taken for white"]);
        run(exact_model(), as_white(drawn.data, noise), drawn.needle, sums["white, of what it is worth"]);
        run(told(exact_model(), noise), drawn.data, drawn.needle, sums["told"]);
      }
      char title[96];
      std::snprintf(title, sizeof title, "rho %.1f, %s", rho, on_and_on ? "on and on, 5 mm/s, 8 rad/s" : "to and fro");
      print(title, sums);
    }
}

// A tracker's own claim, less sure by a floor of the standard deviation.
Insertion with_floors(Insertion data, double across_mm, double along_mm) {
  for (model::TipMeasurement& m : data.measurements)
    for (int i = 0; i < 3; ++i) {
      double& information = m.information_per_mm2(i, i);
      const double floor = i == 2 ? along_mm : across_mm;
      if (information > 0) information = 1 / (1 / information + floor * floor);
    }
  for (model::TipMeasurement& m : data.measurements)  // cameras along the axes of {A}
    m.information_per_mm2 = Eigen::Vector3d(m.information_per_mm2.diagonal()).asDiagonal();
  return data;
}

void rendered(int runs, std::uint64_t seed) {
  struct Row {
    const char* name;
    double mm_s, rad_s;
    bool one_way;
    double half_turn_each_s;
    bool demo = false;
  };
  for (const Row& row :
       {Row{"to and fro", 10, 0.6, false, 0}, Row{"on and on", 5, 8, true, 0}, Row{"half turns", 5, 8, false, 2},
        Row{"the demo's needle, half turns", 10, 8, false, 1, true}}) {
    RenderedPlan plan;
    plan.rate_mm_s = row.mm_s, plan.rotation_rate_rad_s = row.rad_s;
    plan.one_way = row.one_way, plan.half_turn_each_s = row.half_turn_each_s;
    plan.tracker.floor_across_mm = 0.005, plan.tracker.floor_along_mm = 0.02;
    std::map<std::string, Sums> sums;
    std::mt19937_64 rng(seed);
    const ReadingNoise noise{.correlated_share = 0.8, .correlation_mm = 2, .correlation_rad = 1.2};
    const ReadingNoise long_noise{.correlated_share = 0.8, .correlation_mm = 10, .correlation_rad = 1.2};
    const ReadingNoise of_demo{.correlated_share = 0.5, .correlation_mm = 3, .correlation_rad = 1.2};  // its file's
    for (int i = 0; i < runs; ++i) {
      Drawn drawn = (row.demo ? demo_rendered : draw_rendered)(exact_model().prior, plan, rng);
      drawn.seen.data.headings.clear();
      const Insertion& data = drawn.seen.data;
      for (const bool exact : {true, false}) {
        const EstimatorConfig config = exact ? exact_model() : testing::agar_config();
        const std::string process = exact ? ", no process noise" : ", process noise";
        run(config, data, drawn.needle, sums["taken for white" + process]);
        run(config, with_floors(data, 0.05, 0.08), drawn.needle, sums["floors 0.05 0.08" + process]);
        run(told(config, noise), data, drawn.needle, sums["told 0.8, 2 mm, 1.2 rad" + process]);
        run(told(config, long_noise), with_floors(data, 0.02, 0.02), drawn.needle,
            sums["floors 0.02, told 0.8, 10 mm" + process]);
        run(told(config, of_demo), with_floors(data, 0.02, 0.02), drawn.needle,
            sums["floors 0.02, told 0.5, 3 mm (demo)" + process]);
      }
    }
    char title[128];
    std::snprintf(title, sizeof title, "%s, %g mm/s, %g rad/s: %d rendered insertions, seed %llu", row.name, row.mm_s,
                  row.rad_s, runs, static_cast<unsigned long long>(seed));
    print(title, sums);
  }
}

}  // namespace
}  // namespace bevel::estimator

int main(int argc, char** argv) {
  using namespace bevel::estimator;
  const char* what = argc > 1 ? argv[1] : "";
  const int runs = argc > 2 ? std::max(1, std::atoi(argv[2])) : 20;
  const auto seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 4ULL;
  if (std::strcmp(what, "frames") == 0) return frames(runs, seed), 0;
  if (std::strcmp(what, "colour") == 0) return coloured(runs, seed), 0;
  if (std::strcmp(what, "rendered") == 0) return rendered(runs, seed), 0;
  std::fprintf(stderr, "usage: study_colour frames|colour|rendered [INSERTIONS [SEED]]\n");
  return 2;
}
