// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>

#include <bevel/analysis/diagnose/figures.hpp>
#include <bevel/analysis/diagnose/pictures.hpp>
#include <bevel/report/thinned.hpp>

namespace bevel::analysis {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)
using report::Colour;
using report::Figure;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kBins = 16;
constexpr std::size_t kFewest = 8;          // readings that make a median worth drawing
constexpr std::size_t kMostReadings = 700;  // of one channel, in panels with a reading as a dot
constexpr std::size_t kMostOfOne = 300;     // the same, of one recording

// Index of the coordinate that a channel sees, or -1.
int coordinate_of(const std::string& channel) {
  const auto dot = channel.rfind('.');
  if (channel.starts_with("heading")) return -1;
  if (dot == std::string::npos || dot + 2 != channel.size()) return -1;
  const char axis = channel.back();
  return axis >= 'x' && axis <= 'z' ? axis - 'x' : -1;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return kNone;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

struct Binned {
  std::vector<double> x, median, low, high;
};
// Medians and quartiles in bins of equal width.
Binned bin(const std::vector<double>& x, const std::vector<double>& y, double low, double high) {
  Binned result;
  std::vector<std::vector<double>> bins(kBins);
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(y[i])) continue;
    const double place = (x[i] - low) / (high - low) * kBins;
    bins[static_cast<std::size_t>(std::clamp(place, 0.0, kBins - 1.0))].push_back(y[i]);
  }
  for (int i = 0; i < kBins; ++i) {
    const auto& of_bin = bins[static_cast<std::size_t>(i)];
    const bool enough = of_bin.size() >= kFewest;
    result.x.push_back(low + (i + 0.5) * (high - low) / kBins);
    result.median.push_back(enough ? quantile(of_bin, 0.5) : kNone);
    result.low.push_back(enough ? quantile(of_bin, 0.25) : kNone);
    result.high.push_back(enough ? quantile(of_bin, 0.75) : kNone);
  }
  return result;
}

struct Against {
  model::Covariate covariate;
  const char* title;
  const char* label;
  bool above_zero_only = false;
};
constexpr Against kAgainst[] = {{model::Covariate::time_s, "time in the recording", "s"},
                                {model::Covariate::depth_mm, "inserted length", "mm"},
                                {model::Covariate::speed_mm_s, "speed of insertion", "mm/s"},
                                {model::Covariate::turn_rate_rad_s, "rate of turning", "rad/s"},
                                {model::Covariate::roll_rad, "roll of the base", "rad"},
                                {model::Covariate::since_stop_s, "time since stop, at rest", "s", true},
                                {model::Covariate::since_reversal_mm, "insertion since last turn", "mm"},
                                {model::Covariate::withdrawn_mm, "drawn back from the deepest", "mm", true}};

// So that the panel tells of the bulk, and zero is in it; a point outside is cut off.
std::pair<double, double> residual_range(const std::vector<double>& before, const std::vector<double>& after) {
  std::vector<double> all;
  for (const auto* list : {&before, &after})
    for (const double v : *list)
      if (std::isfinite(v)) all.push_back(v);
  const double low = std::min(quantile(all, 0.005), 0.0);
  const double high = std::max(quantile(all, 0.995), 0.0);
  const double room = high > low ? 0.08 * (high - low) : 1;
  return {low - room, high + room};
}

// Of the readings that a channel has those that show the same: the extremes of either model, in order.
std::vector<std::size_t> shown_of(const std::vector<double>& before, const std::vector<double>& after,
                                  std::size_t most) {
  std::vector<std::size_t> there;
  std::vector<double> one, other;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (!std::isfinite(before[i]) || !std::isfinite(after[i])) continue;
    there.push_back(i);
    one.push_back(before[i]);
    other.push_back(after[i]);
  }
  std::vector<std::size_t> kept;
  for (const std::size_t k : report::joined(report::thinned(one, most / 2), report::thinned(other, most / 2)))
    kept.push_back(there[k]);
  return kept;
}

std::vector<double> at(const std::vector<double>& values, const std::vector<std::size_t>& use) {
  std::vector<double> some;
  some.reserve(use.size());
  for (const std::size_t i : use) some.push_back(values[i]);
  return some;
}

std::string residual_label(const Findings& findings, std::size_t channel) {
  return "residual (" + residual_unit(findings, channel) + ")";
}

