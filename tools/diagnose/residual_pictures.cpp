#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/diagnose/drawing.hpp"
#include "tools/diagnose/figures.hpp"
#include "tools/diagnose/pictures.hpp"

namespace bevel::diagnose {

using namespace bevel::diagnosis;  // NOLINT(google-build-using-namespace)

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kBins = 16;
constexpr std::size_t kFewest = 8;         // readings that make a median worth drawing
constexpr std::size_t kMostPoints = 1200;  // in one panel, of each model

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

// A band with gaps: one area for each unbroken stretch, and a bar where a bin stands alone.
void draw_binned(Drawing& drawing, Panel& panel, const Binned& b, std::string_view colour) {
  Binned stretch;
  for (std::size_t i = 0; i <= b.x.size(); ++i) {
    if (i < b.x.size() && std::isfinite(b.median[i])) {
      stretch.x.push_back(b.x[i]);
      stretch.low.push_back(b.low[i]);
      stretch.high.push_back(b.high[i]);
      continue;
    }
    if (stretch.x.size() > 1) panel.band(stretch.x, stretch.low, stretch.high, colour);
    if (stretch.x.size() == 1)
      drawing.line(panel.at(stretch.x[0], stretch.low[0]), panel.at(stretch.x[0], stretch.high[0]),
                   {.colour = colour, .width = 5, .opacity = 0.3});
    stretch = {};
  }
  panel.curve(b.x, b.median, {.colour = colour, .width = 2}).points(b.x, b.median, colour, 1, 2.2);
}

std::vector<double> every(const std::vector<double>& values, std::size_t step) {
  std::vector<double> some;
  for (std::size_t i = 0; i < values.size(); i += step) some.push_back(values[i]);
  return some;
}

struct Against {
  model::Covariate covariate;
  const char* title;
  const char* label;
  bool at_rest_only = false;
};
constexpr Against kAgainst[] = {{model::Covariate::time_s, "time in the recording", "s"},
                                {model::Covariate::depth_mm, "inserted length", "mm"},
                                {model::Covariate::speed_mm_s, "speed of insertion", "mm/s"},
                                {model::Covariate::turn_rate_rad_s, "rate of turning", "rad/s"},
                                {model::Covariate::roll_rad, "roll of the base", "rad"},
                                {model::Covariate::since_stop_s, "time since stop, at rest", "s", true},
                                {model::Covariate::since_reversal_mm, "insertion since last turn", "mm"}};
constexpr int kColumns = 4;
constexpr double kLeft = 52;
constexpr double kPanelWidth = 179;
constexpr double kPitch = 197;
constexpr double kPanelHeight = 120;

// So that the picture tells of the bulk, and zero is in it; a point outside is cut off.
Axis residual_axis(const std::vector<double>& before, const std::vector<double>& after, std::string label) {
  std::vector<double> all;
  for (const auto* list : {&before, &after})
    for (const double v : *list)
      if (std::isfinite(v)) all.push_back(v);
  const double low = std::min(quantile(all, 0.005), 0.0);
  const double high = std::max(quantile(all, 0.995), 0.0);
  const double room = high > low ? 0.08 * (high - low) : 1;
  return {low - room, high + room, std::move(label)};
}

}  // namespace

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
  return coordinate_of(findings.channels[channel]) < 0 ? "standard deviations" : "mm";
}

