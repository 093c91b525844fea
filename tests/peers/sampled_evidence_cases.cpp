// SPDX-License-Identifier: MIT
// sampled_evidence_cases CASE: one small case with a set of effects. Prints a line of JSON (the engine's evidence, its
// mode, its unknowns and their priors), then answers points on stdin with log likelihood and log prior on stdout until
// stdin ends. Both are doubles of this machine. A point: shared unknowns, then each recording's own.
// sampled_evidence_cases: the names of the cases. tests/peers/sampled_evidence.py is at the other end.
//
// Noise is the engine's for this set, found at its mode and then held: what is integrated is one and the same.
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/proposals.hpp>
#include <bevel/diagnosis/needle/needle_system.hpp>
#include "tests/inference/pendulum.hpp"
#include "tests/needle/simulated_rig.hpp"

namespace {

using namespace bevel;
using Eigen::Index;
using Eigen::VectorXd;
using inference::Scope;
using inference::testing::Pendulum;
using inference::testing::TruePendulum;
using nlohmann::json;

constexpr std::size_t kStarts = 3;  // of an effect, that are fitted

struct Case {
  const char* name;
  const char* truth;
  std::vector<std::string> set;  // labels of effects
  std::function<std::unique_ptr<inference::System>()> make;
  std::vector<double> sigma;
};

std::function<std::unique_ptr<inference::System>()> pendulum(const TruePendulum& truth, std::size_t recordings,
                                                             std::uint64_t seed) {
  return [=] { return std::make_unique<Pendulum>(truth, recordings, seed); };
}

// Few readings: what is compared is an integral, not a diagnosis.
std::function<std::unique_ptr<inference::System>()> needle(const std::vector<model::ActiveEffect>& effects,
                                                           std::uint64_t seed) {
  return [=] {
    diagnosis::testing::SimulatedRig rig;
    rig.recordings = 2;
    rig.frame_s = 0.25;
    rig.effects = effects;
    return std::make_unique<diagnosis::NeedleSystem>(diagnosis::testing::record_case(rig, seed), rig.needle);
  };
}

std::vector<Case> all_cases() {
  using model::testing::active;
  const std::vector<double> angle = {Pendulum::kSigma_rad}, tip = {0.15, 0.15, 0.2};
  return {
      {"nothing", "nothing", {}, pendulum({}, 2, 1), angle},
      {"friction", "dry friction 0.25", {"dry_friction"}, pendulum({.dry_friction = 0.25}, 2, 21), angle},
      {"scale", "sensor scale 1.06", {"sensor_scale"}, pendulum({.scale = 1.06}, 2, 22), angle},
      {"both",
       "dry friction 0.3, sensor scale 1.05",
       {"dry_friction", "sensor_scale"},
       pendulum({.dry_friction = 0.3, .scale = 1.05}, 2, 41),
       angle},
      {"knock", "knock of 0.15 in one of 2", {"knock"}, pendulum({.knock_rad_s = 0.15}, 2, 31), angle},
      {"friction of none", "nothing", {"dry_friction"}, pendulum({}, 2, 1), angle},
      {"scale of none", "nothing", {"sensor_scale"}, pendulum({}, 2, 2), angle},
      {"wrong", "dry friction 0.25", {"sensor_scale"}, pendulum({.dry_friction = 0.25}, 2, 21), angle},
      {"needle nothing", "nothing", {}, needle({}, 11), tip},
      {"needle scale",
       "insertion scale 0.93",
       {"insertion_scale"},
       needle({active("insertion_scale", {0.93})}, 12),
       tip},
      {"needle layer", "layer 0.5 from 40 mm", {"layer"}, needle({active("layer", {40, 0.5})}, 13), tip},
      {"needle wrong", "insertion scale 0.93", {"camera_scale"}, needle({active("insertion_scale", {0.93})}, 12), tip},
  };
}

// Effect by effect, from the starts that are proposed beside what is there, as the search does.
inference::Evaluated best_of(const inference::Likelihood& likelihood, const inference::ModelSet& set) {
  const inference::System& system = likelihood.system();
  const inference::Layout nothing(system, {});
  inference::Evaluated best =
      evaluate(likelihood, nothing, nothing.shared_start(), {likelihood.recordings(), nothing.local_start()},
               inference::middle_nuisance_sd(system));
  const inference::Proposals proposals(likelihood, best.fit);
  for (const std::size_t effect : set) {
    const inference::Fit from = best.fit;
    const inference::Layout layout(system, inference::with(from.layout.set(), effect));
    best.valid = false;
    for (const auto& proposal : proposals.beside(inference::Marginal(likelihood, from, {}), kStarts)) {
      if (proposal.effect != effect) continue;
      for (const inference::StartPoint& start : proposal.starts) {
        VectorXd shared = layout.shared_from(from.layout, from.shared);
        std::vector<VectorXd> local;
        for (const VectorXd& one : from.local) local.push_back(layout.local_from(from.layout, one));
        shared.tail(start.shared.size()) = start.shared;
        for (std::size_t r = 0; r < start.local.size(); ++r) local[r].tail(start.local[r].size()) = start.local[r];
        auto one = evaluate(likelihood, layout, shared, local, from.scales.nuisance_sd);
        if (one.valid && (!best.valid || one.log_evidence > best.log_evidence)) best = std::move(one);
      }
    }
    if (!best.valid) throw std::domain_error("no mode of " + describe(system, layout.set()));
  }
  return best;
}

json of(const inference::Prior& prior) {
  const char* const forms[] = {"normal", "flat", "size"};
  return {{"form", forms[static_cast<int>(prior.form)]},
          {"middle", prior.middle},
          {"scale", prior.scale},
          {"lower", prior.lower},
          {"upper", prior.upper},
          {"least_distance", prior.least_distance},
          {"largest", std::min(prior.largest, 1e300)}};
}

json describe(const Case& one, const inference::System& system, const inference::Evaluated& at) {
  const auto vector = [](const VectorXd& v) { return std::vector<double>(v.begin(), v.end()); };
  const inference::Layout& layout = at.fit.layout;
  json out = {{"case", one.name},
              {"truth", one.truth},
              {"set", describe(system, layout.set())},
              {"laplace", at.log_evidence},
              {"sigma", at.fit.likelihood->noise().sigma},
              {"ar1", at.fit.likelihood->noise().ar1},
              {"frame_s", at.fit.likelihood->noise().frame_s},
              {"nuisance_sd", vector(at.fit.scales.nuisance_sd)},
              {"weights", vector(at.nuisance_weights)},
              {"held", at.fit.held.size()},
              {"happens", {inference::kHappens, inference::kHappensNot}},
              {"shared", json::array()},
              {"local", json::array()},
              {"groups", json::array()},
              {"recordings", json::array()}};
  for (std::size_t i = 0; i < layout.shared().size(); ++i) {
    const inference::Parameter& p = *layout.shared()[i].parameter;
    out["shared"].push_back({{"name", p.name},
                             {"lower", p.lower},
                             {"upper", p.upper},
                             {"mode", at.fit.shared[static_cast<Index>(i)]},
                             {"prior", of(p.prior)}});
  }
  for (std::size_t i = 0; i < layout.local().size(); ++i) {
    const inference::Parameter* p = layout.local()[i].parameter;
    if (p && p->scope != Scope::instant) throw std::invalid_argument("a phase: not served");
    json local = {{"name", p ? p->name : system.nuisances()[i].name}};
    if (!p) local["group"] = system.nuisances()[i].group;
    out["local"].push_back(std::move(local));
  }
  for (const auto& group : system.nuisance_groups()) out["groups"].push_back(group.standard_deviations);
  for (std::size_t r = 0; r < at.fit.local.size(); ++r) {
    json recording = {{"mode", vector(at.fit.local[r])}, {"series", json::array()}, {"upper", json::array()}};
    for (std::size_t i = 0; i < layout.local().size(); ++i)
      recording["upper"].push_back(layout.is_instant(i) ? layout.upper(i, r) : 0);
    for (const auto& series : at.fit.likelihood->data().recordings[r].series)
      recording["series"].push_back({{"time_s", series.time_s}, {"measured", series.measured}});
    out["recordings"].push_back(std::move(recording));
  }
  return out;
}

// One point's log likelihood (without the constant of 2 pi, as the engine has it) and the shared unknowns' log prior.
void answer(const inference::Fit& fit, const std::vector<double>& point, double (&out)[2]) {
  const auto shared_count = static_cast<Index>(fit.layout.shared().size());
  const auto local_count = static_cast<Index>(fit.layout.local().size());
  const VectorXd shared = Eigen::Map<const VectorXd>(point.data(), shared_count);
  out[0] = fit.likelihood->log_weights();
  out[1] = 0;
  inference::Residuals residuals;
  for (std::size_t r = 0; r < fit.local.size(); ++r) {
    const VectorXd local =
        Eigen::Map<const VectorXd>(point.data() + shared_count + static_cast<Index>(r) * local_count, local_count);
    if (fit.likelihood->evaluate(fit.layout, r, shared, local, false, residuals))
      out[0] -= 0.5 * residuals.white.squaredNorm();
    else
      out[0] = -std::numeric_limits<double>::infinity();
  }
  for (Index i = 0; i < shared_count; ++i)
    out[1] += log_density(fit.layout.shared()[static_cast<std::size_t>(i)].parameter->prior, shared[i], 0);
}

}  // namespace

