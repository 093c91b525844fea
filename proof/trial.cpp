// SPDX-License-Identifier: MIT
#include "proof/trial.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>

#include <bevel/model/needle.hpp>
#include "proof/beam_path.hpp"
#include "proof/distribution.hpp"

namespace bevel::proof {
namespace {

constexpr std::uint64_t kClassStream = 1ULL << 40U;
constexpr std::uint64_t kVariationStream = 1ULL << 41U;

BaseNeedle draw_needle(Random& random) {
  return {random.uniform(0.003, 0.006), random.uniform(18, 30), random.uniform(0.12, 0.45), random.uniform(0.03, 0.22)};
}

// What a lab believes after a calibration of its own; the wheelbase is geometry and right.
BaseNeedle mistaken(const BaseNeedle& needle, Random& random) {
  const auto error = [&](double share) { return 1.0 + share * std::clamp(random.normal(), -2.0, 2.0); };
  BaseNeedle believed = needle;
  believed.curvature_per_mm *= error(0.05);
  believed.lambda1_per_rad *= error(0.15);
  believed.lambda2 *= error(0.2);
  // (26), with room for what a file keeps of the digits
  const double least = believed.lambda2 * believed.lambda2 / (2.0 * std::numbers::pi) + 0.002;
  believed.lambda1_per_rad = std::max(believed.lambda1_per_rad, least);
  // No lab has a model file that its own programs refuse, as they would that of the bicycle closest to some beams.
  while (model::find_domain_violation({.curvature_per_mm = believed.curvature_per_mm,
                                       .wheelbase_mm = believed.wheelbase_mm,
                                       .lambda1_per_rad = believed.lambda1_per_rad,
                                       .lambda2 = believed.lambda2})) {
    believed.lambda1_per_rad *= 0.9;
    believed.lambda2 *= 0.9;
  }
  return believed;
}

DriveRipple draw_ripple(Random& random) {
  const double turn = 2.0 * std::numbers::pi;
  return {random.uniform(0.002, 0.006), random.uniform(2, 5), random.uniform(0, turn), random.uniform(0.001, 0.004),
          random.uniform(0, turn)};
}

// Pairs that no recording of a needle's tip tells apart: not an answer that could be right or wrong.
bool inseparable(const std::string& a, const std::string& b) {
  const auto are = [&](const char* x, const char* y) { return (a == x && b == y) || (a == y && b == x); };
  return are("camera_rotation", "entry_angle") || are("refraction", "camera_scale") || are("layer", "depth_dependence");
}

std::vector<ConcealedEffect> draw_effects(TrialClass trial_class, Random& random, const Setting& setting, int edition) {
  std::vector<const EffectKind*> listed;
  std::vector<const EffectKind*> unlisted;
  for (const EffectKind& kind : catalogue(edition)) (kind.listed ? listed : unlisted).push_back(&kind);
  if (!setting.changed.empty())
    for (const EffectKind& kind : needle_changes()) listed.push_back(&kind);
  const auto draw = [&](const std::vector<const EffectKind*>& from) {
    ConcealedEffect effect = draw_effect(*random.pick(from), random, setting.motions);
    if (const auto at_s = effect.per_recording.find("at_s"); at_s != effect.per_recording.end())
      for (std::size_t i = 0; i < setting.changed.size(); ++i)
        if (!setting.changed[i]) at_s->second[i] = 0;
    return effect;
  };
  switch (trial_class) {
    case TrialClass::nothing:
      return {};
    case TrialClass::one:
      return {draw(listed)};
    case TrialClass::unlisted: {
      std::vector<ConcealedEffect> effects{draw(unlisted)};
      if (random.chance(kUnlistedAndListed)) effects.push_back(draw(listed));
      return effects;
    }
    case TrialClass::two:
      break;
  }
  ConcealedEffect first = draw(listed);
  ConcealedEffect second = draw(listed);
  while (second.name == first.name || inseparable(first.name, second.name)) second = draw(listed);
  return {first, second};
}

// Of two groups: the same four kinds of insertion in either, each time by other draws.
std::vector<Script> draw_two_groups(Random& random, bool rich) {
  const std::vector<Script> after = draw_scripts(random, rich), before = draw_scripts(random, rich);
  std::vector<std::size_t> kinds(after.size());
  std::iota(kinds.begin(), kinds.end(), 0);
  for (std::size_t i = kinds.size(); i-- > 1;) std::swap(kinds[i], kinds[random.index(i + 1)]);
  kinds.resize(kinds.size() / 2);
  std::vector<Script> scripts;
  for (const auto* group : {&after, &before})
    for (const std::size_t kind : kinds) scripts.push_back((*group)[kind]);
  return scripts;
}

// Scales the effect so that about `target` standard deviations of it are visible, within what is physically sensible.
ConcealedEffect scaled_to(const ConcealedEffect& effect, double target, const Setting& setting,
                          const BaseNeedle& needle, const BaseTangent& tangent, const Views& bare) {
  double factor = 1.0;
  for (int attempt = 0; attempt < 3; ++attempt) {
    const Views seen = views_of(setting, needle, physics_of({scaled(effect, factor)}, 1.0));
    const double sigmas = tangent.norm_beyond(whitened_difference(setting, seen, bare));
    if (sigmas < 1e-6) return effect;  // not excited: no size would show
    factor = std::clamp(factor * std::clamp(target / sigmas, 0.05, 3.0), kind_of(effect).least_factor, 1.5);
  }
  return scaled(effect, factor);
}

// Largest departure of the forms, of a few, whose own traces stay below what could be seen: beyond that, a physical
// form would be a second effect on no list.
void choose_departure(Truth& truth, const Setting& setting, const std::vector<ConcealedEffect>& effects) {
  const Views plain = views_of(setting, truth.needle, physics_of(effects, 0.0));
  BaseTangent tangent(setting, truth.needle, physics_of(effects, 0.0));
  for (std::size_t i = 0; i < effects.size(); ++i)
    for (const auto& [name, value] : effects[i].parameters) {
      auto moved = effects;
      moved[i].parameters[name] += 0.01 * value + 1e-9;
      tangent.also(whitened_difference(setting, views_of(setting, truth.needle, physics_of(moved, 0.0)), plain));
    }
  for (const double departure : {1.0, 0.5, 0.25, 0.1, 0.03, 0.0}) {
    truth.departure = departure;
    const Views seen = views_of(setting, truth.needle, physics_of(effects, departure));
    truth.departure_sigmas = tangent.norm_beyond(whitened_difference(setting, seen, plain));
    if (truth.departure_sigmas <= kDeparture_sigmas) return;
  }
}

void limit_ripple(Truth& truth, Setting& setting) {
  const Views rough = views_of(setting, truth.needle, {});
  const DriveRipple drawn = setting.ripple;
  setting.ripple = {};
  const Views smooth = views_of(setting, truth.needle, {});
  const BaseTangent tangent(setting, truth.needle, {});
  truth.ripple_sigmas = tangent.norm_beyond(whitened_difference(setting, rough, smooth));
  const double share = std::min(1.0, kRipple_sigmas / truth.ripple_sigmas);
  setting.ripple = drawn;
  setting.ripple.insertion_mm *= share;
  setting.ripple.rotation_rad *= share;
  truth.ripple_sigmas *= share;
  truth.ripple = setting.ripple;
}

void state_nearest(Truth& truth, const Setting& setting, const Views& seen) {
  std::vector<ConcealedEffect> effects;
  std::vector<TruthEntry*> entries;
  for (TruthEntry& entry : truth.entries)
    if (entry.effect.kind.empty() && entry.visible_sigmas >= kVisible_sigmas)
      effects.push_back(entry.effect), entries.push_back(&entry);
  if (effects.empty()) return;
  const auto nearest = nearest_plain(setting, seen, truth.needle, effects);
  for (std::size_t i = 0; i < entries.size(); ++i) entries[i]->nearest = nearest[i];
}

// Kinematic plant: sizes, departure, visibility. Returns what the cameras see.
Views conceal_in_kinematics(Truth& truth, Setting& setting, Random& random, int edition) {
  auto effects = draw_effects(truth.trial_class, random, setting, edition);
  limit_ripple(truth, setting);
  const bool unlisted = truth.trial_class == TrialClass::unlisted;
  if (!effects.empty()) {
    const BaseTangent tangent(setting, truth.needle, {});
    const Views bare = views_of(setting, truth.needle, {});
    for (ConcealedEffect& effect : effects) {
      const bool natural = random.chance(kNaturalShare);
      const double target = unlisted && !effect.kind.empty() ? random.log_uniform(4, 60) : random.log_uniform(1.5, 25);
      if (!natural) effect = scaled_to(effect, target, setting, truth.needle, tangent, bare);
    }
    choose_departure(truth, setting, effects);
  }
  Views seen = views_of(setting, truth.needle, physics_of(effects, truth.departure));
  for (std::size_t i = 0; i < effects.size(); ++i) {
    auto others = effects;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const Refit refit = refit_base(setting, seen, truth.needle, physics_of(others, truth.departure));
    truth.entries.push_back({effects[i], refit.sigmas});
  }
  if (!effects.empty()) truth.visible_sigmas = refit_base(setting, seen, truth.needle, {}).sigmas;
  state_nearest(truth, setting, seen);
  return seen;
}

// The beam: what the closest bicycle leaves over is a shaft that is stiff, tip_swing of the list. Tissue that relaxes
// is on no list: visible is what of it no elastic tissue leaves so.
Views conceal_in_beam(Truth& truth, Setting& setting, Random& random, int edition) {
  truth.beam_config = draw_beam(random);
  const model::BeamPlantConfig& beam = *truth.beam_config;
  Views seen = views_of(setting, beam);
  const BaseNeedle anywhere{0.002, truth.needle.wheelbase_mm, 0.1, 0.05};
  const Refit refit = refit_base(setting, seen, anywhere, {});
  truth.needle = refit.needle;
  truth.visible_sigmas = refit.sigmas;
  truth.departure = 0;
  if (edition < kBeamIsListed) {
    truth.entries.push_back({{"unknown", "beam", {}, {}}, refit.sigmas});
    return seen;
  }
  TruthEntry swing{{"tip_swing", "", swing_of(beam), {}}, refit.sigmas};
  if (beam.relaxing_fraction > 0) {
    const ElasticFit elastic = nearest_elastic(setting, seen, beam);
    swing.nearest = swing_of(elastic.beam);
    swing.visible_sigmas = refit_base(setting, views_of(setting, elastic.beam), anywhere, {}).sigmas;
    const std::map<std::string, double> relaxing{{"fraction", beam.relaxing_fraction},
                                                 {"time_s", beam.relaxation_time_s}};
    truth.entries.push_back({{"unknown", "beam_relaxation", relaxing, {}}, elastic.sigmas});
  } else {
    swing.nearest = swing.effect.parameters;
  }
  truth.entries.insert(truth.entries.begin(), swing);
  return seen;
}

std::vector<std::string> ids(const Truth& truth, double least_sigmas) {
  std::set<std::string> names;
  for (const TruthEntry& entry : truth.entries)
    if (entry.visible_sigmas >= least_sigmas) names.insert(entry.effect.name);
  return {names.begin(), names.end()};
}

}  // namespace

const char* name_of(TrialClass trial_class) {
  switch (trial_class) {
    case TrialClass::nothing:
      return "nothing";
    case TrialClass::unlisted:
      return "unlisted";
    case TrialClass::two:
      return "two";
    case TrialClass::one:
      break;
  }
  return "one";
}

std::vector<std::string> Truth::expected() const { return ids(*this, kVisible_sigmas); }
std::vector<std::string> Truth::concealed() const { return ids(*this, 0.0); }

TrialClass class_of(std::uint64_t seed, int number) {
  std::vector<TrialClass> block;
  for (const ClassShare& share : kBlock)
    block.insert(block.end(), static_cast<std::size_t>(share.count), share.trial_class);
  Random random = Random::stream(seed, kClassStream + static_cast<std::uint64_t>(number / kBlockSize));
  for (std::size_t i = block.size(); i-- > 1;) std::swap(block[i], block[random.index(i + 1)]);
  return block[static_cast<std::size_t>(number % kBlockSize)];
}

namespace {

// A trial before anything is concealed, and the numbers that it goes on with.
struct Begun {
  Trial trial;
  Setting setting;
  Random random;
};

Begun begin_trial(std::uint64_t seed, int number, const Population& population) {
  Begun begun{.trial = {}, .setting = {}, .random = Random::stream(seed, static_cast<std::uint64_t>(number))};
  Random& random = begun.random;
  Trial& trial = begun.trial;
  Setting& setting = begun.setting;
  Truth& truth = trial.truth;
  truth.trial = number;
  truth.trial_class = population.nulls ? TrialClass::nothing : class_of(seed, number);
  // What changes between two groups is one thing.
  if (population.two_groups && truth.trial_class == TrialClass::two) truth.trial_class = TrialClass::one;
  truth.beam = truth.trial_class == TrialClass::unlisted && !population.two_groups && random.chance(kBeamShare);
  truth.rich = !random.chance(kPoorShare);
  truth.needle = draw_needle(random);
  truth.noise = draw_camera_noise(random);
  setting.ripple = draw_ripple(random);
  const auto scripts = population.two_groups ? draw_two_groups(random, truth.rich) : draw_scripts(random, truth.rich);
  if (population.two_groups)
    for (std::size_t i = 0; i < scripts.size(); ++i) truth.changed.push_back(i < scripts.size() / 2);
  setting.changed = truth.changed;
  for (const Script& script : scripts) {
    TrialRecording recording{follow(script), script, {}, {}};
    recording.frames = draw_frames(truth.noise, recording.motion.duration_s(), random);
    setting.motions.push_back(recording.motion);
    setting.frames.push_back(recording.frames);
    setting.whiteners.emplace_back(truth.noise, recording.frames);
    truth.script_kinds.push_back(script.kind);
    trial.recordings.push_back(std::move(recording));
  }
  // A stream of its own: trials without variation stay what they were.
  Random between = Random::stream(seed, kVariationStream + static_cast<std::uint64_t>(number));
  if (between.chance(population.varied)) {
    truth.spread = draw_spread(between);
    for (std::size_t i = 0; i < setting.motions.size(); ++i)
      truth.variation.push_back(draw_variation(truth.spread, between));
    setting.variation = truth.variation;
  }
  return begun;
}

}  // namespace

Trial draw_recordings(std::uint64_t seed, int number, const Population& population) {
  return begin_trial(seed, number, population).trial;
}

Trial draw_trial(std::uint64_t seed, int number, const Population& population) {
  auto [trial, setting, random] = begin_trial(seed, number, population);
  Truth& truth = trial.truth;
  if (truth.spread.any()) setting.absorbers = find_absorbers(setting, truth.needle, truth.spread);
  const Views seen = truth.beam ? conceal_in_beam(truth, setting, random, population.edition)
                                : conceal_in_kinematics(truth, setting, random, population.edition);
  if (truth.entries.size() == 1 && truth.entries[0].effect.name == "unknown" && truth.visible_sigmas >= kVisible_sigmas)
    truth.rivals = find_rivals(setting, seen, truth.needle, kVisible_sigmas);
  truth.believed = mistaken(truth.needle, random);
  for (std::size_t i = 0; i < seen.size(); ++i)
    trial.recordings[i].reported_mm = seen[i] + trial.recordings[i].frames.noise_mm;
  return trial;
}

}  // namespace bevel::proof
