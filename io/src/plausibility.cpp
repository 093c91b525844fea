// SPDX-License-Identifier: MIT
#include <bevel/io/plausibility.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

namespace bevel::io {
namespace {

using Indices = std::vector<std::size_t>;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

template <class Sample>
double seconds(const Sample& from, const Sample& to) {
  return static_cast<double>(to.utime - from.utime) * 1e-6;
}

template <class Sample>
Indices by_time(std::span<const Sample> samples) {
  Indices order(samples.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(samples[a].utime, samples[a].seq) < std::pair(samples[b].utime, samples[b].seq);
  });
  return order;
}

// A sender that leaves seq alone says nothing by it; one message of it whose seq was damaged does not say otherwise.
template <class Sample>
bool counts(std::span<const Sample> samples, const Indices& order) {
  std::size_t up = 0;
  for (std::size_t n = 1; n < order.size(); ++n)
    if (samples[order[n]].seq > samples[order[n - 1]].seq) ++up;
  return 2 * up > order.size();
}

struct Fault {
  Oddity::Kind kind;
  std::string what;
};
using Agreement = std::optional<Fault>;  // empty: the second sample may follow the first

template <class Sample>
Agreement compare_stamps(const Sample& a, const Sample& b, bool counted) {
  const double dt_s = seconds(a, b);
  if (dt_s > kLongestPause_s)
    return Fault{Oddity::Kind::time,
                 "utime jumps by " + number(dt_s) + " s; allowed " + number(kLongestPause_s) + " s"};
  if (counted && b.seq <= a.seq)
    return Fault{Oddity::Kind::order, "seq is " + std::to_string(b.seq) + " after " + std::to_string(a.seq) +
                                          " while utime goes on; allowed: more"};
  return {};
}

// Walks along `order`, a pair at a time. compare(a, b) says what stands against b's following a. Of two that do not
// agree, the one is left out without which its neighbours do. Returns what is kept.
template <class Sample, class Compare>
Indices follow(std::span<const Sample> samples, const Indices& order, Judgement& judgement, Compare&& compare) {
  Indices kept;
  const auto agree = [&](std::size_t a, std::size_t b) { return !compare(samples[a], samples[b]); };
  for (std::size_t n = 0; n < order.size(); ++n) {
    const std::size_t i = order[n];
    Agreement fault;
    if (!kept.empty()) fault = compare(samples[kept.back()], samples[i]);
    if (!fault) {
      kept.push_back(i);
      continue;
    }
    const bool last = n + 1 == order.size();
    const bool newer_odd = last ? kept.size() > 1 : agree(kept.back(), order[n + 1]);
    const bool older_odd = kept.size() > 1 ? agree(kept[kept.size() - 2], i) : !last && agree(i, order[n + 1]);
    const bool older = older_odd && (last || !newer_odd);
    const bool lasts = !older && !newer_odd;
    const std::size_t odd = older ? kept.back() : i;
    judgement.oddities.push_back({fault->kind, samples[odd].utime, !lasts, std::move(fault->what)});
    if (!lasts) judgement.left_out[odd] = true;
    if (older) kept.pop_back();
    if (older || lasts) kept.push_back(i);
  }
  return kept;
}

// One axis of the drive, as the comparisons see it.
struct Axis {
  const char *name, *unit;
  double model::ActuatorState::*position, model::ActuatorState::*rate;
  double fastest_per_s, unsure;
};
constexpr Axis kAxes[] = {{"insertion", "mm", &model::ActuatorState::insertion_mm,
                           &model::ActuatorState::insertion_rate_mm_s, kFastestInsertion_mm_s, kUnsure_mm},
                          {"rotation", "rad", &model::ActuatorState::rotation_rad,
                           &model::ActuatorState::rotation_rate_rad_s, kFastestRotation_rad_s, kUnsure_rad}};

Agreement compare_motion(const model::ActuatorState& a, const model::ActuatorState& b) {
  const double dt_s = seconds(a, b);
  for (const Axis& axis : kAxes) {
    const double jump = std::abs(b.*axis.position - a.*axis.position);
    const double allowed = axis.unsure + axis.fastest_per_s * dt_s;
    if (jump > allowed)
      return Fault{Oddity::Kind::motion, std::string(axis.name) + " jumps by " + number(jump) + " " + axis.unit +
                                             " in " + number(dt_s) + " s; allowed " + number(allowed) + " " +
                                             axis.unit};
  }
  return {};
}

// Out and back within two intervals, farther than at the rates before and after, whether reported or moved at.
Agreement find_spike(std::span<const model::ActuatorState> samples, const Indices& kept, std::size_t n) {
  const auto& a = samples[kept[n - 1]];
  const auto& b = samples[kept[n]];
  const auto& c = samples[kept[n + 1]];
  const double before_s = seconds(a, b), after_s = seconds(b, c);
  for (const Axis& axis : kAxes) {
    const auto moved = [&](const model::ActuatorState& from, const model::ActuatorState& to) {
      return to.*axis.position - from.*axis.position;
    };
    const double out = moved(a, b), back = moved(b, c);
    if (out * back >= 0 || std::min(std::abs(out), std::abs(back)) <= axis.unsure) continue;
    double rate_per_s = std::max(std::abs(a.*axis.rate), std::abs(c.*axis.rate));
    const auto moves_at = [&](const model::ActuatorState& from, const model::ActuatorState& to) {
      const double dt_s = seconds(from, to);
      if (dt_s > 0) rate_per_s = std::max(rate_per_s, std::abs(moved(from, to)) / dt_s);
    };
    if (n > 1) moves_at(samples[kept[n - 2]], a);
    if (n + 2 < kept.size()) moves_at(c, samples[kept[n + 2]]);
    const double share = before_s + after_s > 0 ? before_s / (before_s + after_s) : 0.5;
    const double away = std::abs(out - share * moved(a, c));
    const double allowed = axis.unsure + std::min(rate_per_s, axis.fastest_per_s) * std::max(before_s, after_s);
    if (away > allowed)
      return Fault{Oddity::Kind::motion, std::string(axis.name) + " goes out by " + number(away) + " " + axis.unit +
                                             " and back within " + number(before_s + after_s) + " s; allowed " +
                                             number(allowed) + " " + axis.unit};
  }
  return {};
}

// Path of the base between two times, by the samples around them.
class Travel {
 public:
  explicit Travel(std::span<const model::ActuatorState> actuators) : actuators_(actuators), path_mm_(actuators.size()) {
    for (std::size_t i = 1; i < actuators.size(); ++i)
      path_mm_[i] = path_mm_[i - 1] + std::abs(actuators[i].insertion_mm - actuators[i - 1].insertion_mm);
  }
  bool known() const { return !path_mm_.empty(); }
  double between_mm(std::int64_t from, std::int64_t to) const {
    const auto utime_of = [](const model::ActuatorState& a) { return a.utime; };
    const auto after = std::ranges::lower_bound(actuators_, to, {}, utime_of) - actuators_.begin();
    const auto before = std::ranges::upper_bound(actuators_, from, {}, utime_of) - actuators_.begin();
    const auto end = std::min(static_cast<std::size_t>(after), path_mm_.size() - 1);
    const auto begin = static_cast<std::size_t>(std::max<std::ptrdiff_t>(before - 1, 0));
    return end > begin ? path_mm_[end] - path_mm_[begin] : 0;
  }

