// SPDX-License-Identifier: MIT
#include "tests/ceiling/generator_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <bevel/error.hpp>
#include "proof/beam_path.hpp"

namespace bevel::ceiling {

using diagnosis::kBaseParameters;
using diagnosis::kVariations;
using Eigen::Index;
using Eigen::VectorXd;
using inference::Effect;
using inference::ModelSet;
using inference::Parameter;
using inference::Scope;
using proof::HiddenPhysics;
using proof::ParameterRange;

namespace {

constexpr double kNoNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kAngle_rad = 1e-5;  // steps of differences: errors of second order are far below a micrometre
constexpr double kShare = 1e-4;      // of a range
constexpr double kEvent_mm = 0.05;   // an event's depth: at 10 mm/s five milliseconds of the generator
constexpr double kJump_mm = 1e-6;    // so little that the last of a hundred jumps stays in its millisecond
constexpr int kStarts = 7;           // of what has many local minima; the engine scans from five on

// Depths, lengths and periods whose likelihood has many local minima.
bool is_scanned(const std::string& effect, const std::string& parameter) {
  return parameter == "depth_mm" || parameter == "jump_mm" || parameter == "period_mm" ||
         ((effect == "tissue_motion" || effect == "stand_sway") && parameter == "frequency_hz");
}

Parameter parameter_of(const std::string& effect, const ParameterRange& range) {
  const double reach = std::max(std::abs(range.high - range.neutral), std::abs(range.low - range.neutral));
  Parameter out{.name = range.name,
                .lower = range.low,
                .upper = range.high,
                .none = range.is_size ? range.neutral : kNoNone,
                .starts = {0.5 * (range.low + range.high)},
                .prior = {}};
  if (range.is_size) {  // as far as a fit may go; where the generator goes is in its prior
    out.lower = range.either_sign || range.neutral == 1 ? range.neutral - 3 * reach : 0;
    out.upper = range.neutral + 3 * reach;
    if (range.neutral == 1) out.lower = std::max(out.lower, 0.2);
  }
  if (is_scanned(effect, range.name)) {
    out.shape = true;
    out.starts.clear();
    for (int i = 0; i < kStarts; ++i) out.starts.push_back(range.low + (range.high - range.low) * i / (kStarts - 1));
  }
  out.prior = inference::flat_prior(out.lower, out.upper);
  return out;
}

Slot slot_of(const std::string& effect, const ParameterRange& range) {
  const double reach = std::max(std::abs(range.high - range.neutral), std::abs(range.low - range.neutral));
  Slot out{.physics = range.slot, .step = kShare * reach, .is_size = range.is_size, .range = range};
  out.in_steps = (effect == "puncture" || effect == "layer") && out.range.name != std::string("curvature_ratio");
  if (out.in_steps) out.step = kEvent_mm;
  if (effect == "stick_slip") out.step = kJump_mm;
  return out;
}

}  // namespace

GeneratorSystem::GeneratorSystem(const diagnosis::NeedleSystem& needle, const proof::Trial& trial,
                                 const proof::DriveRipple& ripple)
    : needle_(needle),
      wheelbase_mm_(trial.truth.needle.wheelbase_mm),
      departure_(trial.truth.departure),
      tangents_(trial.recordings.size()) {
  const auto& data = needle.data();
  for (std::size_t r = 0; r < trial.recordings.size(); ++r) {
    const proof::Frames& frames = trial.recordings[r].frames;
    settings_.push_back({.motions = {trial.recordings[r].motion},
                         .frames = {frames},
                         .whiteners = {},
                         .ripple = ripple,
                         .variation = {{}},
                         .absorbers = {},
                         .changed = {}});
    frame_.emplace_back();
    axis_.emplace_back(data.recordings[r].rows(), 3);
    for (std::size_t c = 0; c < data.recordings[r].series.size(); ++c)
      for (const double time_s : data.recordings[r].series[c].time_s) {
        constexpr double kStamp_s = 2e-6;  // a stamp counts microseconds
        const auto at = std::ranges::lower_bound(frames.times_s, time_s - kStamp_s);
        if (at == frames.times_s.end() || std::abs(*at - time_s) > kStamp_s)
          throw std::invalid_argument("recording " + std::to_string(r + 1) + ": no frame of the trial at " +
                                      std::to_string(time_s) + " s; the logs are of another trial");
        axis_.back().row(static_cast<Index>(frame_.back().size())) = needle.recorded().channels[c].axis.transpose();
        frame_.back().push_back(at - frames.times_s.begin());
      }
  }
  add_kinds();
  add_beam();
}

void GeneratorSystem::add_kinds() {
  double longest_s = 0;
  for (const auto& one : data().recordings) longest_s = std::max(longest_s, one.duration_s);
  const auto add = [&](const proof::EffectKind& kind, const std::string& label) {
    Effect effect{.name = kind.listed ? kind.name : "unknown", .label = label, .parameters = {}};
    std::vector<Slot> slots;
    for (const ParameterRange& range : kind.parameters) {
      if (range.name[0] == '\0') continue;
      effect.parameters.push_back(parameter_of(kind.name, range));
      slots.push_back(slot_of(kind.name, range));
    }
    if (effect.name == "lost_steps")
      effect.parameters.push_back({.name = "at_s",
                                   .lower = 0,
                                   .upper = 1e4,
                                   .none = 0,
                                   .starts = {0.0},
                                   .prior = inference::flat_prior(0, longest_s),
                                   .scope = Scope::instant});
    if (effect.name == "tissue_motion") {
      // Half a turn of the direction is half a period of the phase.
      effect.parameters.back().periodic = true;
      effect.parameters.back().half_turns = static_cast<int>(effect.parameters.size());
      effect.parameters.push_back({.name = "phase_rad",
                                   .lower = 0,
                                   .upper = kTurn,
                                   .none = kNoNone,
                                   .starts = {0.0},
                                   .prior = inference::flat_prior(0, kTurn),
                                   .scope = Scope::phase,
                                   .periodic = true});
    }
    if (label == "side_gradient" || label == "oblique_interface") effect.parameters.back().periodic = true;
    effects_.push_back(std::move(effect));
    slots_.push_back(std::move(slots));
  };
  for (const proof::EffectKind& kind : proof::catalogue()) {
    if (kind.name != std::string("lost_steps")) {
      add(kind, kind.name);
      continue;
    }
    add(kind, "lost_steps (rotation)");
    add({"lost_steps", true, {{"insertion_mm", &HiddenPhysics::lost_insertion_mm, 0.8, 3, true, true, 0}}},
        "lost_steps (insertion)");
  }
}

// What draw_beam() draws from.
void GeneratorSystem::add_beam() {
  using Beam = model::BeamPlantConfig;
  const auto add = [&](const char* name, double Beam::*slot, double low, double high, bool logarithmic) {
    const double from = logarithmic ? std::log(low) : low, to = logarithmic ? std::log(high) : high;
    effects_.back().parameters.push_back({.name = name,
                                          .lower = from,
                                          .upper = to,
                                          .none = kNoNone,
                                          .starts = {0.5 * (from + to)},
                                          .prior = inference::flat_prior(from, to)});
    slots_.back().push_back({.beam = slot, .logarithmic = logarithmic, .step = 1e-3 * (to - from)});
  };
  effects_.push_back({.name = "tip_swing", .label = "tip_swing", .parameters = {}});
  slots_.emplace_back();
  add("foundation_modulus_kPa", &Beam::foundation_modulus_kPa, 3, 20, true);
  add("bevel_force_N", &Beam::bevel_force_N, 0.7, 1.2, false);
  add("guide_gap_mm", &Beam::guide_gap_mm, 0.5, 10, false);
  effects_.push_back({.name = "unknown", .label = "beam_relaxation", .parameters = {}});
  slots_.emplace_back();
  add("relaxing_fraction", &Beam::relaxing_fraction, 0.1, 0.4, false);
  add("relaxation_time_s", &Beam::relaxation_time_s, 1, 6, false);
}

int GeneratorSystem::find(const proof::ConcealedEffect& effect) const {
  for (std::size_t e = 0; e < effects_.size(); ++e) {
    const bool named = effect.kind.empty() ? effects_[e].name == effect.name : effects_[e].label == effect.kind;
    if (!named || on_a_list(e) != effect.kind.empty()) continue;
    // Parameters that a rival of the library has and the generator has not are left out, but for those of another kind.
    if (effect.name == "lost_steps" && !effect.parameters.contains(effects_[e].parameters.front().name)) continue;
    return static_cast<int>(e);
  }
  return -1;
}

bool GeneratorSystem::allows(const ModelSet& set) const {
  bool beam = false, relaxing = false, lost = false;
  for (const std::size_t e : set) {
    beam = beam || effects_[e].label == "tip_swing";
    relaxing = relaxing || effects_[e].label == "beam_relaxation";
    if (effects_[e].name != "lost_steps") continue;
    if (lost) return false;
    lost = true;
  }
  if (relaxing && !beam) return false;
  return !beam || set.size() == (relaxing ? 2U : 1U);
}

GeneratorSystem::Plant GeneratorSystem::plant_of(const ModelSet& set, const VectorXd& shared,
                                                 const VectorXd& local) const {
  Plant plant;
  const double lambda2 = shared[diagnosis::kLambda2];
  plant.needle = {shared[diagnosis::kCurvature], wheelbase_mm_, shared[diagnosis::kU] + lambda2 * lambda2 / kTurn,
                  lambda2};
  plant.physics.departure = departure_;
  plant.beam.max_depth_mm = 120;
  plant.own = {local[diagnosis::kOwnCurvature], local[diagnosis::kTiltX],  local[diagnosis::kTiltY],
               local[diagnosis::kEntryX],       local[diagnosis::kEntryY], local[diagnosis::kRoll]};
  Index next_shared = kBaseParameters, next_local = kVariations;
  for (const std::size_t e : set) {
    plant.is_beam = plant.is_beam || effects_[e].label == "tip_swing";
    if (effects_[e].name == "slip_direction") plant.physics.other_slip = 1;
    for (std::size_t p = 0; p < effects_[e].parameters.size(); ++p) {
      const Scope scope = effects_[e].parameters[p].scope;
      if (scope == Scope::instant) plant.physics.lost_at_s[0] = local[next_local++];
      if (scope == Scope::phase) plant.physics.motion_phase_rad[0] = local[next_local++];
      if (scope != Scope::shared) continue;
      const Slot& slot = slots_[e][p];
      const double value = slot.logarithmic ? std::exp(shared[next_shared]) : shared[next_shared];
      ++next_shared;
      if (slot.physics) plant.physics.*slot.physics = value;
      if (slot.beam) plant.beam.*slot.beam = value;
    }
  }
  return plant;
}

bool GeneratorSystem::read(const proof::Setting& setting, const Plant& plant, std::size_t r, VectorXd& out) const {
  thread_local proof::Setting here;
  here = setting;
  here.variation[0] = plant.own;
  try {
    const proof::Views views =
        plant.is_beam ? proof::views_of(here, plant.beam) : proof::views_of(here, plant.needle, plant.physics);
    out.resize(axis_[r].rows());
    for (Index row = 0; row < out.size(); ++row)
      out[row] = axis_[r].row(row).dot(views[0].col(frame_[r][static_cast<std::size_t>(row)]));
  } catch (const DomainError&) {
    return false;
  } catch (const ArgumentError&) {
    return false;
  }
  return out.allFinite();
}

VectorXd GeneratorSystem::reach_of_shared(const ModelSet& set) const {
  std::vector<double> out{1e-4, 0.02, 0.02};  // a fiftieth of k, and of what lambda does
  for (const std::size_t e : set)
    for (std::size_t p = 0; p < slots_[e].size(); ++p) {
      const Slot& slot = slots_[e][p];
      constexpr double kFiftieth = 0.02;
      const double range = slot.beam ? effects_[e].parameters[p].upper - effects_[e].parameters[p].lower
                                     : std::max(std::abs(slot.range.high - slot.range.neutral),
                                                std::abs(slot.range.low - slot.range.neutral));
      out.push_back(kFiftieth * range);
    }
  return Eigen::Map<const VectorXd>(out.data(), static_cast<Index>(out.size()));
}

bool GeneratorSystem::still_holds(const Tangent& tangent, const ModelSet& set, const VectorXd& shared,
                                  const VectorXd& local, const VectorXd& reading) const {
  constexpr double kForetold_mm = 1e-3, kForetold = 0.01;  // of the readings' change, root mean squares
  if (tangent.set != set || tangent.prediction.by_shared.size() == 0) return false;
  const VectorXd by = shared - tangent.shared, by_own = local - tangent.local;
  VectorXd reach_own = VectorXd::Zero(local.size());  // an instant is another model
  reach_own.head<kVariations>() << 0.02, 3e-3, 3e-3, 0.02, 1e9, 1e9;
  Index own = kVariations;
  for (const std::size_t e : set)
    for (const Parameter& parameter : effects_[e].parameters)
      if (parameter.scope != Scope::shared) reach_own[own++] = parameter.scope == Scope::phase ? 0.05 : 0;
  if ((by.cwiseAbs() - reach_of_shared(set)).maxCoeff() > 0 || (by_own.cwiseAbs() - reach_own).maxCoeff() > 0)
    return false;
  const VectorXd change = reading - tangent.prediction.reading;
  const VectorXd missed = change - tangent.prediction.by_shared * by - tangent.prediction.by_local * by_own;
  return missed.norm() <
         std::max(kForetold * change.norm(), kForetold_mm * std::sqrt(static_cast<double>(reading.size())));
}

bool GeneratorSystem::predict(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd& local,
                              bool derivatives, inference::Prediction& out) const {
  if (!read(settings_[r], plant_of(set, shared, local), r, out.reading)) return false;
  if (!derivatives) return true;
  Tangent& tangent = tangents_[r];
  const std::scoped_lock lock(tangent.mutex);
  if (!still_holds(tangent, set, shared, local, out.reading)) {
    if (!differentiate(set, r, shared, local, out)) return false;
    tangent.set = set;
    tangent.shared = shared;
    tangent.local = local;
    tangent.prediction = out;
  }
  out.by_shared = tangent.prediction.by_shared;
  out.by_local = tangent.prediction.by_local;
  return true;
}

// Beside out.reading, which stands.
bool GeneratorSystem::differentiate(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd& local,
                                    inference::Prediction& out) const {
  const proof::Setting& setting = settings_[r];
  const auto at = [&](const VectorXd& s, const VectorXd& l, VectorXd& reading) {
    return read(setting, plant_of(set, s, l), r, reading);
  };
  out.by_shared = Eigen::MatrixXd::Zero(out.reading.size(), shared.size());
  out.by_local = Eigen::MatrixXd::Zero(out.reading.size(), local.size());
  VectorXd moved = shared, moved_local = local, there, back;
  const auto by_difference = [&](VectorXd& values, Index i, double step, bool both_sides, double lower, double upper) {
    const double value = values[i];
    const double up = value + step > upper ? value : value + step;
    const double down = (both_sides || up == value) && value - step >= lower ? value - step : value;
    values[i] = up;
    bool defined = up == value || at(moved, moved_local, there);
    if (up == value) there = out.reading;
    values[i] = down;
    defined = defined && (down == value || at(moved, moved_local, back));
    if (down == value) back = out.reading;
    values[i] = value;
    return defined && up > down ? VectorXd((there - back) / (up - down)) : VectorXd::Zero(out.reading.size()).eval();
  };
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const bool beam = std::ranges::any_of(set, [&](std::size_t e) { return effects_[e].label == "tip_swing"; });
  for (const int i : {diagnosis::kOwnCurvature, diagnosis::kTiltX, diagnosis::kTiltY, diagnosis::kRoll})
    out.by_local.col(i) =
        by_difference(moved_local, i, i == diagnosis::kOwnCurvature ? kShare : kAngle_rad, false, -kFar, kFar);
  out.by_local.col(diagnosis::kEntryX) = axis_[r].col(0);
  out.by_local.col(diagnosis::kEntryY) = axis_[r].col(1);
  if (!beam) {  // of which k, lambda1 and lambda2 are no part
    const double k = shared[diagnosis::kCurvature], own = 1 + local[diagnosis::kOwnCurvature];
    out.by_shared.col(diagnosis::kCurvature) =
        std::abs(k) > 1e-5 ? VectorXd(own / k * out.by_local.col(diagnosis::kOwnCurvature))
                           : by_difference(moved, diagnosis::kCurvature, 1e-7, false, -kFar, kFar);
    for (const int i : {diagnosis::kU, diagnosis::kLambda2})
      out.by_shared.col(i) = by_difference(moved, i, kAngle_rad, false, -kFar, kFar);
  }
  Index next_shared = kBaseParameters, next_local = kVariations;
  for (const std::size_t e : set)
    for (std::size_t p = 0; p < effects_[e].parameters.size(); ++p) {
      const Parameter& parameter = effects_[e].parameters[p];
      if (parameter.scope != Scope::shared) {
        if (parameter.scope == Scope::phase)
          out.by_local.col(next_local) = by_difference(moved_local, next_local, kAngle_rad, false, -kFar, kFar);
        ++next_local;
        continue;
      }
      const Slot& slot = slots_[e][p];
      out.by_shared.col(next_shared) =
          by_difference(moved, next_shared, slot.step, slot.in_steps, parameter.lower, parameter.upper);
      ++next_shared;
    }
  return true;
}

VectorXd GeneratorSystem::by_inputs(const ModelSet& set, std::size_t r, const VectorXd& shared,
                                    const VectorXd& local) const {
  constexpr double kBase_mm = 0.01;  // that of NeedleSystem::by_inputs, for the same effects
  const auto sudden = [&](std::size_t e) { return effects_[e].name == "puncture" || effects_[e].name == "stick_slip"; };
  if (std::ranges::none_of(set, sudden)) return {};
  proof::Setting setting = settings_[r];
  auto& insertion_mm = setting.motions[0].insertion_mm;
  const auto shift = [&](double by_mm) {
    for (std::size_t i = 1; i < insertion_mm.size(); ++i) insertion_mm[i] += by_mm;
  };
  const Plant plant = plant_of(set, shared, local);
  VectorXd ahead, behind;
  shift(kBase_mm);
  if (!read(setting, plant, r, ahead)) return {};
  shift(-2 * kBase_mm);
  if (!read(setting, plant, r, behind)) return {};
  return 0.5 * (ahead - behind).cwiseAbs();
}

}  // namespace bevel::ceiling
