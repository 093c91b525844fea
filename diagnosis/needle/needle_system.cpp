#include "diagnosis/needle/needle_system.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "diagnosis/needle/curves.hpp"

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::ModelSet;
using inference::Scope;

namespace {

// The lab's own belief in its model file: half of k, and all of Table I and beyond for lambda.
constexpr double kCurvatureShare = 0.5;
constexpr double kUWidth_per_rad = 0.5;
constexpr double kLambda2Width = 0.3;
constexpr double kCurvatureMax_per_mm = 0.05;
constexpr double kSmallestU = 1e-9;      // (26) is strict
constexpr double kExpectedShare = 0.75;  // scale of a size's prior, of the largest that is reported
constexpr double kFewestReadings = 2.5;  // a period
constexpr double kFewestPeriods = 1.5;   // of the longest recording
constexpr std::size_t kMostKnown = 2;    // beside the variation, three effects and the parts of a curve: kMaxEffects

// Tilts and rolls the needle at its entry: what an insertion has of its own.
class EntryVariation final : public model::Effect {
 public:
  EntryVariation()
      : Effect({.name = "variation",
                .meaning = "insertions differ",
                .covariate = model::Covariate::depth_mm,
                .parameters = {{.name = "tilt_x_rad", .lower = -1, .upper = 1, .none = 0, .starts = {0}},
                               {.name = "tilt_y_rad", .lower = -1, .upper = 1, .none = 0, .starts = {0}},
                               {.name = "roll_rad", .lower = -4, .upper = 4, .none = 0, .starts = {0}}}}) {}
  void enter(model::Parameters p, model::EntryPose& pose) const override {
    pose.tilt_x_rad += p[0];
    pose.tilt_y_rad += p[1];
    pose.roll_rad += p[2];
  }
};
const EntryVariation& entry_variation() {
  static const EntryVariation effect;
  return effect;
}

// What the field reports of repeated insertions: curvature 10 to 40 % in tissue, a few in gelatin; entry angles of
// 0.2 to 0.7 degrees; registration of some tenths of a millimetre; a bevel set by hand to a few degrees.
std::vector<inference::NuisanceGroup> variation_groups() {
  return {{"curvature", "relative", {0, 0.02, 0.05, 0.12, 0.3}},
          {"entry_angle", "rad", {0, 0.003, 0.007, 0.015, 0.03}},
          {"entry_point", "mm", {0, 0.05, 0.12, 0.3, 0.8}},
          {"roll", "rad", {0, 0.015, 0.04, 0.1}}};
}

double reach_of(const model::EffectParameter& p) {
  if (p.reported > 0) return p.reported;
  double reach = 0;
  for (const double start : p.starts) reach = std::max(reach, 2 * std::abs(start - p.none));
  return reach;
}

inference::Prior prior_of(const model::EffectParameter& p, double lower, double upper) {
  if (p.periodic && std::isnan(p.none)) return inference::flat_prior(lower, upper);
  if (std::isnan(p.none)) {
    const double low = *std::min_element(p.starts.begin(), p.starts.end());
    const double high = std::max(*std::max_element(p.starts.begin(), p.starts.end()), p.reported);
    return inference::flat_prior(low < high ? low : 0.5 * low, low < high ? high : 2 * high);
  }
  auto prior = inference::size_prior(p.none, kExpectedShare * reach_of(p), lower, upper);
  prior.least_distance = p.smallest_seen;
  prior.largest = p.largest_seen;
  return prior;
}

inference::Parameter parameter_of(const model::EffectParameter& p, const RecordedCase& recorded) {
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
  out.prior = out.scope == Scope::instant ? inference::flat_prior(0, longest_s) : prior_of(p, out.lower, out.upper);
  return out;
}

std::string label_of(const model::Effect& effect, std::uint32_t variant) {
  std::string label(effect.name());
  if (effect.variants().size() < 2) return label;
  for (std::size_t p = 0; p < effect.parameters().size(); ++p)
    if ((variant >> p & 1U) != 0 && effect.parameters()[p].scope == model::Scope::rig)
      label += " (" + std::string(effect.parameters()[p].name.substr(0, effect.parameters()[p].name.find('_'))) + ")";
  return label;
}

inference::Dataset data_of(const RecordedCase& recorded) {
  inference::Dataset out;
  for (const auto& channel : recorded.channels) out.claimed_sd.push_back(channel.claimed_sigma_mm);
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
      groups_(variation_groups()) {
  if (known_.elsewhere.size() > kMostKnown)
    throw std::invalid_argument("the model in use has " + std::to_string(known_.elsewhere.size()) +
                                " effects and discrepancies; at most " + std::to_string(kMostKnown) +
                                " can be held while more is looked for");
  const double u = std::max(model.lambda1_per_rad - model.lambda2 * model.lambda2 / (2 * std::numbers::pi), kSmallestU);
  const double width_k = kCurvatureShare * std::max(std::abs(model.curvature_per_mm), 1e-4);
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
            .prior = inference::normal_prior(u, kUWidth_per_rad)},
           {.name = "lambda2",
            .lower = -2,
            .upper = 0.9,
            .none = 0,
            .starts = {},
            .prior = inference::normal_prior(model.lambda2, kLambda2Width)}};
  nuisances_ = {{"curvature", 0}, {"tilt_x_rad", 1}, {"tilt_y_rad", 1},
                {"roll_rad", 3},  {"entry_x_mm", 2}, {"entry_y_mm", 2}};
  for (const model::Effect* effect : model::all_effects()) {
    if (std::any_of(known_.elsewhere.begin(), known_.elsewhere.end(),
                    [&](const auto& one) { return one.effect == effect; }))
      continue;
    for (const std::uint32_t variant : effect->variants()) {
      inference::Effect one{.name = std::string(effect->name()), .label = label_of(*effect, variant), .parameters = {}};
      for (std::size_t p = 0; p < effect->parameters().size(); ++p)
        if ((variant >> p & 1U) != 0) one.parameters.push_back(parameter_of(effect->parameters()[p], recorded_));
      // Where only some parameters are fitted, a partner's place moves with them; none of those has one.
      effects_.push_back(std::move(one));
      physics_.push_back(effect);
      variants_.push_back(variant);
    }
  }
  std::vector<const model::Motion*> motions;
  for (const auto& recording : recorded_.recordings) motions.push_back(&recording.motion);
  needle_curves_ = find_curves(motions);
  for (const NeedleCurve& curve : needle_curves_) {
    curves_.push_back(curve.curve);
    parts_of_curve_ = (curve.curve.at.size() + kValuesOfPart - 1) / kValuesOfPart;
    for (std::size_t first = 0; first < curve.curve.at.size(); first += kValuesOfPart)
      curve_physics_.push_back(make_curve_part(curve, first));
  }
}

