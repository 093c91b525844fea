// SPDX-License-Identifier: MIT
#include <bevel/analysis/diagnose/figures.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace bevel::analysis {
namespace {

using report::decimals_for;
using report::fixed;

constexpr std::pair<std::string_view, std::string_view> kUnits[] = {{"_mm_per_rad", "mm/rad"},
                                                                    {"_mm_per_mm", "mm/mm"},
                                                                    {"_rad_per_mm", "rad/mm"},
                                                                    {"_rad_per_rad", "rad/rad"},
                                                                    {"_per_100mm", "per 100 mm"},
                                                                    {"_per_mm", "1/mm"},
                                                                    {"_per_rad", "1/rad"},
                                                                    {"_rad_s", "rad/s"},
                                                                    {"_mm_s", "mm/s"},
                                                                    {"_mm", "mm"},
                                                                    {"_rad", "rad"},
                                                                    {"_hz", "Hz"},
                                                                    {"_s", "s"}};

std::pair<std::string_view, std::string_view> split(std::string_view name) {
  for (const auto& [suffix, unit] : kUnits)
    if (name.ends_with(suffix)) return {name.substr(0, name.size() - suffix.size()), unit};
  if (name == "per_100mm") return {"slope", "per 100 mm"};
  return {name, ""};
}

}  // namespace

std::string with_error(double value, double std_error) {
  if (!std::isfinite(value)) return "-";
  if (!std::isfinite(std_error) || std_error <= 0) return number(value, 4);
  const int decimals = decimals_for(std_error, 2);
  return fixed(value, decimals) + " ± " + fixed(std_error, decimals);
}

std::string interval(const std::array<double, 2>& ends) {
  if (!std::isfinite(ends[0]) && !std::isfinite(ends[1])) return "open";
  if (!std::isfinite(ends[0])) return "up to " + number(ends[1]);
  if (!std::isfinite(ends[1])) return "from " + number(ends[0]);
  const double width = ends[1] - ends[0];
  if (!(width > 0)) return number(ends[0], 4);
  const int decimals = decimals_for(width / 4, 2);
  return fixed(ends[0], decimals) + " to " + fixed(ends[1], decimals);
}

std::string percent(double share) {
  if (!std::isfinite(share)) return "-";
  const double value = 100 * share;
  if (value > 99.9 && value < 100) return "> 99.9 %";
  if (value > 0 && value < 0.1) return "< 0.1 %";
  return number(value, value >= 99 ? 3 : 2) + " %";
}

std::string probability(double p) { return p > 0.999 ? "> 99.9 %" : p < 0.001 ? "< 0.1 %" : percent(p); }

std::string log_factor(const std::optional<double>& log_bayes_factor) {
  if (!log_bayes_factor || !std::isfinite(*log_bayes_factor)) return "-";
  return fixed(*log_bayes_factor, std::abs(*log_bayes_factor) < 100 ? 1 : 0);
}

std::string listed(const std::vector<std::string>& names, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i == 0 ? "" : i + 1 == names.size() ? last : ", ") + names[i];
  return text;
}

std::string variation_in_words(const diagnosis::VariationEstimate& v) {
  const bool relative = v.unit == "relative";
  const double scale = relative ? 100 : 1;
  std::string name = v.name;
  std::replace(name.begin(), name.end(), '_', ' ');
  return name + " " + number(scale * v.sd, 2) + (relative ? " %" : " " + v.unit) + " (none: " + probability(v.none) +
         (v.at_end ? "; at the end of the values tried" : "") + ")";
}

bool is_kind_of(std::string_view tried, std::string_view effect, std::string_view parameter) {
  if (!tried.starts_with(effect)) return false;
  std::string_view kind = tried.substr(effect.size());
  if (kind.empty()) return true;
  if (!kind.starts_with(" (") || !kind.ends_with(')')) return false;
  kind = kind.substr(2, kind.size() - 3);
  return parameter.starts_with(kind);
}

bool is_kind_of(std::string_view tried, const diagnosis::FoundEffect& found) {
  return std::any_of(found.parameters.begin(), found.parameters.end(),
                     [&](const auto& p) { return is_kind_of(tried, found.name, p.name); }) ||
         tried == found.name;
}

bool was_found(const diagnosis::Findings& f, std::string_view effect) {
  return std::any_of(f.effects.begin(), f.effects.end(), [&](const auto& e) { return e.name == effect; });
}

std::vector<std::string> not_to_be_seen(const diagnosis::Findings& f) {
  std::vector<std::string> names;
  for (const auto& d : f.detectable) {
    const bool seen = std::any_of(f.detectable.begin(), f.detectable.end(),
                                  [&](const auto& o) { return o.effect == d.effect && o.size <= o.typical; });
    if (seen || was_found(f, d.effect) || std::find(names.begin(), names.end(), d.effect) != names.end()) continue;
    names.push_back(d.effect);
  }
  return names;
}

