// SPDX-License-Identifier: MIT
#pragma once
// A filter's state as a replay keeps it, one for each actuator state of a log: the lower half of the symmetric
// covariance, and nothing of effects. Half the memory of a FilterState; fetching that from the system took a quarter of
// a replay's time.
#include <array>

#include <bevel/estimator/needle_filter.hpp>

namespace bevel::analysis {

class KeptState {
 public:
  KeptState() = default;
  KeptState(const estimator::FilterState& state);  // implicit: it is the same thing, packed

  // All of it but FilterState::effects.
  estimator::FilterState unpacked() const;

  model::Pose pose;
  double curvature_per_mm = 0;
  double lambda1_per_rad = 0;
  double lambda2 = 0;
  double wheelbase_mm = 0;
  double bending_mm = 0;
  std::int64_t measurement_utime = 0;
  std::int64_t reading_utime = 0;
  std::int32_t rejects_in_row = 0;
  std::int32_t reset_count = 0;
  bool outside_model = false;

 private:
  static constexpr int kSize = 10;  // the nine and the tenth
  std::array<double, kSize*(kSize + 1) / 2> covariance_{};
};

}  // namespace bevel::analysis
