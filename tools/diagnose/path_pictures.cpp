#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tools/diagnose/drawing.hpp"
#include "tools/diagnose/figures.hpp"
#include "tools/diagnose/pictures.hpp"

namespace bevel::diagnose {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)

namespace {

constexpr std::size_t kMostPoints = 220;  // of one path
constexpr double kRow = 160;

std::vector<double> along(const std::vector<Eigen::Vector3d>& path_mm, int axis, const std::vector<std::size_t>& use) {
  std::vector<double> values;
  for (const std::size_t i : use)
    values.push_back(i < path_mm.size() ? path_mm[i][axis] : std::numeric_limits<double>::quiet_NaN());
  return values;
}

void draw_plane(Drawing& drawing, const Box& box, const Trace& trace, int axis, bool last, bool one_model) {
  const std::size_t step = trace.time_s.size() / kMostPoints + 1;
  std::vector<std::size_t> use;
  for (std::size_t i = 0; i < trace.time_s.size(); ++i)
    if (i % step == 0 && (i >= trace.outlier.size() || trace.outlier[i] == 0)) use.push_back(i);
  std::vector<double> all_z;
  std::vector<double> all_lateral;
  for (const auto* path : {&trace.measured_mm, &trace.before_mm, &trace.after_mm, &trace.model_file_mm}) {
    const auto z = along(*path, 2, use);
    const auto lateral = along(*path, axis, use);
    all_z.insert(all_z.end(), z.begin(), z.end());
    all_lateral.insert(all_lateral.end(), lateral.begin(), lateral.end());
  }
  const std::string name = axis == 0 ? "x" : "y";
  Panel panel(drawing, box, axis_around(all_z, last ? "z (mm)" : ""), axis_around(all_lateral, name + " (mm)"),
              axis == 0 ? trace.log : "");
  panel.points(along(trace.measured_mm, 2, use), along(trace.measured_mm, axis, use), "#8a8a8a", 0.7, 1.6);
  const auto draw = [&](const std::vector<Eigen::Vector3d>& path, const Stroke& stroke) {
    panel.curve(along(path, 2, use), along(path, axis, use), stroke);
  };
  draw(trace.model_file_mm, {.colour = "#4d4d4d", .width = 1.2, .dashes = "2,3"});
  if (!one_model) draw(trace.before_mm, {.colour = ink::kBefore, .width = 1.6, .dashes = "6,3"});
  draw(trace.after_mm, {.colour = ink::kAfter, .width = 1.6});
}

}  // namespace

std::vector<std::size_t> worst_first(const Findings& findings) {
  std::vector<double> error(findings.traces.size());
  for (std::size_t t = 0; t < error.size(); ++t) {
    const Trace& trace = findings.traces[t];
    double sum = 0;
    double count = 0;
    for (const auto& channel : trace.white_before)
      for (const double sigmas : channel)
        if (std::isfinite(sigmas)) {
          sum += sigmas * sigmas;
          ++count;
        }
    error[t] = count > 0 ? sum / count : 0;
  }
  std::vector<std::size_t> order(error.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return error[a] > error[b]; });
  return order;
}

std::string path_picture(const Findings& findings, const std::vector<std::size_t>& traces) {
  if (traces.empty()) return "";
  const auto rows = static_cast<double>(traces.size());
  Drawing drawing(832, 32 + rows * kRow + 22);
  const bool one_model = findings.verdict == Verdict::nothing_missing;  // before is after
  std::vector<Key> keys{{"#8a8a8a", "measured"}, {"#4d4d4d", "model file as given", true}};
  if (!one_model) keys.push_back({ink::kBefore, "before: needle refitted", true});
  keys.push_back({ink::kAfter, one_model ? "needle refitted" : "after: with what was found"});
  draw_keys(drawing, {50, 14}, keys);
  for (std::size_t i = 0; i < traces.size(); ++i) {
    const double top = 50 + static_cast<double>(i) * kRow;
    for (const int axis : {0, 1})
      draw_plane(drawing, {50 + axis * 422.0, top, 340, kRow - 50}, findings.traces[traces[i]], axis,
                 i + 1 == traces.size(), one_model);
  }
  return drawing.svg();
}

}  // namespace bevel::diagnose