 private:
  std::span<const model::ActuatorState> actuators_;
  std::vector<double> path_mm_;
};

Agreement compare_readings(const model::TipMeasurement& a, const model::TipMeasurement& b, const Travel& travel) {
  if (a.status != 0 || b.status != 0 || !travel.known()) return {};
  double squares_mm2 = 0;
  for (Eigen::Index i = 0; i < 3; ++i)
    if (a.information_per_mm2(i, i) > 0 && b.information_per_mm2(i, i) > 0)
      squares_mm2 += std::pow(b.position_mm[i] - a.position_mm[i], 2);
  const double jump_mm = std::sqrt(squares_mm2);
  if (jump_mm <= kFarthestOutlier_mm) return {};
  const double allowed_mm = kFarthestOutlier_mm + travel.between_mm(a.utime, b.utime);
  if (jump_mm <= allowed_mm) return {};
  return Fault{Oddity::Kind::reading, "the tip jumps by " + number(jump_mm) + " mm in " + number(seconds(a, b)) +
                                          " s; allowed " + number(allowed_mm) + " mm"};
}

double information(const model::TipMeasurement& m) { return m.information_per_mm2.trace(); }
double information(const model::TipHeading& m) { return m.information_per_rad2.trace(); }

template <class Sample>
Agreement find_false_claim(const Sample& a, const Sample& b, const Sample& c, const std::string& unit) {
  const double around = std::max(information(a), information(c));
  const double claimed = information(b);
  if (!(around > 0) || claimed <= kSurerByRatio * around) return {};
  return Fault{Oddity::Kind::reading, "information is " + number(claimed) + unit + " between frames of at most " +
                                          number(around) + unit + "; allowed " + number(kSurerByRatio * around) + unit};
}

// Leaves out the samples within `kept` that find(n) tells of.
template <class Sample, class Find>
void leave_out_between(std::span<const Sample> samples, const Indices& kept, Judgement& judgement, Find&& find) {
  for (std::size_t n = 1; n + 1 < kept.size(); ++n) {
    Agreement fault = find(n);
    if (!fault) continue;
    judgement.left_out[kept[n]] = true;
    judgement.oddities.push_back({fault->kind, samples[kept[n]].utime, true, std::move(fault->what)});
    ++n;  // its successor is a neighbour that was relied on
  }
}

// compare_values(a, b): what, beside the stamps, stands against b's following a.
template <class Sample, class Compare>
Judgement judge_cameras(std::span<const Sample> samples, const std::string& unit, Compare&& compare_values) {
  Judgement judgement;
  judgement.left_out.resize(samples.size());
  std::map<std::int32_t, Indices> cameras;  // each counts for itself
  for (const std::size_t i : by_time(samples)) cameras[samples[i].camera].push_back(i);
  for (const auto& [camera, order] : cameras) {
    if (order.size() == 1 && samples.size() > 20) {
      judgement.left_out[order.front()] = true;
      judgement.oddities.push_back({Oddity::Kind::reading, samples[order.front()].utime, true,
                                    "camera " + std::to_string(camera) + " occurs once among " +
                                        std::to_string(samples.size()) + "; allowed: cameras that go on"});
      continue;
    }
    const bool counted = counts(samples, order);
    const Indices kept = follow(samples, order, judgement, [&](const auto& a, const auto& b) {
      Agreement fault = compare_stamps(a, b, counted);
      return fault ? fault : compare_values(a, b);
    });
    leave_out_between(samples, kept, judgement, [&](std::size_t n) {
      return find_false_claim(samples[kept[n - 1]], samples[kept[n]], samples[kept[n + 1]], unit);
    });
  }
  // A camera that takes something else for the tip for a while is no damage: the estimator has its gate for it.
  std::erase_if(judgement.oddities, [](const Oddity& o) { return o.kind == Oddity::Kind::reading && !o.left_out; });
  return judgement;
}

}  // namespace

