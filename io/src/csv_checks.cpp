// SPDX-License-Identifier: MIT
#include "csv_checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <set>

#include <bevel/error.hpp>
#include <bevel/io/plausibility.hpp>

namespace bevel::io {
namespace {

constexpr double kMostLeftOut = 0.2;
// Tissue that gives, play in the guide, a hand that pushes: the tip of a BWH insertion is up to 4 mm off its base.
constexpr double kSlack_mm = 5;
constexpr double kSlackShare = 0.05;
constexpr double kSlackSigmas = 5;
// Within 50 mm no needle turns so far that less than a fifth of its way leads inward: that is a radius of 13 mm.
constexpr double kFollowFrom_mm = 20, kFollowTo_mm = 50, kFollowShare = 0.2;

std::string figure(double value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

template <class Sample>
std::vector<Sample> samples_of(const std::vector<Placed<Sample>>& placed) {
  std::vector<Sample> out;
  out.reserve(placed.size());
  for (const auto& p : placed) out.push_back(p.sample);
  return out;
}

// Times at which `judgement` leaves something out; throws for what lasts.
template <class Sample>
void note(const Judgement& judgement, const std::vector<Placed<Sample>>& placed, const std::string& path,
          std::set<std::int64_t>& gone, std::vector<std::string>& left_out) {
  for (const Oddity& oddity : judgement.oddities) {
    const auto row = std::ranges::find(placed, oddity.utime, [](const auto& p) { return p.sample.utime; });
    const std::string text = path + ":" + std::to_string(row->line) + ": " + oddity.what;
    if (!oddity.left_out) throw ParseError(text + "; it lasts, and is no recording of one insertion");
    if (gone.insert(oddity.utime).second) left_out.push_back(text + "; the row is left out");
  }
}

template <class Sample>
void drop(std::vector<Placed<Sample>>& placed, const std::set<std::int64_t>& gone) {
  std::erase_if(placed, [&](const auto& p) { return gone.contains(p.sample.utime); });
}

// Where the base was at each tip, and over what range it had moved since the first.
struct Base {
  double at_mm = 0, range_mm = 0;
};
std::vector<Base> base_at_tips(const PlacedReadings& readings) {
  std::vector<Base> out;
  const auto& base = readings.base;
  std::size_t next = 0;
  double lowest_mm = INFINITY, highest_mm = -INFINITY;
  const auto widen = [&](double mm) { lowest_mm = std::min(lowest_mm, mm), highest_mm = std::max(highest_mm, mm); };
  for (const auto& tip : readings.tips) {
    for (; next < base.size() && base[next].sample.utime <= tip.sample.utime; ++next)
      if (!out.empty()) widen(base[next].sample.insertion_mm);
    const auto& before = base[next == 0 ? 0 : next - 1].sample;
    const auto& after = base[std::min(next, base.size() - 1)].sample;
    const auto span_us = static_cast<double>(after.utime - before.utime);
    const double share = span_us > 0 ? static_cast<double>(tip.sample.utime - before.utime) / span_us : 0;
    const double at_mm = before.insertion_mm + share * (after.insertion_mm - before.insertion_mm);
    widen(at_mm);
    out.push_back({at_mm, highest_mm - lowest_mm});
  }
  return out;
}

bool sees(const model::TipMeasurement& tip, Eigen::Index axis) { return tip.information_per_mm2(axis, axis) > 0; }

// Where the tip began: the median, of each axis, of the first few readings while the base had moved by less than 1 mm,
// since a camera may begin with something else. NaN along an axis that was not seen then.
Eigen::Vector3d tip_at_start(const PlacedReadings& readings, const std::vector<Base>& base) {
  constexpr double kAtStart_mm = 1;
  const std::size_t few = std::min<std::size_t>(readings.tips.size(), 9);
  Eigen::Vector3d start_mm;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> seen_mm;
    for (std::size_t i = 0; i < few && base[i].range_mm <= kAtStart_mm; ++i)
      if (sees(readings.tips[i].sample, axis)) seen_mm.push_back(readings.tips[i].sample.position_mm[axis]);
    std::ranges::sort(seen_mm);
    start_mm[axis] = seen_mm.empty() ? NAN : seen_mm[seen_mm.size() / 2];
  }
  return start_mm;
}

std::string far_tips(const PlacedReadings& readings, const std::vector<Base>& base, const std::string& path) {
  const Eigen::Vector3d start_mm = tip_at_start(readings, base);
  std::size_t far = 0;
  std::string where;
  for (std::size_t i = 1; i < readings.tips.size(); ++i) {
    const model::TipMeasurement& tip = readings.tips[i].sample;
    double moved_mm = 0, sigma_mm = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (!sees(tip, axis) || std::isnan(start_mm[axis])) continue;
      moved_mm = std::hypot(moved_mm, tip.position_mm[axis] - start_mm[axis]);
      sigma_mm = std::max(sigma_mm, 1 / std::sqrt(tip.information_per_mm2(axis, axis)));
    }
    const double allowed_mm = base[i].range_mm * (1 + kSlackShare) + kSlack_mm + kSlackSigmas * sigma_mm;
    if (moved_mm <= allowed_mm || far++ > 0) continue;
    where = path + ":" + std::to_string(readings.tips[i].line) + ": the tip is " + figure(moved_mm) +
            " mm from where it began (line " + std::to_string(readings.tips.front().line) +
            "), and the base had moved by " + figure(base[i].range_mm) + " mm; allowed " + figure(allowed_mm) + " mm";
  }
  if (far == 0) return "";
  const std::string share = std::to_string(far) + " of " + std::to_string(readings.tips.size()) + " tips";
  if (static_cast<double>(far) > kMostLeftOut * static_cast<double>(readings.tips.size()))
    throw ParseError(where + "; in all " + share +
                     " are too far. Are tip.unit, insertion.unit, the units of time and the columns right?");
  return where + "; in all " + share + " are too far, and stay in the log";
}

void require_inward(const PlacedReadings& readings, const std::vector<Base>& base, const std::string& path) {
  const double start_mm = tip_at_start(readings, base).z();
  if (std::isnan(start_mm)) return;
  std::vector<std::pair<double, std::size_t>> shares;
  for (std::size_t i = 1; i < readings.tips.size(); ++i) {
    const double in_mm = base[i].at_mm - base.front().at_mm;
    if (!sees(readings.tips[i].sample, 2)) continue;
    if (std::abs(in_mm) < kFollowFrom_mm || std::abs(in_mm) > kFollowTo_mm) continue;
    shares.emplace_back((readings.tips[i].sample.position_mm.z() - start_mm) / in_mm, i);
  }
  if (shares.empty()) return;
  std::ranges::sort(shares);
  const auto [share, i] = shares[shares.size() / 2];
  if (share >= kFollowShare) return;
  const double in_mm = base[i].at_mm - base.front().at_mm;
  throw ParseError(path + ":" + std::to_string(readings.tips[i].line) + ": the tip's z changed by " +
                   figure(share * in_mm) + " mm from line " + std::to_string(readings.tips.front().line) +
                   " on, while the insertion changed by " + figure(in_mm) +
                   " mm; allowed: " + figure(kFollowShare * in_mm) +
                   " mm or more in that direction, since z of {A} leads into the tissue. Are the units, the "
                   "signs and the order of " +
                   "tip.axes right?");
}

}  // namespace

