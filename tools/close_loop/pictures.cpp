#include <algorithm>
#include <numeric>

#include "tools/close_loop/report.hpp"

namespace bevel::close_loop {
namespace {

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
  plot.log_y = true;
  plot.legend = io::Plot::Legend::top_right;
  return plot;
}

void add(io::Plot& plot, std::size_t stage, const std::vector<double>& values) {
  const auto colour = static_cast<int>(stage);
  plot.line(kStageNames[stage], one_to(values.size()), values, colour);
  plot.points("", one_to(values.size()), values, colour);
}

}  // namespace

io::Plot rig_picture(const ClosedLoop& loop) {
  io::Plot plot = by_recording(loop.rig[0].recordings.size(), "Rig against recording", "rms error (mm)");
  for (std::size_t s = 0; s < kStages; ++s) {
    std::vector<double> rmse;
    for (const auto& r : loop.rig[s].recordings) rmse.push_back(r.rmse_mm);
    add(plot, s, rmse);
  }
  const auto& sigma = loop.findings.noise.sigma_mm;
  double variance = 0;
  for (const double s : sigma) variance += s * s / static_cast<double>(sigma.size());
  plot.references.push_back({io::ReferenceLine::Axis::horizontal, std::sqrt(variance), "camera's noise"});
  return plot;
}

io::Plot estimator_picture(const ClosedLoop& loop) {
  const auto& stages = loop.estimator.known;
  io::Plot plot = by_recording(stages[0].nis_by_recording.size(), "Innovations of the estimator", "NIS per axis");
  for (std::size_t s = 0; s < kStages; ++s) add(plot, s, stages[s].nis_by_recording);
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
    miss.insert(miss.begin(), 0);
    for (std::size_t i = 0; i < miss.size(); ++i)
      share.push_back(100 * static_cast<double>(i) / static_cast<double>(miss.size() - 1));
    plot.step(kStageNames[s], miss, share, static_cast<int>(s));
  }
  return plot;
}

}  // namespace bevel::close_loop