bool has_any(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

const char* name_of_after(const Findings& findings) {
  return !adopts_a_model(findings.verdict) ? "needle refitted" : "after";
}

// Logs without a clock are drawn by the number of the stop.
double shown_time(const Findings& findings, double time_s) {
  return findings.stop_s > 0 ? std::round(time_s / findings.stop_s) : time_s;
}
std::vector<double> shown_times(const Findings& findings, const Trace& trace, const std::vector<std::size_t>& use) {
  std::vector<double> out = at(trace.time_s, use);
  for (double& time_s : out) time_s = shown_time(findings, time_s);
  return out;
}

// Over time: residuals as dots.
Figure over_time(const Findings& findings, const Trace& trace, std::size_t channel, const Residuals& r) {
  const std::vector<std::size_t> use = shown_of(r.before, r.after, kMostOfOne);
  Figure figure;
  figure.title = findings.channels[channel];
  figure.y_label = residual_label(findings, channel);
  figure.height_px = 110;
  figure.references.push_back({report::Reference::Axis::horizontal, 0, ""});
  const std::vector<double> time = shown_times(findings, trace, use);
  if (adopts_a_model(findings.verdict)) figure.points("before", time, at(r.before, use), kBefore);
  figure.points(name_of_after(findings), time, at(r.after, use), kAfter);
  for (const auto& where : findings.where)
    if (where.log == trace.log && where.channel == findings.channels[channel])
      figure.spans.push_back({shown_time(findings, where.from_s), shown_time(findings, where.to_s)});
  return figure;
}

Figure of_the_base(const Findings& findings, const Trace& trace, const char* name, const char* label,
                   model::Covariate quantity) {
  Figure figure;
  std::vector<double> values;
  for (const auto& taken : trace.covariates) values.push_back(taken[quantity]);
  const std::vector<std::size_t> use = report::thinned(values, kMostOfOne);
  figure.y_label = label;
  figure.height_px = 70;
  figure.line(name, shown_times(findings, trace, use), at(values, use), Colour::grey);
  return figure;
}

// All over one stretch of time, so that they line up, and linked.
void set_time(std::vector<Figure>& panels, const Findings& findings, const Trace& trace, const std::string& link) {
  const double last = shown_time(findings, trace.time_s.back()), first = shown_time(findings, trace.time_s.front());
  const double room = last > first ? 0.02 * (last - first) : 1;
  for (Figure& panel : panels) {
    panel.x_range = {first - room, last + room};
    panel.link = link;
  }
  if (!panels.empty()) panels.back().x_label = time_label(findings);
}

}  // namespace

std::string time_label(const Findings& findings) { return findings.stop_s > 0 ? "stop" : "time (s)"; }
std::string time_span(const Findings& findings, const Location& where) {
  return number(shown_time(findings, where.from_s)) + " to " + number(shown_time(findings, where.to_s));
}

Residuals residuals_of(const Findings& findings, const Trace& trace, std::size_t channel) {
  const int axis = coordinate_of(findings.channels[channel]);
  const auto of = [&](const std::vector<std::vector<double>>& white, const std::vector<Eigen::Vector3d>& predicted_mm) {
    std::vector<double> all(trace.time_s.size(), kNone);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double sigmas = channel < white.size() && i < white[channel].size() ? white[channel][i] : kNone;
      const bool outlier = i < trace.outlier.size() && trace.outlier[i] != 0;
      if (outlier || !std::isfinite(sigmas)) continue;
      all[i] = axis < 0 ? sigmas : trace.measured_mm[i][axis] - predicted_mm[i][axis];
    }
    return all;
  };
  return {of(trace.white_before, trace.before_mm), of(trace.white_after, trace.after_mm)};
}

std::string residual_unit(const Findings& findings, std::size_t channel) {
  return coordinate_of(findings.channels[channel]) < 0 ? "s.d." : "mm";
}