bool NeedleSystem::allows(const ModelSet& set) const {
  std::size_t columns = kBaseParameters + 3;  // and tilt and roll of each insertion
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

model::NeedleParameters NeedleSystem::needle(const VectorXd& shared) const {
  model::NeedleParameters out = model_;
  out.curvature_per_mm = shared[kCurvature];
  out.lambda2 = shared[kLambda2];
  out.lambda1_per_rad = shared[kU] + out.lambda2 * out.lambda2 / (2 * std::numbers::pi);
  return out;
}

// The channels' readings of a path, or their derivatives.
MatrixXd NeedleSystem::rows_of(std::size_t r, const model::OpenLoop& path, bool derivatives) const {
  const auto& recording = recorded_.recordings[r];
  MatrixXd out(data_.recordings[r].rows(), derivatives ? path.jacobian.cols() : 1);
  Index row = 0;
  for (std::size_t c = 0; c < recording.series.size(); ++c) {
    const Eigen::RowVector3d axis = recorded_.channels[c].axis.transpose();
    for (const std::size_t reading : recording.series[c].message) {
      if (derivatives)
        out.row(row++).noalias() = axis * path.jacobian.middleRows<3>(static_cast<Index>(3 * reading));
      else
        out(row++, 0) = axis * path.position_mm[reading];
    }
  }
  return out;
}

const std::vector<model::ActiveEffect>& NeedleSystem::known(int recording) const {
  const auto r = static_cast<std::size_t>(recording);
  return recording >= 0 && r < known_.in_recording.size() ? known_.in_recording[r] : known_.elsewhere;
}

bool NeedleSystem::follow(const ModelSet& set, const model::Motion& motion, int recording, const VectorXd& shared,
                          const VectorXd& local, const DiscrepancyValues* discrepancy, Columns* columns,
                          model::OpenLoop& path) const {
  model::NeedleParameters needle = this->needle(shared);
  needle.curvature_per_mm *= 1 + local[kOwnCurvature];
  // Columns: the needle's three, tilt and roll, then the effects' in the order of the set.
  int column = kBaseParameters;
  const auto unknown = [&](double value) { return model::Dual::unknown(value, columns ? column++ : -1); };
  std::vector<model::ActiveEffect> effects(1);
  effects[0].effect = &entry_variation();
  for (std::size_t i = 0; i < 3; ++i) effects[0].parameters[i] = unknown(local[kTiltX + static_cast<Index>(i)]);
  if (columns) *columns = {.shared = {kCurvature, kU, kLambda2}, .local = {}};
  Index next_shared = kBaseParameters, next_local = kVariations;
  for (const std::size_t e : set) {
    model::ActiveEffect active;
    active.effect = physics_[e];
    const auto& parameters = physics_[e]->parameters();
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      if ((variants_[e] >> p & 1U) == 0) {
        active.parameters[p] = std::isnan(parameters[p].none) ? parameters[p].starts.front() : parameters[p].none;
        continue;
      }
      const bool own = parameters[p].scope == model::Scope::recording;
      if (columns) (own ? columns->local : columns->shared).push_back(column);
      active.parameters[p] = unknown(own ? local[next_local++] : shared[next_shared++]);
    }
    effects.push_back(active);
  }
  effects.insert(effects.end(), known(recording).begin(), known(recording).end());
  if (discrepancy) {
    for (std::size_t part = 0; part < parts_of_curve_; ++part) {
      model::ActiveEffect active;
      active.effect = curve_physics_[discrepancy->curve * parts_of_curve_ + part].get();
      for (std::size_t p = 0; p < kValuesOfPart; ++p)
        if (const auto i = static_cast<Index>(part * kValuesOfPart + p); i < discrepancy->values.size())
          active.parameters[p] = discrepancy->values[i];
      effects.push_back(active);
    }
  }
  const model::AugmentedNeedle augmented(
      needle, std::move(effects), columns ? column : 0,
      columns ? model::NeedleColumns{.curvature = 0, .lambda1 = 1, .lambda2 = 2, .wheelbase = -1}
              : model::NeedleColumns{});
  return model::predict(augmented, motion, path);
}

