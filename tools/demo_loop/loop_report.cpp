// SPDX-License-Identifier: MIT
#include <cmath>

#include <bevel/nodes/needle_pose.hpp>
#include <bevel/report/numbers.hpp>
#include <bevel/report/page.hpp>
#include "tools/demo_loop/loop_figures.hpp"
#include "tools/demo_loop/steering_session.hpp"

namespace bevel::tools {
namespace {

using report::Colour;
using report::Figure;

struct Column {
  std::vector<double> t, x, y, z, sd_x, sd_y, sd_z;
};

Column column(const std::vector<needle_state_t>& states, std::int64_t start_utime) {
  Column c;
  for (const needle_state_t& m : states) {
    c.t.push_back(static_cast<double>(m.utime - start_utime) * 1e-6);
    c.x.push_back(m.position_mm[0]), c.y.push_back(m.position_mm[1]), c.z.push_back(m.position_mm[2]);
    // The covariance is of the body frame; what a reader sees is {A}.
    const Eigen::Matrix3d R = nodes::read_pose(m).R;
    Eigen::Matrix3d P;
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 3; ++k) P(r, k) = m.covariance[9 * r + k];
    const Eigen::Vector3d sd = (R * P * R.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
    c.sd_x.push_back(sd.x()), c.sd_y.push_back(sd.y()), c.sd_z.push_back(sd.z());
  }
  return c;
}

std::vector<double> shifted(const std::vector<double>& v, const std::vector<double>& sd, double by) {
  std::vector<double> out(v);
  for (std::size_t i = 0; i < v.size(); ++i) out[i] += by * sd[i];
  return out;
}

Figure path_figure(const char* axis, const Column& truth, const Column& estimate,
                   const std::vector<double>& true_lateral, const std::vector<double>& lateral,
                   const std::vector<double>& sd, double target_z, double target_lateral) {
  Figure figure;
  figure.title = std::string("Path in the plane of ") + axis + " and depth";
  figure.x_label = "depth z (mm)";
  figure.y_label = std::string(axis) + " (mm)";
  figure.x_range = {{-2, std::max(target_z, truth.z.back()) * 1.05}};
  figure.link = "time";
  const auto known_by = [&figure](const std::vector<double>& t) { figure.series.back().key = t; };
  figure.band("estimate, 2 sigma", estimate.z, shifted(lateral, sd, -2), shifted(lateral, sd, 2), Colour::orange);
  known_by(estimate.t);
  figure.line("estimate", estimate.z, lateral, Colour::orange);
  known_by(estimate.t);
  figure.dashed("true tip", truth.z, true_lateral, Colour::blue);
  known_by(truth.t);
  figure.points("target", {target_z}, {target_lateral}, Colour::purple);
  return figure;
}

report::Space path_in_space(const Column& truth, const Column& estimate, const Eigen::Vector3d& target_mm) {
  const auto path = [](const char* name, const Column& c, report::SpacePath::Kind kind, Colour colour) {
    report::SpacePath p{.kind = kind, .label = name, .points_mm = {}, .colour = colour, .key = c.t};
    for (std::size_t i = 0; i < c.t.size(); ++i) p.points_mm.push_back({c.x[i], c.y[i], c.z[i]});
    return p;
  };
  return {.paths = {path("estimate", estimate, report::SpacePath::Kind::line, Colour::orange),
                    path("true tip", truth, report::SpacePath::Kind::dashed, Colour::blue),
                    {.kind = report::SpacePath::Kind::points,
                     .label = "target",
                     .points_mm = {{target_mm.x(), target_mm.y(), target_mm.z()}},
                     .colour = Colour::purple}},
          .link = "time"};
}

Figure error_figure(const Column& truth, const Column& estimate) {
  Figure figure;
  figure.title = "Estimate against truth";
  figure.x_label = "time (s)";
  figure.link = "time";
  figure.y_label = "error (mm)";
  std::vector<double> t, ex, ey, ez;
  std::size_t j = 0;
  for (std::size_t i = 0; i < estimate.t.size(); ++i) {
    while (j + 1 < truth.t.size() && truth.t[j + 1] <= estimate.t[i]) ++j;
    if (j + 1 >= truth.t.size() || truth.t[j] > estimate.t[i]) continue;
    const double share = (estimate.t[i] - truth.t[j]) / (truth.t[j + 1] - truth.t[j]);
    const auto at = [&](const std::vector<double>& v) { return v[j] + share * (v[j + 1] - v[j]); };
    t.push_back(estimate.t[i]);
    ex.push_back(estimate.x[i] - at(truth.x)), ey.push_back(estimate.y[i] - at(truth.y));
    ez.push_back(estimate.z[i] - at(truth.z));
  }
  figure.line("x", t, ex).line("y", t, ey).line("z", t, ez);
  return figure;
}

Figure command_figure(const io::Recording& log, std::int64_t start_utime) {
  Figure figure;
  figure.title = "Commands";
  figure.x_label = "time (s)";
  figure.link = "time";
  figure.y_label = "insertion (mm/s), rotation (rad/s)";
  std::vector<double> t, u1, u2;
  for (const model::MotionCommand& m : log.commands) {
    t.push_back(static_cast<double>(m.utime - start_utime) * 1e-6);
    u1.push_back(m.insertion_rate_mm_s);
    u2.push_back(m.rotation_rate_rad_s);
  }
  figure.step("insertion rate", t, u1, Colour::blue).step("rotation rate", t, u2, Colour::orange);
  return figure;
}

Figure parameter_figure(const std::vector<needle_state_t>& states, std::int64_t start_utime, double truth,
                        double truth2) {
  Figure figure;
  figure.title = "Slip parameters, with 2 sigma";
  figure.x_label = "time (s)";
  figure.link = "time";
  figure.y_label = "lambda1 (1/rad), lambda2";
  std::vector<double> t, l1, l1_low, l1_high, l2, l2_low, l2_high;
  for (const needle_state_t& m : states) {
    const double s1 = std::sqrt(std::max(m.covariance[70], 0.0)), s2 = std::sqrt(std::max(m.covariance[80], 0.0));
    t.push_back(static_cast<double>(m.utime - start_utime) * 1e-6);
    l1.push_back(m.lambda1_per_rad), l1_low.push_back(m.lambda1_per_rad - 2 * s1),
        l1_high.push_back(m.lambda1_per_rad + 2 * s1);
    l2.push_back(m.lambda2), l2_low.push_back(m.lambda2 - 2 * s2), l2_high.push_back(m.lambda2 + 2 * s2);
  }
  figure.band("", t, l1_low, l1_high, Colour::blue).band("", t, l2_low, l2_high, Colour::orange);
  figure.line("lambda1", t, l1, Colour::blue).line("lambda2", t, l2, Colour::orange);
  figure.references.push_back({report::Reference::Axis::horizontal, truth, "true lambda1"});
  figure.references.push_back({report::Reference::Axis::horizontal, truth2, "true lambda2"});
  return figure;
}

std::string text(const char* format, double a, double b = 0) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, format, a, b);
  return buffer;
}