std::vector<Figure> residual_panels(const Findings& findings, std::size_t channel) {
  std::vector<double> before, after;
  std::vector<model::Covariates> taken_at;
  for (const auto& trace : findings.traces) {
    const Residuals r = residuals_of(findings, trace, channel);
    before.insert(before.end(), r.before.begin(), r.before.end());
    after.insert(after.end(), r.after.begin(), r.after.end());
    taken_at.insert(taken_at.end(), trace.covariates.begin(), trace.covariates.end());
  }
  std::vector<Figure> panels;
  if (!has_any(before)) return panels;
  const bool one_model = !adopts_a_model(findings.verdict);  // before is after
  const std::vector<std::size_t> shown = shown_of(before, after, kMostReadings);
  const auto y_range = residual_range(before, after);
  for (const Against& against : kAgainst) {
    if (findings.stop_s > 0 && model::needs_clock(against.covariate)) continue;
    const auto stays = [&](std::size_t i) { return !against.above_zero_only || taken_at[i][against.covariate] > 0; };
    std::vector<double> x, y_before, y_after, dot_x, dot_before, dot_after, reading;
    for (std::size_t i = 0; i < taken_at.size(); ++i) {
      if (!stays(i)) continue;
      x.push_back(taken_at[i][against.covariate]);
      y_before.push_back(before[i]);
      y_after.push_back(after[i]);
    }
    if (x.size() < kFewest) continue;
    for (const std::size_t i : shown) {
      dot_x.push_back(stays(i) ? taken_at[i][against.covariate]
                               : kNone);  // known in every panel, seen where it belongs
      dot_before.push_back(before[i]);
      dot_after.push_back(after[i]);
      reading.push_back(static_cast<double>(i));
    }
    if (!has_any(dot_x)) continue;
    Figure panel;
    panel.title = against.title;
    panel.x_label = against.label;
    panel.y_label = residual_label(findings, channel);
    panel.height_px = 130;
    panel.y_range = y_range;
    panel.link = "residuals of " + findings.channels[channel];
    panel.references.push_back({report::Reference::Axis::horizontal, 0, ""});
    for (const auto& where : findings.where)
      if (where.channel == findings.channels[channel] && where.covariate == model::name_of(against.covariate))
        panel.spans.push_back({where.range[0], where.range[1]});
    const auto [low, high] = std::minmax_element(x.begin(), x.end());
    const double room = *high > *low ? 0.04 * (*high - *low) : 1;
    panel.x_range = {*low - room, *high + room};
    const auto add = [&](const char* name, const std::vector<double>& dots, const std::vector<double>& all,
                         Colour colour) {
      panel.points(name, dot_x, dots, colour);
      panel.series.back().faint = true;
      panel.series.back().key = reading;
      const Binned b = bin(x, all, panel.x_range->first, panel.x_range->second);
      if (!has_any(b.median)) return;
      panel.band("", b.x, b.low, b.high, colour).line("", b.x, b.median, colour).points("", b.x, b.median, colour);
    };
    if (!one_model) add("before", dot_before, y_before, kBefore);
    add(name_of_after(findings), dot_after, y_after, kAfter);
    panels.push_back(std::move(panel));
  }
  return panels;
}

std::vector<Figure> recording_panels(const Findings& findings, std::size_t which) {
  const Trace& trace = findings.traces[which];
  std::vector<Figure> panels;
  for (std::size_t c = 0; c < findings.channels.size(); ++c) {
    const Residuals r = residuals_of(findings, trace, c);
    if (!shown_of(r.before, r.after, kMostOfOne).empty()) panels.push_back(over_time(findings, trace, c, r));
  }
  if (panels.empty() || trace.covariates.size() != trace.time_s.size()) return {};
  panels.push_back(of_the_base(findings, trace, "inserted", "depth (mm)", model::Covariate::depth_mm));
  panels.push_back(of_the_base(findings, trace, "turned", "roll (rad)", model::Covariate::roll_rad));
  set_time(panels, findings, trace, "time of " + trace.log);
  return panels;
}

std::vector<Figure> located_panels(const Findings& findings, std::size_t most) {
  std::vector<std::vector<Figure>> columns;
  for (std::size_t i = 0; i < std::min(most, findings.where.size()); ++i) {
    const Location& where = findings.where[i];
    const auto trace = std::find_if(findings.traces.begin(), findings.traces.end(),
                                    [&](const Trace& t) { return t.log == where.log; });
    const auto channel = std::find(findings.channels.begin(), findings.channels.end(), where.channel);
    if (trace == findings.traces.end() || channel == findings.channels.end()) continue;
    const auto c = static_cast<std::size_t>(channel - findings.channels.begin());
    const Residuals r = residuals_of(findings, *trace, c);
    if (shown_of(r.before, r.after, kMostOfOne).empty() || trace->covariates.size() != trace->time_s.size()) continue;
    std::vector<Figure> column{over_time(findings, *trace, c, r),
                               of_the_base(findings, *trace, "inserted", "depth (mm)", model::Covariate::depth_mm),
                               of_the_base(findings, *trace, "turned", "roll (rad)", model::Covariate::roll_rad)};
    column.front().title =
        where.log + ", " + where.channel + ": " +
        (findings.stop_s > 0 ? "stops " + time_span(findings, where) : time_span(findings, where) + " s");
    for (Figure& panel : column) panel.spans = {{shown_time(findings, where.from_s), shown_time(findings, where.to_s)}};
    set_time(column, findings, *trace, "worst span " + std::to_string(i + 1));
    columns.push_back(std::move(column));
  }
  std::vector<Figure> panels;  // row by row
  for (std::size_t row = 0; row < 3; ++row)
    for (const auto& column : columns) panels.push_back(column[row]);
  return panels;
}

}  // namespace bevel::analysis
