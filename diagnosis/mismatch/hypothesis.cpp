#include "diagnosis/mismatch/hypothesis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace bevel::diagnosis {
namespace {
constexpr double kCurvatureMax_per_mm = 0.05;
constexpr double kSmallestU = 1e-9;      // (26) is strict
constexpr double kFewestReadings = 2.5;  // a period
constexpr double kFewestPeriods = 1.5;   // of the longest recording
}  // namespace

std::string describe(const EffectSet& set) {
  if (set.empty()) return "nothing";
  std::string text;
  for (const auto& member : set) text += (text.empty() ? "" : " + ") + std::string(member.effect->name());
  return text;
}

bool can_be_fitted(const EffectSet& set) {
  int unknowns = kBaseUnknowns;
  for (const auto& member : set)
    for (std::size_t p = 0; p < member.effect->parameters().size(); ++p) unknowns += member.fits(p) ? 1 : 0;
  return unknowns <= model::kMaxColumns;
}

Hypothesis::Hypothesis(const model::NeedleParameters& needle, EffectSet set, const RecordedCase& recorded)
    : needle_(needle), set_(std::move(set)) {
  unknowns_.push_back({.lower = -kCurvatureMax_per_mm, .upper = kCurvatureMax_per_mm});
  unknowns_.push_back({.lower = kSmallestU, .upper = 5});
  unknowns_.push_back({.lower = -2, .upper = 0.9});
  columns_.assign(recorded.recordings.size(), {0, 1, 2});
  double longest_s = 0;
  for (const auto& recording : recorded.recordings) longest_s = std::max(longest_s, recording.duration_s());
  for (std::size_t m = 0; m < set_.size(); ++m) {
    const auto& parameters = set_[m].effect->parameters();
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      if (!set_[m].fits(p)) continue;
      Unknown unknown{static_cast<int>(m), static_cast<int>(p), -1,
                      parameters[p].lower, parameters[p].upper, parameters[p].periodic};
      if (parameters[p].frequency) {
        // Hardly more than a period in the longest recording is a drift, and readings too far apart show another
        // frequency.
        unknown.lower = std::max(unknown.lower, kFewestPeriods / std::max(longest_s, 1e-3));
        unknown.upper = std::max(unknown.lower, std::min(unknown.upper, 1 / (kFewestReadings * recorded.frame_s)));
      }
      if (parameters[p].scope == model::Scope::rig) {
        for (auto& columns : columns_) columns.push_back(static_cast<int>(unknowns_.size()));
        unknowns_.push_back(unknown);
        continue;
      }
      for (std::size_t r = 0; r < columns_.size(); ++r) {
        unknown.recording = static_cast<int>(r);
        unknown.upper = parameters[p].periodic ? parameters[p].upper
                                               : std::min(parameters[p].upper, recorded.recordings[r].duration_s());
        columns_[r].push_back(static_cast<int>(unknowns_.size()));
        unknowns_.push_back(unknown);
      }
    }
  }
  for (const auto& columns : columns_)
    if (columns.size() > static_cast<std::size_t>(model::kMaxColumns))
      throw std::invalid_argument(describe(set_) + " has " + std::to_string(columns.size()) +
                                  " unknowns a recording; at most " + std::to_string(model::kMaxColumns) +
                                  " are supported");
}

int Hypothesis::find(std::size_t member, std::size_t parameter, int recording) const {
  for (std::size_t i = 0; i < unknowns_.size(); ++i) {
    const Unknown& u = unknowns_[i];
    if (u.member == static_cast<int>(member) && u.parameter == static_cast<int>(parameter) &&
        (u.recording < 0 || u.recording == recording))
      return static_cast<int>(i);
  }
  return -1;
}

Eigen::VectorXd Hypothesis::start() const {
  Eigen::VectorXd values(size());
  values[kUnknownK] = needle_.curvature_per_mm;
  values[kUnknownU] = needle_.lambda1_per_rad - needle_.lambda2 * needle_.lambda2 / (2 * std::numbers::pi);
  values[kUnknownLambda2] = needle_.lambda2;
  for (Eigen::Index i = kBaseUnknowns; i < size(); ++i) {
    const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
    const auto& parameter =
        set_[static_cast<std::size_t>(u.member)].effect->parameters()[static_cast<std::size_t>(u.parameter)];
    values[i] = std::isnan(parameter.none) ? parameter.starts.front() : parameter.none;
  }
  clamp(values);
  return values;
}

