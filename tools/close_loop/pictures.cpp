#include <algorithm>
#include <cmath>
#include <numeric>

#include "tools/close_loop/report.hpp"

namespace bevel::close_loop {
namespace {

constexpr double kNear_mm = 0.01;  // no miss is smaller
constexpr double kFar_mm = 5;

std::vector<double> one_to(std::size_t count) {
  std::vector<double> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 1.0);
  return numbers;
}

io::Plot by_recording(std::size_t count, const std::string& title, const std::string& y_label) {
  io::Plot plot;
  plot.title = title;
  plot.x_label = "recording";
  plot.y_label = y_label;
  plot.x_range = {0.5, static_cast<double>(count) + 0.5};
  plot.legend = io::Plot::Legend::top_right;
  return plot;
}

void add(io::Plot& plot, std::size_t stage, const std::vector<double>& values) {
  const auto colour = static_cast<int>(stage);
  plot.line(kStageNames[stage], one_to(values.size()), values, colour);
  plot.points("", one_to(values.size()), values, colour);
}

// From zero where that leaves something to see, else in decades.
void choose_scale(io::Plot& plot) {
  double low = 1e300, high = 0;
  for (const auto& series : plot.series)
    for (const double y : series.y) low = std::min(low, y), high = std::max(high, y);
  plot.log_y = low > 0 && high > 6 * low;
  if (!plot.log_y) plot.y_range = {0, 1.35 * high};  // the legend has the room above
}

}  // namespace

io::Plot rig_picture(const ClosedLoop& loop) {
  io::Plot plot = by_recording(loop.rig[0].recordings.size(), "Rig against recording", "rms error (mm)");
  for (std::size_t s = 0; s < kStages; ++s) {
    std::vector<double> rmse;
    for (const auto& r : loop.rig[s].recordings) rmse.push_back(r.rmse_mm);
    add(plot, s, rmse);
  }
  choose_scale(plot);
  const auto& sigma = loop.findings.noise.sigma;
  double variance = 0;
  for (const double s : sigma) variance += s * s / static_cast<double>(sigma.size());
  plot.references.push_back({io::ReferenceLine::Axis::horizontal, std::sqrt(variance), "camera's noise"});
  return plot;
}

io::Plot estimator_picture(const ClosedLoop& loop) {
  const auto& stages = loop.estimator.known;
  io::Plot plot = by_recording(stages[0].nis_by_recording.size(), "Innovations of the estimator", "NIS per axis");
  for (std::size_t s = 0; s < kStages; ++s) add(plot, s, stages[s].nis_by_recording);
  choose_scale(plot);
  plot.references.push_back({io::ReferenceLine::Axis::horizontal, 1.0, "nothing left out"});
  return plot;
}

io::Plot targeting_picture(const ClosedLoop& loop) {
  io::Plot plot;
  plot.title = "Targeting";
  plot.x_label = "distance of the tip from the target (mm)";
  plot.y_label = "share of insertions (%)";
  plot.y_range = {0, 100};
  plot.legend = io::Plot::Legend::bottom_right;
  for (std::size_t s = 0; s < kStages; ++s) {
    std::vector<double> miss = loop.targeting.live[s].miss_mm, share;
    std::sort(miss.begin(), miss.end());
    plot.log_x = plot.log_x || miss.back() > kFar_mm;  // beside those that were stopped on the way the rest is a line
    miss.insert(miss.begin(), kNear_mm);
    for (std::size_t i = 0; i < miss.size(); ++i)
      share.push_back(100 * static_cast<double>(i) / static_cast<double>(miss.size() - 1));
    plot.step(kStageNames[s], miss, share, static_cast<int>(s));
  }
  return plot;
}

}  // namespace bevel::close_loop
