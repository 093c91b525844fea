// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/pictures.hpp>
#include <bevel/report/thinned.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)
using report::Colour;
using report::Figure;

namespace {

constexpr std::size_t kMostReadings = 260;  // of one path

// Readings that are drawn: no outliers, and of many those that show the same.
std::vector<std::size_t> readings_of(const Trace& trace) {
  std::vector<std::size_t> sound;
  for (std::size_t i = 0; i < trace.time_s.size(); ++i)
    if (i >= trace.outlier.size() || trace.outlier[i] == 0) sound.push_back(i);
  std::vector<std::size_t> kept;
  for (const int axis : {0, 1}) {
    std::vector<double> values;
    values.reserve(sound.size());
    for (const std::size_t i : sound) values.push_back(trace.measured_mm[i][axis]);
    kept = report::joined(kept, report::thinned(values, kMostReadings / 2));
  }
  std::vector<std::size_t> use;
  use.reserve(kept.size());
  for (const std::size_t k : kept) use.push_back(sound[k]);
  return use;
}

std::vector<double> along(const std::vector<Eigen::Vector3d>& path_mm, int axis, const std::vector<std::size_t>& use) {
  std::vector<double> values;
  for (const std::size_t i : use)
    values.push_back(i < path_mm.size() ? path_mm[i][axis] : std::numeric_limits<double>::quiet_NaN());
  return values;
}

std::vector<double> times_of(const Trace& trace, const std::vector<std::size_t>& use) {
  std::vector<double> times_s;
  for (const std::size_t i : use) times_s.push_back(trace.time_s[i]);
  return times_s;
}

struct Model {
  const char* name;
  std::vector<Eigen::Vector3d> Trace::*path_mm;
  Colour colour;
  bool dashed;
};

std::vector<Model> models_of(const Findings& findings) {
  std::vector<Model> models{{"model file as given", &Trace::model_file_mm, Colour::purple, true}};
  if (!adopts_a_model(findings.verdict)) {  // before is after
    models.push_back({"needle refitted", &Trace::after_mm, kAfter, false});
  } else {
    models.push_back({"before", &Trace::before_mm, kBefore, true});
    models.push_back({"after", &Trace::after_mm, kAfter, false});
  }
  return models;
}

std::string link_of(const Trace& trace) { return "path of " + trace.log; }

Figure plane(const Findings& findings, const Trace& trace, int axis) {
  const std::vector<std::size_t> use = readings_of(trace);
  Figure figure;
  figure.title = trace.log;
  figure.x_label = "z (mm)";
  figure.y_label = axis == 0 ? "x (mm)" : "y (mm)";
  figure.height_px = 150;
  figure.link = link_of(trace);
  figure.points("measured", along(trace.measured_mm, 2, use), along(trace.measured_mm, axis, use), Colour::grey);
  for (const Model& m : models_of(findings)) {
    auto z = along(trace.*m.path_mm, 2, use), lateral = along(trace.*m.path_mm, axis, use);
    if (m.dashed)
      figure.dashed(m.name, std::move(z), std::move(lateral), m.colour);
    else
      figure.line(m.name, std::move(z), std::move(lateral), m.colour);
  }
  for (report::Series& s : figure.series) s.key = times_of(trace, use);
  return figure;
}

bool can_be_drawn(const Trace& trace) {
  const std::vector<std::size_t> use = readings_of(trace);
  return std::any_of(use.begin(), use.end(), [&](std::size_t i) { return trace.measured_mm[i].allFinite(); });
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

std::vector<Figure> path_panels(const Findings& findings, const std::vector<std::size_t>& traces) {
  std::vector<Figure> panels;
  for (const std::size_t t : traces) {
    if (!can_be_drawn(findings.traces[t])) continue;
    for (const int axis : {0, 1}) panels.push_back(plane(findings, findings.traces[t], axis));
  }
  return panels;
}

report::Space path_in_space(const Findings& findings, std::size_t which) {
  const Trace& trace = findings.traces[which];
  const std::vector<std::size_t> use = readings_of(trace);
  report::Space space;
  space.link = link_of(trace);
  const auto add = [&](const char* name, const std::vector<Eigen::Vector3d>& path_mm, report::SpacePath::Kind kind,
                       Colour colour) {
    report::SpacePath path{.kind = kind, .label = name, .points_mm = {}, .colour = colour, .key = times_of(trace, use)};
    for (const std::size_t i : use) {
      const Eigen::Vector3d at = i < path_mm.size() ? path_mm[i] : Eigen::Vector3d::Constant(std::nan(""));
      path.points_mm.push_back({at.x(), at.y(), at.z()});
    }
    space.paths.push_back(std::move(path));
  };
  add("measured", trace.measured_mm, report::SpacePath::Kind::points, Colour::grey);
  for (const Model& m : models_of(findings))
    add(m.name, trace.*m.path_mm, m.dashed ? report::SpacePath::Kind::dashed : report::SpacePath::Kind::line, m.colour);
  return space;
}

}  // namespace bevel::analysis
