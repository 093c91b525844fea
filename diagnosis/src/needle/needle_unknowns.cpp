// SPDX-License-Identifier: MIT
// What is unknown of a needle: its parameters, the variation between insertions, the library's effects, what changed,
// and errors that all recordings share; each with its prior.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <bevel/diagnosis/needle/needle_system.hpp>
#include <bevel/error.hpp>

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using inference::ModelSet;
using inference::Scope;

namespace {

// The lab's own belief in its model file: half of k, and all of Table I and beyond for lambda.
constexpr double kCurvatureShare = 0.5;
// A shaft that rotates by less while it inserts, in every recording, does not separate slip from curvature: both bend
// the path in one plane. The entry angle of real rigs is uncertain by as much. Lambda then keeps the value of the model
// file, to within kHeldWidth (1/rad and 1).
constexpr double kSeparatesSlip_rad = 0.1;
constexpr double kHeldWidth = 1e-4;
constexpr double kCurvatureMax_per_mm = 0.05;
constexpr double kSmallestU = 1e-9;      // (26) is strict
constexpr double kExpectedShare = 0.75;  // scale of a size's prior, of the largest that is reported
constexpr double kFewestReadings = 2.5;  // a period
constexpr double kFewestPeriods = 1.5;   // of the longest recording
// Beside the variation, three effects and two curves: kMaxEffects. A hand's variation is two effects.
constexpr std::size_t kMostKnown = 2, kMostKnownByHand = 1;

// By how much a parameter of the needle changed from one group of recordings to the other; NeedleSystem::needle_in
// knows what it does.
class NeedleChange final : public model::Effect {
 public:
  NeedleChange(std::string_view name, std::string_view meaning, model::EffectParameter parameter)
      : Effect({.name = name,
                .meaning = meaning,
                .covariate = model::Covariate::depth_mm,
                .parameters = {std::move(parameter)}}) {}
};
// In the order of BaseParameter. Reported: phantoms and tissues of one lab, as far as Table I is apart.
const std::array<const model::Effect*, kBaseParameters>& needle_changes() {
  static const NeedleChange curvature(
      "curvature_per_mm", "the needle's curvature changed",
      {.name = "change_relative", .lower = -0.95, .upper = 3, .none = 0, .starts = {0.05}, .reported = 0.5});
  static const NeedleChange lambda1(
      "lambda1_per_rad", "the needle's slip changed",
      {.name = "change_per_rad", .lower = -3, .upper = 3, .none = 0, .starts = {0.05}, .reported = 0.5});
  static const NeedleChange lambda2(
      "lambda2", "the needle's slip while turning changed",
      {.name = "change", .lower = -1.5, .upper = 1.5, .none = 0, .starts = {0.05}, .reported = 0.3});
  static const std::array<const model::Effect*, kBaseParameters> all{&curvature, &lambda1, &lambda2};
  return all;
}

// Candidate standard deviations between insertions. Curvature varies by 10 to 40 % in tissue and by a few per cent in
// gelatin. Entry angles vary by 0.2 to 0.7 degrees on a stage, and by up to 0.1 rad by hand or where the frame is
// fitted to each path. Registration varies by some tenths of a millimetre, and by millimetres between set-ups. A bevel
// that is set by hand varies by a few degrees; unmarked shafts vary by 30 degrees. Depths that are read by hand begin
// up to a millimetre off. A hand that guides a needle bends it by some tenths of a millimetre in 100 mm (a gradient of
// 1e-4: 0.17 mm).
std::vector<inference::NuisanceGroup> variation_groups(bool by_hand) {
  std::vector<inference::NuisanceGroup> out{{"curvature", "relative", {0, 0.02, 0.05, 0.12, 0.3, 0.6}},
                                            {"entry_angle", "rad", {0, 0.003, 0.007, 0.018, 0.05, 0.15}},
                                            {"entry_point", "mm", {0, 0.05, 0.12, 0.35, 1, 3}},
                                            {"roll", "rad", {0, 0.015, 0.04, 0.1, 0.25, 0.5}}};
  if (by_hand) {
    out.push_back({"entry_depth", "mm", {0, 0.1, 0.3, 1, 3}});
    out.push_back({"bend_gradient", "1/mm per 100 mm", {0, 1e-5, 3e-5, 1e-4, 3e-4}});
  }
  return out;
}

inference::Prior prior_of(std::string_view effect, const model::EffectParameter& p) {
  const bool sized = !std::isnan(p.none);
  if (sized ? !(p.reported > 0) : !p.periodic && !(p.likely_low < p.likely_high))
    throw ArgumentError("effect " + std::string(effect) + ", parameter " + std::string(p.name) +
                        (sized ? ": reported is " + std::to_string(p.reported) +
                                     "; required: above 0, the largest size that is reported"
                               : ": likely_low to likely_high is empty; required: the range that is likely") +
                        ". The prior density follows from it; set it in the effect's source file");
  if (sized) {
    auto prior = inference::size_prior(p.none, kExpectedShare * p.reported, p.lower, p.upper);
    prior.least_distance = p.smallest_seen;
    prior.largest = p.largest_seen;
    return prior;
  }
  if (p.periodic) return inference::flat_prior(p.lower, p.upper);
  return inference::flat_prior(p.likely_low, p.likely_high, p.lower, p.upper);
}

inference::Parameter parameter_of(std::string_view effect, const model::EffectParameter& p,
                                  const RecordedCase& recorded) {
  double longest_s = 0;
  for (const auto& recording : recorded.recordings) longest_s = std::max(longest_s, recording.duration_s());
  inference::Parameter out{.name = std::string(p.name),
                           .lower = p.lower,
                           .upper = p.upper,
                           .none = p.none,
                           .starts = p.starts,
                           .prior = {},
                           .scope = Scope::shared,
                           .periodic = p.periodic,
                           .shape = p.shape,
                           .half_turns = p.half_turns};
  if (p.scope == model::Scope::recording) out.scope = p.periodic ? Scope::phase : Scope::instant;
  if (p.frequency) {
    // Hardly more than a period in the longest recording is a drift, and readings too far apart show another frequency.
    out.lower = std::max(out.lower, kFewestPeriods / std::max(longest_s, 1e-3));
    out.upper = std::max(out.lower, std::min(out.upper, 1 / (kFewestReadings * recorded.frame_s)));
    std::erase_if(out.starts, [&](double start) { return start < out.lower || start > out.upper; });
    if (out.starts.empty()) out.starts = {out.lower};
  }
  // Nobody sees what begins deeper than anybody went.
  if (p.begins == model::Begins::depth)
    std::erase_if(out.starts, [&, deepest_mm = recorded.deepest_mm()](double start) {
      return start > deepest_mm && start > p.starts.front();
    });
  out.prior = out.scope == Scope::instant ? inference::flat_prior(0, longest_s) : prior_of(effect, p);
  return out;
}

std::string label_of(const model::Effect& effect, std::uint32_t variant) {
  std::string label(effect.name());
  std::uint32_t common = ~0U;  // what all kinds have
  for (const std::uint32_t one : effect.variants()) common &= one;
  for (std::size_t p = 0; p < effect.parameters().size(); ++p)
    if ((variant & ~common) >> p & 1U && effect.parameters()[p].scope == model::Scope::rig)
      label += " (" + std::string(effect.parameters()[p].name.substr(0, effect.parameters()[p].name.rfind('_'))) + ")";
  return label;
}

// Largest range of the shaft's rotation while it inserts, over the recordings, in rad.
double largest_turn_rad(const RecordedCase& recorded) {
  double largest_rad = 0;
  for (const auto& recording : recorded.recordings) {
    const auto& nodes = recording.motion.nodes;
    double least_rad = std::numeric_limits<double>::infinity(), most_rad = -least_rad;
    for (std::size_t i = 1; i < nodes.size(); ++i) {
      if (nodes[i].insertion_mm == nodes[i - 1].insertion_mm) continue;
      least_rad = std::min({least_rad, nodes[i - 1].rotation_rad, nodes[i].rotation_rad});
      most_rad = std::max({most_rad, nodes[i - 1].rotation_rad, nodes[i].rotation_rad});
    }
    largest_rad = std::max(largest_rad, most_rad - least_rad);
  }
  return largest_rad;
}

inference::Dataset data_of(const RecordedCase& recorded) {
  inference::Dataset out;
  for (const auto& channel : recorded.channels) out.claimed_sd.push_back(channel.claimed_sd);
  out.frame_s = recorded.frame_s;
  for (const auto& recording : recorded.recordings) {
    inference::SeriesSet set;
    set.messages = recording.motion.at.size();
    set.duration_s = recording.duration_s();
    set.series = recording.series;
    out.recordings.push_back(std::move(set));
  }
  return out;
}

}  // namespace