Eigen::VectorXd Hypothesis::start_from(const Hypothesis& other, const Eigen::VectorXd& theirs) const {
  Eigen::VectorXd values = start();
  values.head<kBaseUnknowns>() = theirs.head<kBaseUnknowns>();
  for (std::size_t i = kBaseUnknowns; i < unknowns_.size(); ++i) {
    const Unknown& u = unknowns_[i];
    const auto same = std::find(other.set_.begin(), other.set_.end(), set_[static_cast<std::size_t>(u.member)]);
    if (same == other.set_.end()) continue;
    const int j = other.find(static_cast<std::size_t>(same - other.set_.begin()), static_cast<std::size_t>(u.parameter),
                             u.recording);
    if (j >= 0) values[static_cast<Eigen::Index>(i)] = theirs[j];
  }
  return values;
}

void Hypothesis::clamp(Eigen::VectorXd& values) const {
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Unknown& u = unknowns_[static_cast<std::size_t>(i)];
    if (u.periodic) {
      const double period = u.upper - u.lower;
      const double turns = std::floor((values[i] - u.lower) / period);
      values[i] -= period * turns;
      if (std::fmod(turns, 2) != 0) turn_partners(u, values);
    }
    values[i] = std::clamp(values[i], u.lower, u.upper);
  }
}

// A swing along a line at an angle is the one along the line turned by a half turn, in opposite phase.
void Hypothesis::turn_partners(const Unknown& turned, Eigen::VectorXd& values) const {
  const auto& parameters = set_[static_cast<std::size_t>(turned.member)].effect->parameters();
  const int partner = parameters[static_cast<std::size_t>(turned.parameter)].half_turns;
  for (std::size_t j = 0; partner >= 0 && j < unknowns_.size(); ++j)
    if (unknowns_[j].member == turned.member && unknowns_[j].parameter == partner)
      values[static_cast<Eigen::Index>(j)] += 0.5 * (unknowns_[j].upper - unknowns_[j].lower);
}

model::NeedleParameters Hypothesis::needle(const Eigen::VectorXd& values) const {
  model::NeedleParameters needle = needle_;
  needle.curvature_per_mm = values[kUnknownK];
  needle.lambda2 = values[kUnknownLambda2];
  needle.lambda1_per_rad = values[kUnknownU] + needle.lambda2 * needle.lambda2 / (2 * std::numbers::pi);
  return needle;
}

double Hypothesis::parameter(const Eigen::VectorXd& values, std::size_t member, std::size_t parameter,
                             int recording) const {
  const int i = find(member, parameter, recording);
  if (i >= 0) return values[i];
  const double none = set_[member].effect->parameters()[parameter].none;
  return std::isnan(none) ? set_[member].effect->parameters()[parameter].starts.front() : none;
}

model::AugmentedNeedle Hypothesis::make_needle(std::size_t recording, const Eigen::VectorXd& values,
                                               bool with_columns) const {
  const auto& columns = columns_[recording];
  std::vector<model::ActiveEffect> effects(set_.size());
  for (std::size_t m = 0; m < set_.size(); ++m) {
    effects[m].effect = set_[m].effect;
    for (std::size_t p = 0; p < set_[m].effect->parameters().size(); ++p) {
      const int unknown = find(m, p, static_cast<int>(recording));
      const auto column = std::find(columns.begin(), columns.end(), unknown);
      const bool moves = with_columns && unknown >= 0 && column != columns.end();
      effects[m].parameters[p] = model::Dual::unknown(parameter(values, m, p, static_cast<int>(recording)),
                                                      moves ? static_cast<int>(column - columns.begin()) : -1);
    }
  }
  if (!with_columns) return model::AugmentedNeedle(needle(values), std::move(effects));
  return model::AugmentedNeedle(needle(values), std::move(effects), static_cast<int>(columns.size()),
                                {.curvature = 0, .lambda1 = 1, .lambda2 = 2, .wheelbase = -1});
}

}  // namespace bevel::diagnosis