Judgement judge(std::span<const model::ActuatorState> actuators) {
  Judgement judgement;
  judgement.left_out.resize(actuators.size());
  const Indices order = by_time(actuators);
  const bool counted = counts(actuators, order);
  const Indices kept = follow(actuators, order, judgement, [&](const auto& a, const auto& b) {
    Agreement fault = compare_stamps(a, b, counted);
    return fault ? fault : compare_motion(a, b);
  });
  leave_out_between(actuators, kept, judgement, [&](std::size_t n) { return find_spike(actuators, kept, n); });
  const auto far = std::ranges::find_if(
      kept, [&](std::size_t i) { return std::abs(actuators[i].insertion_mm) > kFarthestInsertion_mm; });
  if (far != kept.end())
    judgement.oddities.push_back({Oddity::Kind::motion, actuators[*far].utime, false,
                                  "insertion is " + number(actuators[*far].insertion_mm) + " mm; allowed " +
                                      number(kFarthestInsertion_mm) + " mm either way"});
  return judgement;
}

Judgement judge(std::span<const model::TipMeasurement> tips, std::span<const model::ActuatorState> actuators) {
  const Travel travel(actuators);
  return judge_cameras(tips, " /mm2", [&](const auto& a, const auto& b) { return compare_readings(a, b, travel); });
}

Judgement judge(std::span<const model::TipHeading> headings) {
  return judge_cameras(headings, " /rad2", [](const auto&, const auto&) { return Agreement(); });
}

Coverage compare_times(const std::map<int, std::vector<std::int64_t>>& utimes,
                       std::span<const model::ActuatorState> actuators, const std::string& channel) {
  Coverage coverage;
  if (actuators.empty()) {
    for (const auto& [camera, times] : utimes) coverage.inside += times.size();
    return coverage;
  }
  const auto [first, last] = std::ranges::minmax_element(actuators, {}, &model::ActuatorState::utime);
  const auto since_start_s = [start = first->utime](std::int64_t utime) {
    return (static_cast<double>(utime) - static_cast<double>(start)) * 1e-6;
  };
  const double end_s = since_start_s(last->utime);
  for (const auto& [camera, times] : utimes) {
    const auto outside = static_cast<std::size_t>(std::ranges::count_if(times, [&](std::int64_t utime) {
      return since_start_s(utime) < -kOutsideAxes_s || since_start_s(utime) > end_s + kOutsideAxes_s;
    }));
    coverage.outside += outside;
    coverage.inside += times.size() - outside;
    if (static_cast<double>(outside) <= kLargestShareOutside * static_cast<double>(times.size())) continue;
    const auto [earliest, latest] = std::ranges::minmax(times);
    coverage.faults += std::to_string(outside) + " of " + std::to_string(times.size()) + " " + channel + " of camera " +
                       std::to_string(camera) +
                       " are outside the time of ACTUATOR_STATE: " + number(since_start_s(earliest)) + " to " +
                       number(since_start_s(latest)) + " s, allowed " + number(-kOutsideAxes_s) + " to " +
                       number(end_s + kOutsideAxes_s) + " s; if the clocks differ, correct the stamps of one of them\n";
  }
  return coverage;
}

std::string describe(const std::vector<Oddity>& oddities, const std::string& channel, std::int64_t start_utime) {
  std::map<std::pair<Oddity::Kind, bool>, std::vector<const Oddity*>> kinds;
  for (const Oddity& oddity : oddities) kinds[{oddity.kind, oddity.left_out}].push_back(&oddity);
  std::string text;
  for (const auto& [kind, all] : kinds) {
    const Oddity& first = **std::ranges::min_element(all, {}, [](const Oddity* o) { return o->utime; });
    text += std::to_string(all.size()) + " " + channel + (all.size() > 1 ? ", the first at " : " at ") +
            number(static_cast<double>(first.utime - start_utime) * 1e-6) + " s: " + first.what +
            (first.left_out ? "; left out\n" : "; it lasts\n");
  }
  return text;
}

}  // namespace bevel::io
