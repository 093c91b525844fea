// SPDX-License-Identifier: MIT
#pragma once
// A second client of the engine, with nothing of a needle: a driven pendulum, its angle read by a noisy sensor.
//
//   angle'' = -(g / length) sin(angle) - damping angle' + drive(t) + what is missing
//
// Effects: dry friction, a sensor that reads too large, a knock at an instant of one recording. Recordings start a
// little off the nominal angle (a nuisance). The discrepancy is a torque by the angle. Derivatives by differences:
// a client need not have better ones.
#include <cmath>
#include <random>

#include "tests/inference/held_system.hpp"

namespace bevel::inference::testing {

struct TruePendulum {
  double length_m = 0.5, damping_per_s = 0.15;
  double dry_friction = 0, scale = 1, knock_rad_s = 0;
  double magnet = 0;           // a torque about 0.4 rad, on no list
  double start_sd_rad = 0.01;  // between recordings
  double tail_degrees = 0;     // of Student's t, of the same standard deviation; 0: normal noise
};

class Pendulum final : public HeldSystem {
 public:
  static constexpr int kReadings = 160;
  static constexpr double kFrame_s = 0.05, kSigma_rad = 0.01;
  enum : std::size_t { kDryFriction, kSensorScale, kKnock };

  Pendulum(const TruePendulum& truth, std::size_t recordings, std::uint64_t seed) {
    base_ = {
        {.name = "length_m", .lower = 0.05, .upper = 5, .none = 0, .starts = {}, .prior = normal_prior(0.52, 0.1)},
        {.name = "damping_per_s", .lower = 0, .upper = 5, .none = 0, .starts = {}, .prior = normal_prior(0.1, 0.2)}};
    const double duration_s = kReadings * kFrame_s;
    effects_ = {{.name = "dry_friction",
                 .label = "dry_friction",
                 .parameters = {{.name = "per_s2",
                                 .lower = 0,
                                 .upper = 10,
                                 .none = 0,
                                 .starts = {0.3},
                                 .prior = size_prior(0, 0.75, 0, 10)}}},
                {.name = "sensor_scale",
                 .label = "sensor_scale",
                 .parameters = {{.name = "ratio",
                                 .lower = 0.5,
                                 .upper = 2,
                                 .none = 1,
                                 .starts = {1.05},
                                 .prior = size_prior(1, 0.075, 0.5, 2)}}},
                {.name = "knock",
                 .label = "knock",
                 .parameters = {{.name = "rad_s",
                                 .lower = -5,
                                 .upper = 5,
                                 .none = 0,
                                 .starts = {-0.5, 0.5},
                                 .prior = size_prior(0, 0.75, -5, 5)},
                                {.name = "at_s",
                                 .lower = 0,
                                 .upper = 1e4,
                                 .none = 0,
                                 .starts = {0.0},
                                 .prior = flat_prior(0, duration_s),
                                 .scope = Scope::instant}}}};
    nuisances_ = {{"start_rad", 0}};
    groups_ = {{"start", "rad", {0, 0.005, 0.015, 0.05}}};
    Curve curve{.component = "torque", .unit = "1/s^2", .covariate = "angle_rad", .at = {}};
    for (int i = 0; i < 9; ++i) curve.at.push_back(-1.2 + 0.3 * i);
    curves_ = {curve};

    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    data_.claimed_sd = {kSigma_rad};
    data_.frame_s = kFrame_s;
    for (std::size_t r = 0; r < recordings; ++r) {
      Unknowns u{truth.length_m, truth.damping_per_s};
      u.dry_friction = truth.dry_friction;
      u.scale = truth.scale;
      u.magnet = truth.magnet;
      if (truth.knock_rad_s != 0 && r % 3 == 1)
        u.knock_rad_s = truth.knock_rad_s, u.knock_s = 2.3 + 0.4 * static_cast<double>(r);
      u.start_rad = truth.start_sd_rad * normal(random);
      std::vector<double> measured;
      const Eigen::VectorXd angle = simulate(r, u);
      for (int i = 0; i < kReadings; ++i)
        measured.push_back(angle[i] + kSigma_rad * draw_noise(random, normal, truth.tail_degrees));
      add_recording(measured, kFrame_s);
    }
  }