std::optional<MovedAtDepth> moved_at_depth(const diagnosis::Findings& f) {
  MovedAtDepth moved{.depth_mm = {std::numeric_limits<double>::infinity(), 0}};
  double from_file = 0, from_refitted = 0;
  std::size_t count = 0;
  for (const auto& trace : f.traces) {
    if (trace.covariates.empty()) continue;
    const auto depth_mm = [](const model::Covariates& at) { return at[model::Covariate::depth_mm]; };
    const auto at = std::ranges::max_element(trace.covariates, {}, depth_mm);
    const auto i = static_cast<std::size_t>(at - trace.covariates.begin());
    moved.depth_mm = {std::min(moved.depth_mm[0], depth_mm(*at)), std::max(moved.depth_mm[1], depth_mm(*at))};
    from_file += (trace.after_mm[i] - trace.model_file_mm[i]).squaredNorm();
    from_refitted += (trace.after_mm[i] - trace.before_mm[i]).squaredNorm();
    ++count;
  }
  if (count == 0) return std::nullopt;
  moved.from_file_mm = std::sqrt(from_file / static_cast<double>(count));
  moved.from_refitted_mm = std::sqrt(from_refitted / static_cast<double>(count));
  return moved;
}

std::string moved_in_words(double moved_at_depth_mm) {
  return std::isfinite(moved_at_depth_mm) ? "moves the tip by " + measured(moved_at_depth_mm, 2) + " mm"
                                          : "by how far it moves the tip is not known";
}

std::string stopped_in_words(const diagnosis::SteeredFigures::Stopped& s) {
  const auto range = [](const std::array<double, 2>& of, int digits) {
    const std::string least = number(of[0], digits), most = number(of[1], digits);
    return least == most ? least : least + " to " + most;
  };
  std::string text = s.reason;
  if (s.limit > 0) text += ": " + range(s.value, 3) + ", limit " + number(s.limit, 3);
  if (s.limit > 0 && !s.unit.empty()) text += " " + s.unit;
  return text + ", at a depth of " + range(s.depth_mm, 2) + " mm";
}

std::string steered_in_words(const diagnosis::SteeredFigures& s, std::size_t targets) {
  std::string text =
      s.arrived == 0 ? "" : "median " + measured(s.median_mm, 2) + " mm, worst " + measured(s.worst_mm, 2) + " mm, ";
  text += std::to_string(s.arrived) + " of " + std::to_string(targets) + " arrived";
  for (const auto& one : s.stopped)
    text +=
        (&one == s.stopped.data() ? " (" : "; ") + std::to_string(one.count) + " stopped by " + stopped_in_words(one);
  return text + (s.stopped.empty() ? "" : ")");
}

Steering steering_with(const diagnosis::SteeredToTargets& s) {
  constexpr double kDeviations = 2;  // one in forty by chance
  if (s.found.arrived != s.as_it_stands.arrived)
    return s.found.arrived < s.as_it_stands.arrived ? Steering::worse : Steering::better;
  if (s.found.arrived == 0) return Steering::fails;
  const diagnosis::PairedMiss& p = s.paired;
  if (p.targets < 2 || !(std::abs(p.farther_mm) > kDeviations * p.std_error_mm)) return Steering::equal;
  return p.farther_mm > 0 ? Steering::worse : Steering::better;
}

std::string_view name_of(Steering steering) {
  return steering == Steering::better ? "adopt" : steering == Steering::equal ? "either" : "do-not-adopt";
}

std::string steering_advice(const diagnosis::SteeredToTargets& s) {
  const diagnosis::PairedMiss& p = s.paired;
  const std::string difference =
      p.targets < 2 ? ""
                    : std::string("the same targets are missed by ") + measured(std::abs(p.farther_mm), 2) + " +- " +
                          measured(p.std_error_mm, 2) + " mm " + (p.farther_mm > 0 ? "more" : "less") +
                          " with the model that was found (mean of " + std::to_string(p.targets) + "): ";
  switch (steering_with(s)) {
    case Steering::better:
      return difference + "adopt this model for steering";
    case Steering::equal:
      return difference + "adopt this model for steering or keep the model as it stands, the difference is chance";
    case Steering::worse:
      return difference + "do not adopt this model for steering";
    case Steering::fails:
      break;
  }
  return "do not adopt this model for steering: no target was reached with it";
}

std::string span_mm(const diagnosis::SteeredToTargets& s) {
  return number(s.depth_mm[0], 2) + " to " + number(s.depth_mm[1], 2) + " mm";
}

std::string unit_of(std::string_view name) { return std::string(split(name).second); }

std::string in_words(std::string_view name) {
  const auto [stem, unit] = split(name);
  std::string words(stem);
  std::replace(words.begin(), words.end(), '_', ' ');
  return unit.empty() ? words : words + " (" + std::string(unit) + ")";
}

std::string what_is_left(const diagnosis::Checks& c) {
  if (c.clean) return "What is left is noise.";
  std::string left;
  if (c.chi2_per_dof > c.band[1]) left = "more than the fitted noise";
  if (c.chi2_per_dof < c.band[0]) left = "less than the fitted noise";
  if (c.ljung_box_p <= 0.01) left += left.empty() ? "correlated from reading to reading" : ", and correlated";
  return "What is left is " + left + "; the verdict does not rest on this.";
}

std::string headline_of(diagnosis::Verdict verdict, bool two_groups) {
  switch (verdict) {
    case diagnosis::Verdict::nothing_missing:
      return two_groups ? "Unchanged" : "Nothing missing";
    case diagnosis::Verdict::effects_found:
      return two_groups ? "Changed" : "Effects found";
    case diagnosis::Verdict::unknown_effect:
      return two_groups ? "Changed, in a way on no list" : "Unknown effect";
    case diagnosis::Verdict::inconclusive:
      return "Inconclusive";
  }
  return "";
}

}  // namespace bevel::analysis
