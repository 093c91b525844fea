// SPDX-License-Identifier: MIT
#pragma once
// What the arrival of a camera's messages tells, beside what they say: whether it still sends, and whether what it
// sends still changes. By the steady clock, so that a wall clock that is set cannot keep a dead camera alive.
#include <array>
#include <bevel/tip_heading_t.hpp>
#include <bevel/tip_measurement_t.hpp>
#include <cstdint>
#include <map>

namespace bevel::nodes {

class CameraWatch {
 public:
  explicit CameraWatch(double silence_s) : silence_ns_(static_cast<std::int64_t>(silence_s * 1e9)) {}

  // insertion_mm: of the axes now.
  void hear(const tip_measurement_t& m, double insertion_mm, std::int64_t now_ns);
  void hear(const tip_heading_t& m, double insertion_mm, std::int64_t now_ns);
  // Bits of bevel/estimator/health.hpp.
  std::int32_t health(std::int64_t now_ns) const;
  // Cameras may be others from here on.
  void restart() { cameras_.clear(); }

 private:
  using Says = std::array<double, 3>;
  void hear(std::int32_t number, std::int32_t status, const Says& says, double insertion_mm, std::int64_t now_ns);

  struct Camera {
    std::int64_t heard_ns = 0;
    Says says{};
    double insertion_mm = 0;  // when it began to say the same
    int repeats = 0;
    bool frozen = false;
  };
  std::int64_t silence_ns_;
  std::map<std::int32_t, Camera> cameras_;  // grows at the first message of each; the port bounds how many
};

}  // namespace bevel::nodes