std::string residual_picture(const Findings& findings, std::size_t channel) {
  std::vector<double> before;
  std::vector<double> after;
  std::vector<Covariates> taken_at;
  for (const auto& trace : findings.traces) {
    const Residuals r = residuals_of(findings, trace, channel);
    before.insert(before.end(), r.before.begin(), r.before.end());
    after.insert(after.end(), r.after.begin(), r.after.end());
    taken_at.insert(taken_at.end(), trace.covariates.begin(), trace.covariates.end());
  }
  if (std::none_of(before.begin(), before.end(), [](double v) { return std::isfinite(v); })) return "";
  const bool one_model = findings.verdict == Verdict::nothing_missing;  // before is after
  Drawing drawing(832, 390);
  int place = 0;
  for (const Against& against : kAgainst) {
    const int column = place % kColumns;
    const int row = place++ / kColumns;
    const Box box{kLeft + column * kPitch, 24 + row * 195.0, kPanelWidth, kPanelHeight};
    const bool leftmost = column == 0;
    std::vector<double> x;
    std::vector<double> y_before;
    std::vector<double> y_after;
    for (std::size_t i = 0; i < taken_at.size(); ++i) {
      const double at = taken_at[i][against.covariate];
      if (against.at_rest_only && at <= 0) continue;
      x.push_back(at);
      y_before.push_back(before[i]);
      y_after.push_back(after[i]);
    }
    if (x.size() < kFewest) {
      drawing.text({box.left, box.top - 7}, against.title, {.bold = true});
      drawing.text({box.left + box.width / 2, box.top + box.height / 2}, "no such readings",
                   {.anchor = Lettering::Anchor::middle, .colour = ink::kSoft});
      continue;
    }
    const Axis across = axis_around(x, against.label);
    Axis upward = residual_axis(before, after, leftmost ? "residual (" + residual_unit(findings, channel) + ")" : "");
    upward.numbered = leftmost;
    Panel panel(drawing, box, across, upward, against.title);
    for (const auto& where : findings.where)
      if (where.channel == findings.channels[channel] && where.covariate == model::name_of(against.covariate))
        panel.span(where.range[0], where.range[1]);
    panel.level(0, {.colour = ink::kSoft});
    const std::size_t step = x.size() / kMostPoints + 1;
    if (!one_model) panel.points(every(x, step), every(y_before, step), ink::kBefore, 0.22);
    panel.points(every(x, step), every(y_after, step), ink::kAfter, 0.22);
    if (!one_model) draw_binned(drawing, panel, bin(x, y_before, across.low, across.high), ink::kBefore);
    draw_binned(drawing, panel, bin(x, y_after, across.low, across.high), ink::kAfter);
  }
  const double left = kLeft + 3 * kPitch;
  double top = 24 + 195 + 20;
  const std::vector<Key> keys = one_model ? std::vector<Key>{{ink::kAfter, "needle refitted"}}
                                          : std::vector<Key>{{ink::kBefore, "before: needle refitted"},
                                                             {ink::kAfter, "after: as found"},
                                                             {ink::kSpan, "where it goes wrong"}};
  for (const Key& key : keys) {
    draw_keys(drawing, {left, top}, {key});
    top += 22;
  }
  drawing.text({left, top + 6}, "line: median; band: half of", {.size = 11, .colour = ink::kSoft});
  drawing.text({left, top + 21}, "the readings; dots: readings", {.size = 11, .colour = ink::kSoft});
  return drawing.svg();
}

namespace {

void draw_location(Drawing& drawing, double left, const Findings& findings, const Location& where) {
  const auto trace =
      std::find_if(findings.traces.begin(), findings.traces.end(), [&](const Trace& t) { return t.log == where.log; });
  const auto channel = std::find(findings.channels.begin(), findings.channels.end(), where.channel);
  if (trace == findings.traces.end() || channel == findings.channels.end()) return;
  const auto c = static_cast<std::size_t>(channel - findings.channels.begin());
  const Residuals r = residuals_of(findings, *trace, c);
  const Axis time = axis_around(trace->time_s, "");
  const auto draw_strip = [&](double top, double height, const std::string& label, double Covariates::*quantity,
                              const std::string& below) {
    std::vector<double> values;
    for (const auto& at : trace->covariates) values.push_back(at.*quantity);
    Axis across = time;
    across.label = below;
    Panel panel(drawing, {left, top, 335, height}, across, axis_around(values, label));
    panel.span(where.from_s, where.to_s).curve(trace->time_s, values, {.colour = "#4d4d4d", .width = 1.5});
  };
  {
    Panel panel(drawing, {left, 50, 335, 150}, time,
                residual_axis(r.before, r.after, "residual (" + residual_unit(findings, c) + ")"),
                where.log + ", " + where.channel + ": " + number(where.from_s) + " to " + number(where.to_s) + " s");
    panel.span(where.from_s, where.to_s).level(0, {.colour = ink::kSoft});
    panel.points(trace->time_s, r.before, ink::kBefore, 0.75, 1.5);
    panel.points(trace->time_s, r.after, ink::kAfter, 0.75, 1.5);
  }
  draw_strip(232, 62, "depth (mm)", &Covariates::depth_mm, "");
  draw_strip(326, 62, "roll (rad)", &Covariates::roll_rad, "time (s)");
}

}  // namespace

std::string located_picture(const Findings& findings, std::size_t most) {
  if (findings.where.empty() || findings.traces.empty()) return "";
  Drawing drawing(832, 424);
  draw_keys(drawing, {50, 14},
            {{ink::kBefore, "before: needle refitted"},
             {ink::kAfter, "after: with what was found"},
             {ink::kSpan, "where it goes wrong"}});
  for (std::size_t i = 0; i < std::min(most, findings.where.size()); ++i)
    draw_location(drawing, 50 + 425 * static_cast<double>(i), findings, findings.where[i]);
  return drawing.svg();
}

}  // namespace bevel::diagnose
