// SPDX-License-Identifier: MIT
#pragma once
#include <bevel/needle_state_t.hpp>
#include <cmath>
#include <random>

#include <bevel/io/recording.hpp>

namespace bevel::test {

// A recording that a rig could have made, with odd numbers wherever a field allows any.
class OddRecordings {
 public:
  explicit OddRecordings(unsigned seed) : random_(seed) {}

  io::Recording recording() {
    io::Recording r;
    const int samples = whole(2, 40);
    std::int64_t utime = 1 + static_cast<std::int64_t>(whole(0, 1'000'000)) * whole(0, 1'700'000'000);
    for (int i = 0; i < samples; ++i) {
      utime += whole(6'000, 20'000);
      if (i == 0 || coin()) add_axes(r, utime, i);
      if (coin()) add_tip(r, utime - whole(0, 1) * std::min<std::int64_t>(utime - 1, 5'000), i);
      if (coin()) add_heading(r, utime, i);
      if (coin()) r.commands.push_back({utime, i, whole(0, 1), odd(1e5), odd(1e5)});
      if (whole(0, 4) == 0) r.estimates.push_back(needle_state(utime, i));
      if (whole(0, 4) == 0) r.truths.push_back(needle_state(utime, i));
    }
    if (coin()) r.config = "# any text,\n[recording]\nclock = \"none\"\n";
    return r;
  }

 private:
  int whole(int lowest, int highest) { return std::uniform_int_distribution<int>(lowest, highest)(random_); }
  bool coin() { return whole(0, 1) == 1; }
  // All magnitudes, subnormal ones and both zeros among them.
  double odd(double largest) {
    switch (whole(0, 5)) {
      case 0:
        return whole(0, 1) == 0 ? 0.0 : -0.0;
      case 1:
        return 5e-324 * whole(-3, 3);
      case 2:
        return largest * (coin() ? 1 : -1);
      case 3:
        return 0.001 * whole(-1000, 1000) * largest;
      default:
        return largest * std::uniform_real_distribution<double>(-1, 1)(random_) * std::pow(10.0, -whole(0, 30));
    }
  }
  double small(double largest) { return std::uniform_real_distribution<double>(-largest, largest)(random_); }

  void add_axes(io::Recording& r, std::int64_t utime, int i) {
    r.arrivals.push_back({io::Arrival::Channel::actuator, r.actuators.size()});
    r.actuators.push_back({utime, i, {whole(0, 4), whole(0, 4)}, small(0.2), odd(1e5), small(0.09), odd(1e5)});
  }
  void add_tip(io::Recording& r, std::int64_t utime, int i) {
    model::TipMeasurement m{.utime = utime, .seq = i, .camera = 3, .status = whole(0, 2)};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (whole(0, 3) == 0) continue;  // an axis that was not seen
      m.information_per_mm2(axis, axis) = std::uniform_real_distribution<double>(20, 90)(random_);
      m.position_mm[axis] = coin() ? small(40) : -0.0;
    }
    r.arrivals.push_back({io::Arrival::Channel::tip, r.tips.size()});
    r.tips.push_back(m);
  }
  void add_heading(io::Recording& r, std::int64_t utime, int i) {
    model::TipHeading m{.utime = utime, .seq = i, .camera = 15, .status = whole(0, 1)};
    if (m.status == 0 || coin()) {
      m.heading = Eigen::Vector3d(small(1), small(1), 1 + small(0.5)).normalized();
      m.information_per_rad2 = 50 * (Eigen::Matrix3d::Identity() - m.heading * m.heading.transpose());
    }
    r.arrivals.push_back({io::Arrival::Channel::heading, r.headings.size()});
    r.headings.push_back(m);
  }
  needle_state_t needle_state(std::int64_t utime, int i) {
    needle_state_t m{};
    m.utime = utime, m.seq = i, m.measurement_utime = utime / 2;
    for (double& v : m.position_mm) v = odd(1e5);
    const double angle = small(3);
    m.orientation_wxyz[0] = std::cos(angle), m.orientation_wxyz[2] = std::sin(angle);
    m.curvature_per_mm = odd(1), m.lambda1_per_rad = odd(1e3), m.lambda2 = odd(1e3), m.test_ratio = odd(1e12);
    m.rank = whole(0, 3), m.health = whole(0, 1000), m.reset_count = whole(0, 1000);
    constexpr double kSmallestVariance = 1e-150;  // of the checked decode, but for 0
    for (std::size_t k = 0; k < 9; ++k) {
      const double variance = std::abs(odd(1e12));
      m.covariance[10 * k] = variance < kSmallestVariance ? 0.0 : variance;
    }
    return m;
  }

  std::mt19937 random_;
};

}  // namespace bevel::test