std::vector<report::Fact> facts_of(const LoopFigures& f) {
  return {{"targeting error", text("%.3f mm", f.targeting_error_mm), "true tip to target, at rest"},
          {"estimator error", text("%.3f mm", f.estimator_error_rms_mm),
           text("rms, estimate to true tip; largest %.3f mm", f.estimator_error_max_mm)},
          {"turned", text("%.1f turns", f.turned_rev), text("in %.1f mm inserted", f.inserted_mm)},
          {"camera to command", text("%.1f ms", f.camera_to_command_ms.p50),
           text("median; 99 %% within %.1f ms", f.camera_to_command_ms.p99)}};
}

void add_tables(report::Page& page, const LoopFigures& f) {
  const auto row = [](const char* name, const char* format, double value, double sd, double truth) {
    return std::vector<std::string>{name, text(format, value), sd > 0 ? text(format, sd) : "held", text(format, truth),
                                    report::in_deviations(value - truth, sd)};
  };
  page.table({"parameter", "estimate", "standard deviation", "truth", "off by (standard deviations)"},
             {row("k (1/mm)", "%.5f", f.curvature_per_mm, f.curvature_sd_per_mm, f.truth->curvature_per_mm),
              row("lambda1 (1/rad)", "%.3f", f.lambda1_per_rad, f.lambda1_sd_per_rad, f.truth->lambda1_per_rad),
              row("lambda2", "%.3f", f.lambda2, f.lambda2_sd, f.truth->lambda2)},
             "At the end. One in twenty is off by more than two of its standard deviations if these are right.");
  const auto times = [](const char* name, const Percentiles& p) {
    return std::vector<std::string>{name, text("%.1f", p.p50), text("%.1f", p.p99), std::to_string(p.count)};
  };
  page.table({"time (ms)", "median", "99 %", "count"},
             {times("from capture to measurement", f.camera_to_measurement_ms),
              times("in motion, from capture to the command that used it", f.camera_to_command_ms),
              times("of that, from measurement to command", f.measurement_to_command_ms),
              times("between commands", f.command_period_ms)},
             text("A second: %.0f commands, %.0f estimates, ", f.command_rate_hz, f.estimate_rate_hz) +
                 text("%.0f measurements. ", f.measurement_rate_hz) + std::to_string(f.measurements_unusable) + " of " +
                 std::to_string(f.measurements) + " measurements not usable, " + std::to_string(f.rejected_messages) +
                 " messages refused.");
}

}  // namespace