NeedleSystem::NeedleSystem(RecordedCase recorded, const model::NeedleParameters& model, KnownPhysics known)
    : recorded_(std::move(recorded)),
      model_(model),
      known_(std::move(known)),
      data_(data_of(recorded_)),
      groups_(variation_groups(by_hand())),
      two_groups_(recorded_.two_groups()),
      determines_slip_(largest_turn_rad(recorded_) >= kSeparatesSlip_rad),
      headings_(recorded_.has_headings()) {
  const std::size_t most_known = by_hand() ? kMostKnownByHand : kMostKnown;
  if (known_.elsewhere.size() > most_known)
    throw ArgumentError("the model in use has " + std::to_string(known_.elsewhere.size()) +
                        " effects and discrepancies; at most " + std::to_string(most_known) +
                        " can be held while more is looked for" + (by_hand() ? " in recordings without a clock" : ""));
  const double u = std::max(model.lambda1_per_rad - model.lambda2 * model.lambda2 / (2 * std::numbers::pi), kSmallestU);
  const double width_k = kCurvatureShare * std::max(std::abs(model.curvature_per_mm), 1e-4);
  const double u_width = determines_slip_ ? kUWidth_per_rad : kHeldWidth;
  const double lambda2_width = determines_slip_ ? kLambda2Width : kHeldWidth;
  base_ = {{.name = "curvature_per_mm",
            .lower = -kCurvatureMax_per_mm,
            .upper = kCurvatureMax_per_mm,
            .none = 0,
            .starts = {},
            .prior = inference::normal_prior(model.curvature_per_mm, width_k)},
           {.name = "u_per_rad",
            .lower = kSmallestU,
            .upper = 5,
            .none = 0,
            .starts = {},
            .prior = inference::normal_prior(u, u_width)},
           {.name = "lambda2",
            .lower = -2,
            .upper = 0.9,
            .none = 0,
            .starts = {},
            .prior = inference::normal_prior(model.lambda2, lambda2_width)}};
  nuisances_ = {{"curvature_relative", 0}, {"tilt_x_rad", 1}, {"tilt_y_rad", 1},
                {"roll_rad", 3},           {"entry_x_mm", 2}, {"entry_y_mm", 2}};
  if (by_hand())
    nuisances_.insert(
        nuisances_.end(),
        {{"entry_z_mm", 4}, {"bend_gradient_x_per_mm_per_100mm", 5}, {"bend_gradient_y_per_mm_per_100mm", 5}});
  add_effects_of_library();
  if (two_groups_) add_common_errors();
  std::vector<const model::Motion*> motions;
  std::vector<Eigen::Vector3d> seen_mm;
  for (const auto& recording : recorded_.recordings) {
    motions.push_back(&recording.motion);
    seen_mm.insert(seen_mm.end(), recording.position_mm.begin(), recording.position_mm.end());
  }
  needle_curves_ = find_curves(motions, seen_mm);
  if (!recorded_.has_clock)
    std::erase_if(needle_curves_, [](const NeedleCurve& curve) { return model::needs_clock(curve.covariate); });
  for (const NeedleCurve& curve : needle_curves_) {
    curves_.push_back(curve.curve);
    for (std::size_t first = 0; first < curve.curve.at.size(); first += kValuesOfPart)
      curve_physics_.push_back(make_curve_part(curve, first));
  }
}

