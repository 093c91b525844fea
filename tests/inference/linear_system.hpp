// SPDX-License-Identifier: MIT
#pragma once
// A client of the engine whose evidence is known in closed form: readings linear in everything.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include <bevel/diagnosis/inference/noise.hpp>
#include "tests/inference/held_system.hpp"

namespace bevel::inference::testing {

// One channel, `count` readings a recording at 10 Hz; base: offset and slope; effects: a parabola, a step; a nuisance
// that adds a cosine; one curve of the reading by time, and where something depends on it one by a sawtooth of 0.9 s,
// whose rise the first cannot follow.
class LinearSystem : public HeldSystem {
 public:
  static constexpr int kCount = 60;
  static constexpr double kOffset = 0.3, kSlope = 0.2;
  double sigma = 0.1;
  Eigen::VectorXd input_sd;  // of each recording's readings; empty: none
  // By which the path runs away, in the end, from where base and nuisance are not as recorded, each alike.
  double divergence = 0;

  LinearSystem(std::size_t recordings, std::uint64_t seed, double parabola, double nuisance_sd, double bump,
               double by_sawtooth = 0) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    data_.claimed_sd = {sigma};
    data_.frame_s = 0.1;
    for (std::size_t r = 0; r < recordings; ++r) {
      std::vector<double> measured;
      const double own = nuisance_sd * normal(random);
      for (int i = 0; i < kCount; ++i) {
        const double t = 0.1 * i;
        measured.push_back(kOffset + kSlope * t + parabola * parabola_of(t) + own * std::cos(t) +
                           bump * std::exp(-4 * (t - 3) * (t - 3)) + by_sawtooth * std::sin(6 * sawtooth(t)) +
                           sigma * normal(random));
      }
      add_recording(measured, data_.frame_s);
    }
    base_ = {{.name = "offset", .lower = -10, .upper = 10, .none = 0, .starts = {}, .prior = normal_prior(0, 1)},
             {.name = "slope", .lower = -10, .upper = 10, .none = 0, .starts = {}, .prior = normal_prior(0, 1)}};
    const auto effect = [](const char* name) {
      return Effect{
          .name = name,
          .label = name,
          .parameters = {
              {.name = "size", .lower = -10, .upper = 10, .none = 0, .starts = {0.1}, .prior = normal_prior(0, 0.5)}}};
    };
    effects_ = {effect("parabola"), effect("step")};
    nuisances_ = {{"cosine", 0}};
    groups_ = {{"cosine", "mm", {0.0, 0.2}}};
    Curve curve{.component = "reading", .unit = "mm", .covariate = "time_s", .at = {}};
    for (int i = 0; i < 6; ++i) curve.at.push_back(1.2 * i);
    curves_ = {curve};
    if (by_sawtooth == 0) return;
    curve = {.component = "reading", .unit = "mm", .covariate = "sawtooth", .at = {}};
    for (int i = 0; i < 6; ++i) curve.at.push_back(0.2 * i);
    curves_.push_back(curve);
  }

  // One curve more, over what stands still but for rounding: all of it is an offset.
  void add_still_curve() {
    curves_.push_back({.component = "reading", .unit = "mm", .covariate = "still", .at = curves_.front().at});
    still_ = true;
  }
  void least_size(std::size_t effect, double least) { effects_[effect].parameters[0].lower = least; }