void leave_out_the_implausible(PlacedReadings& readings, const std::string& tip_path, const std::string& base_path,
                               bool share_rows, std::vector<std::string>& left_out) {
  const std::size_t tips = readings.tips.size(), base = readings.base.size(), headings = readings.headings.size();
  const auto require_most = [&](std::size_t now, std::size_t before) {
    if (static_cast<double>(before - now) > kMostLeftOut * static_cast<double>(before))
      throw ParseError(left_out.front() + ", as are " + std::to_string(before - now - 1) + " others of " +
                       std::to_string(before) + "; at most 20 % may be");
  };
  // Without its worst rows a neighbour may stand out that did not before.
  for (;;) {
    std::set<std::int64_t> of_base, of_tip;
    const auto axes = samples_of(readings.base);
    note(judge(axes), readings.base, base_path, of_base, left_out);
    note(judge(samples_of(readings.tips), axes), readings.tips, tip_path, share_rows ? of_base : of_tip, left_out);
    note(judge(samples_of(readings.headings)), readings.headings, tip_path, share_rows ? of_base : of_tip, left_out);
    if (of_base.empty() && of_tip.empty()) break;
    drop(readings.base, of_base);
    drop(readings.tips, share_rows ? of_base : of_tip);
    drop(readings.headings, share_rows ? of_base : of_tip);
  }
  require_most(readings.base.size(), base);
  require_most(readings.tips.size(), tips);
  require_most(readings.headings.size(), headings);
}

std::string require_tip_follows_base(const PlacedReadings& readings, const std::string& tip_path) {
  if (readings.tips.size() < 2 || readings.base.empty()) return "";
  const std::vector<Base> base = base_at_tips(readings);
  require_inward(readings, base, tip_path);
  return far_tips(readings, base, tip_path);
}

}  // namespace bevel::io
