// SPDX-License-Identifier: MIT
#include <bevel/analysis/steering/model_rig.hpp>

#include <cmath>
#include <random>

#include <bevel/io/live_effects.hpp>

namespace bevel::analysis {

rig::Believed believed_of(const io::ModelFile& model) {
  rig::Believed out;
  out.estimator.prior.needle = model.needle;
  out.estimator.prior.variation = model.variation.value_or(model::Variation{});
  out.estimator.effects = out.undone = io::live_effects(model.effects, model.discrepancies).active;
  return out;
}

std::vector<model::ActiveEffect> for_one_insertion(const io::ModelFile& model, double duration_s, std::uint64_t seed) {
  std::mt19937_64 random(seed ^ 0x9e3779b97f4a7c15ULL);
  std::vector<model::ActiveEffect> effects = io::active_effects(model, "");
  for (auto& active : effects) {
    const auto& parameters = active.effect->parameters();
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (parameters[i].scope != model::Scope::recording) continue;
      const double low = parameters[i].periodic ? parameters[i].lower : 0.2 * duration_s;
      const double high = parameters[i].periodic ? parameters[i].upper : 0.8 * duration_s;
      active.parameters[i] = std::uniform_real_distribution<double>(low, high)(random);
    }
  }
  return effects;
}

rig::Cameras cameras_of(const diagnosis::RecordedCase& recorded, const inference::Noise& noise) {
  rig::Cameras cameras;
  cameras.ar1 = noise.ar1, cameras.frame_s = noise.frame_s;
  for (std::size_t c = 0; c < recorded.channels.size(); ++c)
    if (!recorded.channels[c].heading)
      cameras.axes.push_back({recorded.channels[c].camera, recorded.channels[c].axis, noise.sigma[c]});
  return cameras;
}

double farthest_aside_mm(const model::NeedleParameters& needle, double depth_mm) {
  model::Pose tip;
  // A needle that never reaches the depth turns back: a circle of the bicycle goes on for ever.
  while (tip.p_mm.z() < depth_mm && tip.R(2, 2) > 0 &&
         model::advance(tip, {1, 0, {needle.curvature_per_mm, 0}}, model::slip_parameters(needle))) {
  }
  return tip.p_mm.head<2>().norm();
}

}  // namespace bevel::analysis