void NeedleSystem::add_effects_of_library() {
  const auto add = [&](const model::Effect& effect) {
    for (const std::uint32_t variant : effect.variants()) {
      inference::Effect one{.name = std::string(effect.name()), .label = label_of(effect, variant), .parameters = {}};
      for (std::size_t p = 0; p < effect.parameters().size(); ++p)
        if ((variant >> p & 1U) != 0) {
          one.parameters.push_back(parameter_of(effect.name(), effect.parameters()[p], recorded_));
          one.parameters.back().jumps = one.parameters.back().scope == Scope::instant && effect.jumps(variant);
        }
      // Where only some parameters are fitted, a partner's place moves with them; none of those has one.
      effects_.push_back(std::move(one));
      physics_.push_back(&effect);
      variants_.push_back(variant);
    }
  };
  for (const model::Effect* effect : model::all_effects()) {
    const bool known = std::any_of(known_.elsewhere.begin(), known_.elsewhere.end(),
                                   [&](const auto& one) { return one.effect == effect; });
    const bool shown = (recorded_.has_clock || !model::needs_clock(effect->covariate())) &&
                       (headings_ || !effect->of_headings()) &&
                       (!effect->needs_retraction() || recorded_.has_retraction());
    // Without a parameter it is a convention of the model file, and no convention changes between two groups.
    const bool may_change = !two_groups_ || !effect->parameters().empty();
    if (!known && shown && may_change) add(*effect);
  }
  if (!two_groups_) return;
  add(*needle_changes()[kCurvature]);
  if (!determines_slip_) return;
  add(*needle_changes()[kU]);
  add(*needle_changes()[kLambda2]);
}