void write_loop_report(const std::string& log_path, const LoopFigures& f, double tolerance_mm,
                       const std::string& html_path) {
  const io::Recording log = io::read_recording(log_path);
  const std::int64_t start = log.actuators.front().utime;
  const Column truth = column(log.truths, start), estimate = column(log.estimates, start);
  report::Page page("One insertion");
  char headline[160];
  const bool reported = reports_arrival(f.outcome), is_near = f.targeting_error_mm <= tolerance_mm;
  std::snprintf(headline, sizeof headline, "%s: the true tip came to rest %.2f mm from the target",
                reported && is_near ? "Arrived"
                : reported          ? "Missed, and an arrival was reported"
                                    : "Missed, as reported",
                f.targeting_error_mm);
  page.verdict(
      reported && is_near ? report::Tone::good : report::Tone::bad, headline,
      "The controller reports: " + (f.outcome.empty() ? std::string("no outcome") : f.outcome) +
          ". True tip of the simulated needle, whose curvature and lambda are not what the software believed at the "
          "start; the camera's pictures were rendered and tracked.",
      facts_of(f));
  add_tables(page, f);
  page.heading("Path");
  page.space(path_in_space(truth, estimate, f.target_mm),
             "The tip in {A}. All figures are linked in time: point at one to read all of them.");
  page.figure(path_figure("y", truth, estimate, truth.y, estimate.y, estimate.sd_y, f.target_mm.z(), f.target_mm.y()),
              "Side view, the plane that camera 0 sees.");
  page.figure(path_figure("x", truth, estimate, truth.x, estimate.x, estimate.sd_x, f.target_mm.z(), f.target_mm.x()),
              "Top view, the plane that camera 1 sees.");
  page.heading("Errors and parameters over time");
  page.figure(error_figure(truth, estimate), "Estimate minus true tip, in {A}.");
  page.figure(parameter_figure(log.estimates, start, f.truth->lambda1_per_rad, f.truth->lambda2),
              "What the filter believes of the slip. Curvature, lambda1 and lambda2 trade off along one insertion: the "
              "bands stay wide where the data do not tell them apart.");
  page.heading("Commands");
  page.figure(command_figure(log, start), "Rates sent to the axes.");
  page.save(html_path);
}

}  // namespace bevel::tools
