// SPDX-License-Identifier: MIT
#pragma once
// Sums over readings that were predicted, recording by recording, and the figures of them.
#include <limits>

#include <bevel/diagnosis/inference/predictive.hpp>
#include <bevel/diagnosis/mismatch/findings.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>

namespace bevel::diagnosis {

// Of a recording along which the model's needle leaves the model's domain.
inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Over the readings of one recording.
struct Sums {
  double squares = 0, largest = 0, positions = 0;  // of positions, mm
  double chi2 = 0, log_density = 0, count = 0;
};
inline Sums not_predicted() {
  return {.squares = kNone, .largest = kNone, .positions = 1, .chi2 = kNone, .log_density = kNone, .count = 1};
}
FitFigures figures_of(const std::vector<Sums>& all);

// Of readings that were predicted one by one, over recordings; one way of prediction.
class PredictionSums {
 public:
  explicit PredictionSums(const NeedleSystem& system);
  void add(const inference::SeriesSet& recording, const inference::Forecast& forecast);
  PredictionFigures figures() const;

 private:
  struct Channel {
    double squares = 0, inside = 0, count = 0;
  };
  const RecordedCase* recorded_;
  std::vector<Channel> channels_;
  double log_density_ = 0;
};

// As new insertions and continued ones.
class InsertionSums {
 public:
  explicit InsertionSums(const NeedleSystem& system) : whole_(system), beyond_(system), continued_(system) {}
  void add(const inference::SeriesSet& recording, const inference::Forecasts& one);
  InsertionPredicted figures() const;

 private:
  PredictionSums whole_, beyond_, continued_;
};

}  // namespace bevel::diagnosis
