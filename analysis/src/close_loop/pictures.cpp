// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>

#include <bevel/analysis/close_loop/report.hpp>

namespace bevel::analysis {
namespace {

constexpr double kNear_mm = 0.01;  // no miss is smaller
constexpr double kFar_mm = 5;

std::vector<double> one_to(std::size_t count) {
  std::vector<double> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 1.0);
  return numbers;
}

report::Figure by_recording(std::size_t count, const std::string& title, const std::string& y_label) {
  report::Figure figure;
  figure.title = title;
  figure.x_label = "recording";
  figure.link = "recording";
  figure.y_label = y_label;
  figure.x_range = {0.5, static_cast<double>(count) + 0.5};
  return figure;
}

void add(report::Figure& figure, std::size_t stage, const std::vector<double>& values) {
  const auto colour = static_cast<report::Colour>(stage);
  figure.line(kStageNames[stage], one_to(values.size()), values, colour);
  figure.points("", one_to(values.size()), values, colour);
}

// From zero where that leaves something to see, else in decades.
void choose_scale(report::Figure& figure) {
  double low = 1e300, high = 0;
  for (const auto& series : figure.series)
    for (const double y : series.y) low = std::min(low, y), high = std::max(high, y);
  figure.log_y = low > 0 && high > 6 * low;
  if (!figure.log_y) figure.y_range = {0, 1.1 * high};
}

}  // namespace

report::Figure rig_picture(const ClosedLoop& loop) {
  report::Figure figure = by_recording(loop.rig[0].recordings.size(), "Rig against recording", "rms error (mm)");
  for (std::size_t s = 0; s < kStages; ++s) {
    std::vector<double> rmse;
    for (const auto& r : loop.rig[s].recordings) rmse.push_back(r.rmse_mm);
    add(figure, s, rmse);
  }
  choose_scale(figure);
  const auto& sigma = loop.findings.noise.sigma;
  double variance = 0;
  for (const double s : sigma) variance += s * s / static_cast<double>(sigma.size());
  figure.references.push_back({report::Reference::Axis::horizontal, std::sqrt(variance), "camera's noise"});
  return figure;
}

report::Figure estimator_picture(const ClosedLoop& loop) {
  const auto& stages = loop.estimator.known;
  report::Figure figure =
      by_recording(stages[0].nis_by_recording.size(), "Innovations of the estimator", "NIS per axis");
  for (std::size_t s = 0; s < kStages; ++s) add(figure, s, stages[s].nis_by_recording);
  choose_scale(figure);
  figure.references.push_back({report::Reference::Axis::horizontal, 1.0, "nothing left out"});
  return figure;
}

report::Figure targeting_picture(const ClosedLoop& loop) {
  report::Figure figure;
  figure.title = "Targeting";
  figure.x_label = "distance of the tip from the target (mm)";
  figure.y_label = "share of insertions (%)";
  figure.y_range = {0, 100};
  for (std::size_t s = 0; s < kStages; ++s) {
    std::vector<double> miss = loop.targeting.live[s].miss_mm, share;
    std::sort(miss.begin(), miss.end());
    figure.log_x =
        figure.log_x || miss.back() > kFar_mm;  // beside those that were stopped on the way the rest is a line
    miss.insert(miss.begin(), kNear_mm);
    for (std::size_t i = 0; i < miss.size(); ++i)
      share.push_back(100 * static_cast<double>(i) / static_cast<double>(miss.size() - 1));
    figure.step(kStageNames[s], miss, share, static_cast<report::Colour>(s));
  }
  return figure;
}

}  // namespace bevel::analysis