int main(int argc, char** argv) {
  const auto cases = all_cases();
  if (argc < 2) {
    for (const Case& one : cases) std::cout << one.name << "\n";
    return 0;
  }
  for (const Case& one : cases) {
    if (argv[1] != std::string(one.name)) continue;
    const auto system = one.make();
    inference::Noise noise;
    noise.sigma = one.sigma;
    noise.frame_s = system->data().frame_s;
    inference::ModelSet set;
    for (std::size_t e = 0; e < system->effects().size(); ++e)
      if (std::find(one.set.begin(), one.set.end(), system->effects()[e].label) != one.set.end())
        set = inference::with(set, e);
    if (set.size() != one.set.size()) throw std::invalid_argument("an effect that is not in the system");
    const inference::Readings no_outliers(system->data().recordings.size());
    const auto at = best_of(inference::Likelihood(*system, no_outliers, noise), set);
    std::cout << describe(one, *system, at).dump() << std::endl;
    std::vector<double> point(at.fit.layout.shared().size() + at.fit.local.size() * at.fit.layout.local().size());
    double out[2];
    while (std::fread(point.data(), sizeof(double), point.size(), stdin) == point.size()) {
      answer(at.fit, point, out);
      std::fwrite(out, sizeof(double), 2, stdout);
      std::fflush(stdout);
    }
    return 0;
  }
  std::cerr << "sampled_evidence_cases: no case '" << argv[1] << "'\n";
  return 2;
}