void NeedleSystem::add_common_errors() {
  constexpr int kDepths = 8;
  constexpr double kWide_mm = 10, kWide_rad = 0.3;  // so much that they cost the same in every set
  const double deepest_mm = recorded_.deepest_mm();
  for (int i = 0; i < kDepths; ++i) common_at_mm_.push_back(deepest_mm * i / (kDepths - 1));
  for (const Channel& channel : recorded_.channels)
    for (const double at_mm : common_at_mm_) {
      const double wide = channel.heading ? kWide_rad : kWide_mm;
      base_.push_back({.name = "error_of_" + channel.name + "_at_" + std::to_string(std::lround(at_mm)) + "_mm",
                       .lower = -1e3 * wide,
                       .upper = 1e3 * wide,
                       .none = 0,
                       .starts = {},
                       .prior = inference::normal_prior(0, wide)});
    }
  for (std::size_t r = 0; r < recorded_.recordings.size(); ++r) {
    const auto& recording = recorded_.recordings[r];
    MatrixXd columns = MatrixXd::Zero(data_.recordings[r].rows(), base_size() - kBaseParameters);
    Index row = 0;
    for (std::size_t c = 0; c < recording.series.size(); ++c)
      for (const std::size_t reading : recording.series[c].message) {
        const double depth_mm = recording.motion.nodes[recording.motion.at[reading]].insertion_mm;
        const auto weights = model::weights_at(common_at_mm_, false, depth_mm);
        for (std::size_t i = 0; i < 2; ++i)
          columns(row, static_cast<Index>(c * common_at_mm_.size() + weights.knot[i])) += weights.weight[i];
        ++row;
      }
    common_columns_.push_back(std::move(columns));
  }
}

int NeedleSystem::changed_parameter(std::size_t effect) const {
  const auto& changes = needle_changes();
  const auto at = std::find(changes.begin(), changes.end(), physics_[effect]);
  return at == changes.end() ? -1 : static_cast<int>(at - changes.begin());
}

bool NeedleSystem::allows(const ModelSet& set) const {
  std::size_t columns = kBaseParameters + (by_hand() ? 5 : 3);  // and tilt, roll and bend of each insertion
  for (std::size_t i = 0; i < set.size(); ++i) {
    columns += effects_[set[i]].parameters.size();
    for (std::size_t j = 0; j < i; ++j)
      if (physics_[set[i]] == physics_[set[j]]) return false;
  }
  return columns <= static_cast<std::size_t>(model::kMaxColumns);
}

const model::EffectParameter& NeedleSystem::parameter(std::size_t effect, std::size_t parameter) const {
  const auto& all = physics_[effect]->parameters();
  std::size_t p = 0;
  // Those of this kind alone are fitted.
  for (std::size_t fitted = 0;; ++p)
    if ((variants_[effect] >> p & 1U) != 0 && fitted++ == parameter) break;
  return all[p];
}

}  // namespace bevel::diagnosis