bool NeedleSystem::tip_path(const ModelSet& set, const model::Motion& motion, int recording, const VectorXd& shared,
                            const VectorXd& local, const DiscrepancyValues* discrepancy,
                            std::vector<Eigen::Vector3d>& out) const {
  model::OpenLoop path;
  if (!follow(set, motion, recording, shared, local, discrepancy, nullptr, path)) return false;
  out = path.position_mm;
  for (auto& position : out) position.head<2>() += local.segment<2>(kEntryX);
  return true;
}

bool NeedleSystem::predict(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd& local,
                           bool derivatives, inference::Prediction& out) const {
  thread_local model::OpenLoop path;
  Columns columns;
  if (!follow(set, recorded_.recordings[r].motion, static_cast<int>(r), shared, local, nullptr,
              derivatives ? &columns : nullptr, path))
    return false;
  out.reading = rows_of(r, path, false);
  MatrixXd entry(out.reading.size(), 2);
  Index row = 0;
  for (std::size_t c = 0; c < recorded_.channels.size(); ++c)
    for (std::size_t i = 0; i < data_.recordings[r].series[c].time_s.size(); ++i)
      entry.row(row++) = recorded_.channels[c].axis.head<2>().transpose();
  out.reading += entry * local.segment<2>(kEntryX);
  if (!derivatives) return true;
  MatrixXd all = rows_of(r, path, true);
  all.col(kLambda2) += shared[kLambda2] / std::numbers::pi * all.col(kU);  // lambda1 = u + lambda2^2/(2 pi)
  out.by_local.resize(all.rows(), kVariations + static_cast<Index>(columns.local.size()));
  out.by_local.col(kOwnCurvature) = shared[kCurvature] * all.col(kCurvature);
  all.col(kCurvature) *= 1 + local[kOwnCurvature];
  out.by_local.middleCols(kTiltX, 3) = all.middleCols(kBaseParameters, 3);
  out.by_local.middleCols(kEntryX, 2) = entry;
  for (std::size_t i = 0; i < columns.local.size(); ++i)
    out.by_local.col(kVariations + static_cast<Index>(i)) = all.col(columns.local[i]);
  out.by_shared = all(Eigen::all, columns.shared);
  return true;
}

MatrixXd NeedleSystem::by_curves(std::size_t r, const VectorXd& base) const {
  Index columns = 0;
  for (const auto& curve : curves_) columns += static_cast<Index>(curve.at.size());
  MatrixXd out(data_.recordings[r].rows(), columns);
  model::OpenLoop path;
  const model::NeedleParameters needle = this->needle(base);
  constexpr std::size_t kTogether = static_cast<std::size_t>(model::kMaxColumns) / kValuesOfPart;
  for (std::size_t first = 0; first < curve_physics_.size(); first += kTogether) {
    std::vector<model::ActiveEffect> effects = known(static_cast<int>(r));
    int column = 0;
    for (std::size_t i = first; i < std::min(first + kTogether, curve_physics_.size()); ++i) {
      model::ActiveEffect active;
      active.effect = curve_physics_[i].get();
      for (std::size_t p = 0; p < kValuesOfPart; ++p) active.parameters[p] = model::Dual::unknown(0, column++);
      effects.push_back(active);
    }
    if (!model::predict(model::AugmentedNeedle(needle, std::move(effects), column), recorded_.recordings[r].motion,
                        path))
      return MatrixXd::Zero(out.rows(), out.cols());
    out.middleCols(static_cast<Index>(first * kValuesOfPart), column) = rows_of(r, path, true);
  }
  return out;
}

}  // namespace bevel::diagnosis
