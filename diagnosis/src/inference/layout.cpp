// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/inference/layout.hpp>

#include <algorithm>
#include <cmath>

namespace bevel::inference {

using Eigen::Index;
using Eigen::VectorXd;

Layout::Layout(const System& system, ModelSet set) : system_(&system), set_(std::move(set)) {
  const auto& base = system.base();
  for (std::size_t i = 0; i < base.size(); ++i) shared_.push_back({-1, static_cast<int>(i), &base[i]});
  for (std::size_t i = 0; i < system.nuisances().size(); ++i) local_.push_back({-1, static_cast<int>(i), nullptr});
  for (std::size_t m = 0; m < set_.size(); ++m) {
    const auto& parameters = system.effects()[set_[m]].parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p)
      (parameters[p].scope == Scope::shared ? shared_ : local_)
          .push_back({static_cast<int>(m), static_cast<int>(p), &parameters[p]});
  }
}

int Layout::find(const std::vector<Unknown>& unknowns, std::size_t member, std::size_t parameter) {
  for (std::size_t i = 0; i < unknowns.size(); ++i)
    if (unknowns[i].member == static_cast<int>(member) && unknowns[i].index == static_cast<int>(parameter))
      return static_cast<int>(i);
  return -1;
}

bool Layout::is_instant(std::size_t local) const {
  return local_[local].parameter != nullptr && local_[local].parameter->scope == Scope::instant;
}

bool Layout::is_fitted(std::size_t local) const { return !is_instant(local) || !local_[local].parameter->jumps; }

double Layout::upper(std::size_t local, std::size_t recording) const {
  const Parameter& parameter = *local_[local].parameter;
  return parameter.scope == Scope::instant ? std::min(parameter.upper, system_->data().recordings[recording].duration_s)
                                           : parameter.upper;
}

VectorXd Layout::shared_start() const {
  VectorXd out(static_cast<Index>(shared_.size()));
  for (std::size_t i = 0; i < shared_.size(); ++i) {
    const Parameter& p = *shared_[i].parameter;
    out[static_cast<Index>(i)] = shared_[i].member < 0 ? p.prior.middle
                                 : std::isnan(p.none)  ? p.starts.front()
                                                       : p.none;
  }
  return out;
}

int Layout::place_in(const Layout& other, const Unknown& unknown, bool shared) const {
  const auto& theirs = shared ? other.shared_ : other.local_;
  if (unknown.member < 0) {
    for (std::size_t i = 0; i < theirs.size(); ++i)
      if (theirs[i].member < 0 && theirs[i].index == unknown.index) return static_cast<int>(i);
    return -1;
  }
  const std::size_t effect = set_[static_cast<std::size_t>(unknown.member)];
  const auto at = std::find(other.set_.begin(), other.set_.end(), effect);
  if (at == other.set_.end()) return -1;
  return find(theirs, static_cast<std::size_t>(at - other.set_.begin()), static_cast<std::size_t>(unknown.index));
}

VectorXd Layout::shared_from(const Layout& other, const VectorXd& values) const {
  VectorXd out = shared_start();
  for (std::size_t i = 0; i < shared_.size(); ++i)
    if (const int j = place_in(other, shared_[i], true); j >= 0) out[static_cast<Index>(i)] = values[j];
  return out;
}

VectorXd Layout::local_from(const Layout& other, const VectorXd& values) const {
  VectorXd out = local_start();
  for (std::size_t i = 0; i < local_.size(); ++i)
    if (const int j = place_in(other, local_[i], false); j >= 0) out[static_cast<Index>(i)] = values[j];
  return out;
}

void Layout::clamp(VectorXd& shared, std::vector<VectorXd>& local) const {
  for (std::size_t i = 0; i < shared_.size(); ++i) {
    const Parameter& p = *shared_[i].parameter;
    double& value = shared[static_cast<Index>(i)];
    if (p.periodic) {
      const double turns = std::floor((value - p.lower) / (p.upper - p.lower));
      value -= (p.upper - p.lower) * turns;
      // A swing along a line at an angle is the one along the line turned by a half turn, in opposite phase.
      if (std::fmod(turns, 2) != 0 && p.half_turns >= 0) {
        const auto member = static_cast<std::size_t>(shared_[i].member);
        const int partner = find_local(member, static_cast<std::size_t>(p.half_turns));
        const Parameter& turned = system_->effects()[set_[member]].parameters[static_cast<std::size_t>(p.half_turns)];
        if (partner >= 0)
          for (auto& one : local) one[partner] += 0.5 * (turned.upper - turned.lower);
      }
    }
    value = std::clamp(value, p.lower, p.upper);
  }
  for (std::size_t i = 0; i < local_.size(); ++i) {
    if (!local_[i].parameter) continue;
    const Parameter& p = *local_[i].parameter;
    for (std::size_t r = 0; r < local.size(); ++r) {
      double& value = local[r][static_cast<Index>(i)];
      if (p.scope == Scope::phase)
        value -= (p.upper - p.lower) * std::floor((value - p.lower) / (p.upper - p.lower));
      else if (value != 0)
        value = std::clamp(value, std::max(p.lower, kEarliest_s), upper(i, r));
    }
  }
}

ModelSet with(const ModelSet& set, std::size_t effect) {
  ModelSet out = set;
  out.insert(std::upper_bound(out.begin(), out.end(), effect), effect);
  return out;
}

ModelSet without(const ModelSet& set, std::size_t effect) {
  ModelSet out = set;
  std::erase(out, effect);
  return out;
}

bool contains(const ModelSet& set, std::size_t effect) { return std::binary_search(set.begin(), set.end(), effect); }

std::string describe(const System& system, const ModelSet& set) {
  if (set.empty()) return "nothing";
  std::string text;
  for (const std::size_t e : set) text += (text.empty() ? "" : " + ") + system.effects()[e].label;
  return text;
}

}  // namespace bevel::inference