  static Eigen::MatrixXd design(const ModelSet& set) {
    Eigen::MatrixXd out(kCount, 2 + static_cast<Eigen::Index>(set.size()));
    for (int i = 0; i < kCount; ++i) {
      const double t = 0.1 * i;
      out(i, 0) = 1;
      out(i, 1) = t;
      for (std::size_t m = 0; m < set.size(); ++m)
        out(i, 2 + static_cast<Eigen::Index>(m)) = set[m] == 0 ? parabola_of(t) : (t > 2 ? 1 : 0);
    }
    return out;
  }
  static Eigen::MatrixXd cosine() {
    Eigen::MatrixXd out(kCount, 1);
    for (int i = 0; i < kCount; ++i) out(i, 0) = std::cos(0.1 * i);
    return out;
  }
  bool predict(const ModelSet& set, std::size_t, const Eigen::VectorXd& shared, const Eigen::VectorXd& local,
               bool derivatives, Prediction& out) const override {
    Eigen::MatrixXd X = design(set), L = cosine();
    const Eigen::VectorXd away = divergence * (0.1 * Eigen::ArrayXd::LinSpaced(kCount, 1 - kCount, 0)).exp();
    X.leftCols(2).colwise() += away;
    L.colwise() += away;
    out.reading = X * shared + L * local - (kOffset + kSlope) * away;
    if (derivatives) out.by_shared = X, out.by_local = L;
    return true;
  }
  Eigen::VectorXd by_inputs(const ModelSet&, std::size_t, const Eigen::VectorXd&,
                            const Eigen::VectorXd&) const override {
    return input_sd;
  }
  Eigen::MatrixXd by_curves(std::size_t, const Eigen::VectorXd&) const override {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(kCount, 6 * static_cast<int>(curves_.size()));
    for (int i = 0; i < kCount; ++i)
      for (std::size_t c = 0; c < curves_.size(); ++c) {
        const double u = still_ && c + 1 == curves_.size() ? 2.4 + 1e-12 * std::sin(i)
                         : c == 0                          ? 0.1 * i / 1.2
                                                           : sawtooth(0.1 * i) / 0.2;
        const int k = std::min(static_cast<int>(u), 4), first = 6 * static_cast<int>(c);
        out(i, first + k) = 1 - (u - k);
        out(i, first + k + 1) = u - k;
      }
    return out;
  }

 private:
  bool still_ = false;
  static double parabola_of(double t) { return (t - 3) * (t - 3) / 9; }
  static double sawtooth(double t) { return t / 0.9 - std::floor(t / 0.9); }
};

// Recording after recording.
inline Eigen::VectorXd all_readings(const LinearSystem& system) {
  Eigen::VectorXd out(system.data().rows());
  Eigen::Index row = 0;
  for (const auto& recording : system.data().recordings)
    for (const double value : recording.series[0].measured) out[row++] = value;
  return out;
}

// log N(y; 0, C) without the constant of 2 pi.
inline double log_normal(const Eigen::VectorXd& y, const Eigen::MatrixXd& covariance) {
  const Eigen::PartialPivLU<Eigen::MatrixXd> lu(covariance);
  return -0.5 * (y.dot(lu.solve(y)) + lu.matrixLU().diagonal().array().abs().log().sum());
}

// Covariance of all readings: noise, shared parameters, nuisances, the values of all curves.
inline Eigen::MatrixXd covariance_of(const LinearSystem& system, const ModelSet& set, const Noise& noise,
                                     double nuisance_sd, const Eigen::MatrixXd& curve_covariance = {}) {
  const Eigen::Index n = LinearSystem::kCount, rows = system.data().rows();
  const Eigen::MatrixXd X = LinearSystem::design(set), L = LinearSystem::cosine(), C = system.by_curves(0, {});
  Eigen::VectorXd prior(X.cols());
  prior << 1, 1, Eigen::VectorXd::Constant(X.cols() - 2, 0.25);
  Eigen::MatrixXd shared = X * prior.asDiagonal() * X.transpose();
  if (curve_covariance.size() > 0) shared += C * curve_covariance * C.transpose();
  Eigen::MatrixXd out(rows, rows);
  for (Eigen::Index a = 0; a < rows / n; ++a)
    for (Eigen::Index b = 0; b < rows / n; ++b) out.block(a * n, b * n, n, n) = shared;
  for (Eigen::Index a = 0; a < rows / n; ++a)
    out.block(a * n, a * n, n, n) += nuisance_sd * nuisance_sd * L * L.transpose();
  for (Eigen::Index a = 0; a < rows / n; ++a)
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j)
        out(a * n + i, a * n + j) +=
            noise.sigma[0] * noise.sigma[0] * std::pow(noise.ar1, std::abs(static_cast<double>(i - j)));
  return out;
}

// The noise that its readings have.
inline Noise white(const LinearSystem& system) {
  Noise noise;
  noise.sigma = {system.sigma};
  noise.frame_s = 0.1;
  return noise;
}

}  // namespace bevel::inference::testing
