// SPDX-License-Identifier: MIT
#pragma once
// A system that holds what it is made of; what it predicts is left to each.
#include <cmath>
#include <random>
#include <span>

#include <bevel/diagnosis/inference/system.hpp>

namespace bevel::inference::testing {

// Of standard deviation one; tail_degrees: of Student's t, 0: normal.
inline double draw_noise(std::mt19937_64& random, std::normal_distribution<double>& normal, double tail_degrees) {
  return tail_degrees > 0
             ? std::student_t_distribution<double>(tail_degrees)(random) * std::sqrt((tail_degrees - 2) / tail_degrees)
             : normal(random);
}

class HeldSystem : public System {
 public:
  const Dataset& data() const override { return data_; }
  const std::vector<Parameter>& base() const override { return base_; }
  const std::vector<Effect>& effects() const override { return effects_; }
  const std::vector<Nuisance>& nuisances() const override { return nuisances_; }
  const std::vector<NuisanceGroup>& nuisance_groups() const override { return groups_; }
  const std::vector<Curve>& curves() const override { return curves_; }
  bool allows(const ModelSet&) const override { return true; }

 protected:
  // Of one channel, evenly spaced.
  void add_recording(std::span<const double> measured, double spacing_s) {
    Series series;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      series.message.push_back(i);
      series.time_s.push_back(spacing_s * static_cast<double>(i));
      series.relative_sd.push_back(1);
      series.measured.push_back(measured[i]);
    }
    data_.recordings.push_back({.series = {std::move(series)},
                                .messages = measured.size(),
                                .duration_s = spacing_s * static_cast<double>(measured.size())});
  }

  Dataset data_;
  std::vector<Parameter> base_;
  std::vector<Effect> effects_;
  std::vector<Nuisance> nuisances_;
  std::vector<NuisanceGroup> groups_;
  std::vector<Curve> curves_;
};

}  // namespace bevel::inference::testing