  bool predict(const ModelSet& set, std::size_t r, const Eigen::VectorXd& shared, const Eigen::VectorXd& local,
               bool derivatives, Prediction& out) const override {
    const auto at = [&](const Eigen::VectorXd& s, const Eigen::VectorXd& l) {
      return simulate(r, unknowns(set, s, l));
    };
    out.reading = at(shared, local);
    if (derivatives) {
      out.by_shared = differences(shared, [&](const Eigen::VectorXd& s) { return at(s, local); });
      out.by_local = differences(local, [&](const Eigen::VectorXd& l) { return at(shared, l); });
    }
    return out.reading.allFinite();
  }
  Eigen::MatrixXd by_curves(std::size_t r, const Eigen::VectorXd& base) const override {
    return differences(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(curves_[0].at.size())),
                       [&](const Eigen::VectorXd& values) {
                         Unknowns u = unknowns({}, base, Eigen::VectorXd::Zero(1));
                         u.curve = values;
                         return simulate(r, u);
                       });
  }

 private:
  struct Unknowns {
    double length_m, damping_per_s, dry_friction = 0, scale = 1, knock_rad_s = 0, knock_s = 0, start_rad = 0,
                                    magnet = 0;
    Eigen::VectorXd curve{};
  };
  static Unknowns unknowns(const ModelSet& set, const Eigen::VectorXd& shared, const Eigen::VectorXd& local) {
    Unknowns u{shared[0], shared[1]};
    u.start_rad = local[0];
    Eigen::Index next = 2;
    for (const std::size_t e : set) {
      double& size = e == kDryFriction ? u.dry_friction : e == kSensorScale ? u.scale : u.knock_rad_s;
      size = shared[next++];
      if (e == kKnock) u.knock_s = local[1];
    }
    return u;
  }
  template <class Function>
  static Eigen::MatrixXd differences(const Eigen::VectorXd& at, Function&& f) {
    Eigen::MatrixXd out(kReadings, at.size());
    for (Eigen::Index i = 0; i < at.size(); ++i) {
      Eigen::VectorXd up = at, down = at;
      up[i] += 1e-5, down[i] -= 1e-5;
      out.col(i) = (f(up) - f(down)) / 2e-5;
    }
    return out;
  }
  double torque_of(const Unknowns& u, double angle) const {
    double torque = u.magnet * std::exp(-std::pow((angle - 0.4) / 0.15, 2));
    for (Eigen::Index i = 0; i < u.curve.size(); ++i)
      torque += u.curve[i] * std::max(0.0, 1 - std::abs(angle - curves_[0].at[static_cast<std::size_t>(i)]) / 0.3);
    return torque;
  }
  // Runge and Kutta's fourth order.
  Eigen::VectorXd simulate(std::size_t r, const Unknowns& u) const {
    constexpr int kSteps = 4;
    constexpr double kStep_s = kFrame_s / kSteps;
    const double drive_rad_s = 2.0 + 0.7 * static_cast<double>(r % 4);
    const auto rate = [&](const Eigen::Vector2d& x, double t) {
      return Eigen::Vector2d(x[1], -9.81 / u.length_m * std::sin(x[0]) - u.damping_per_s * x[1] -
                                       u.dry_friction * std::tanh(x[1] / 0.05) + 2.0 * std::cos(drive_rad_s * t) +
                                       torque_of(u, x[0]));
    };
    Eigen::VectorXd out(kReadings);
    Eigen::Vector2d x(0.6 + u.start_rad, 0);
    for (int i = 0; i < kReadings; ++i) {
      out[i] = u.scale * x[0];
      for (int k = 0; k < kSteps; ++k) {
        const double t = kFrame_s * i + kStep_s * k;
        if (u.knock_s > 0)
          x[1] += u.knock_rad_s * std::clamp((t + kStep_s - u.knock_s) / kStep_s, 0.0, 1.0) -
                  u.knock_rad_s * std::clamp((t - u.knock_s) / kStep_s, 0.0, 1.0);
        const Eigen::Vector2d a = rate(x, t), b = rate(x + 0.5 * kStep_s * a, t + 0.5 * kStep_s);
        const Eigen::Vector2d c = rate(x + 0.5 * kStep_s * b, t + 0.5 * kStep_s),
                              d = rate(x + kStep_s * c, t + kStep_s);
        x += kStep_s / 6 * (a + 2 * b + 2 * c + d);
      }
    }
    return out;
  }
};

}  // namespace bevel::inference::testing
