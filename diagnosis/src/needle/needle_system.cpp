// SPDX-License-Identifier: MIT
#include <bevel/diagnosis/needle/needle_system.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <bevel/diagnosis/needle/curves.hpp>

namespace bevel::diagnosis {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::CurveValues;
using inference::ModelSet;
using inference::Scope;

namespace {

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

// Bends it more and more the deeper it is, toward +x and +y of {A}: what an insertion by hand has of its own.
class BendGradient final : public model::Effect {
 public:
  BendGradient()
      : Effect({.name = "bend_gradient",
                .meaning = "insertions bend away from each other",
                .covariate = model::Covariate::depth_mm,
                .parameters = {{.name = "x_per_mm_per_100mm", .lower = -1, .upper = 1, .none = 0, .starts = {0}},
                               {.name = "y_per_mm_per_100mm", .lower = -1, .upper = 1, .none = 0, .starts = {0}}}}) {}
  void curvature(model::Parameters p, const model::LegView& leg, model::EffectMemory& /*memory*/,
                 model::Dual2& kappa_per_mm) const override {
    constexpr double kPer_mm = 100;
    const double middle_mm = 0.5 * (leg.from.insertion_mm + leg.to.insertion_mm) - leg.entry.insertion_mm;
    const double share = middle_mm / kPer_mm;
    const model::Dual2 pull = leg.curvature_toward({p[0] * share, p[1] * share});
    for (std::size_t i = 0; i < 2; ++i) kappa_per_mm[i] += pull[i];
  }
};
const BendGradient& bend_gradient() {
  static const BendGradient effect;
  return effect;
}

}  // namespace

bool NeedleSystem::acts_in(int recording) const {
  return !two_groups_ || recording < 0 || recorded_.recordings[static_cast<std::size_t>(recording)].changed;
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
    const Channel& channel = recorded_.channels[c];
    const auto& vectors = channel.heading ? path.heading : path.position_mm;
    const auto& jacobian = channel.heading ? path.heading_jacobian : path.jacobian;
    for (const std::size_t reading : recording.series[c].message) {
      if (derivatives)
        out.row(row++).noalias() = channel.axis.transpose() * jacobian.middleRows<3>(static_cast<Index>(3 * reading));
      else
        out(row++, 0) = channel.axis.dot(vectors[reading]);
    }
  }
  return out;
}

const std::vector<model::ActiveEffect>& NeedleSystem::known(int recording) const {
  const auto r = static_cast<std::size_t>(recording);
  return recording >= 0 && r < known_.in_recording.size() ? known_.in_recording[r] : known_.elsewhere;
}

model::NeedleParameters NeedleSystem::needle_in(const ModelSet& set, int recording, const VectorXd& shared,
                                                const VectorXd& local) const {
  model::NeedleParameters needle = this->needle(shared);
  if (acts_in(recording)) {
    Index at = base_size();
    for (const std::size_t e : set) {
      const int changed = changed_parameter(e);
      if (changed == kCurvature) needle.curvature_per_mm *= 1 + shared[at];
      if (changed == kU) needle.lambda1_per_rad += shared[at];
      if (changed == kLambda2) needle.lambda2 += shared[at];
      for (const auto& parameter : effects_[e].parameters) at += parameter.scope == Scope::shared ? 1 : 0;
    }
  }
  needle.curvature_per_mm *= 1 + local[kOwnCurvature];
  return needle;
}

bool NeedleSystem::follow(const ModelSet& set, const model::Motion& motion, int recording, const VectorXd& shared,
                          const VectorXd& local, std::span<const CurveValues> discrepancy, Columns* columns,
                          model::OpenLoop& path, std::size_t by_curve) const {
  // Columns: the needle's three, tilt and roll, by hand the bend, then the effects' in the order of the set.
  int column = kBaseParameters;
  const auto unknown = [&](double value) { return model::Dual::unknown(value, columns ? column++ : -1); };
  std::vector<model::ActiveEffect> effects(1);
  effects[0].effect = &entry_variation();
  for (std::size_t i = 0; i < 3; ++i) effects[0].parameters[i] = unknown(local[kTiltX + static_cast<Index>(i)]);
  if (by_hand()) {
    model::ActiveEffect& bend = effects.emplace_back();
    bend.effect = &bend_gradient();
    for (std::size_t i = 0; i < 2; ++i) bend.parameters[i] = unknown(local[kBendX + static_cast<Index>(i)]);
  }
  if (columns) *columns = {};
  Index next_shared = base_size(), next_local = own_size();
  const bool acts = acts_in(recording);
  for (const std::size_t e : set) {
    const int changed = changed_parameter(e);
    if (!acts || changed >= 0) {
      for (const auto& parameter : effects_[e].parameters) {
        const bool own = parameter.scope != Scope::shared;
        ++(own ? next_local : next_shared);
        if (columns) (own ? columns->local : columns->shared).push_back(acts ? changed : Columns::kNone);
      }
      continue;
    }
    model::ActiveEffect active;
    active.effect = physics_[e];
    const auto& parameters = physics_[e]->parameters();
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      if ((variants_[e] >> p & 1U) == 0) {
        active.parameters[p] = model::value_if_unsaid(parameters[p]);
        continue;
      }
      const bool own = parameters[p].scope == model::Scope::recording;
      if (columns) (own ? columns->local : columns->shared).push_back(column);
      active.parameters[p] = unknown(own ? local[next_local++] : shared[next_shared++]);
    }
    effects.push_back(active);
  }
  effects.insert(effects.end(), known(recording).begin(), known(recording).end());
  int of_curve = 0;
  for (std::size_t i = 0; acts && i < discrepancy.size(); ++i) {
    const auto& [curve, values] = discrepancy[i];
    if (i == by_curve) of_curve = static_cast<int>(values.size());
    model::ActiveEffect& active = effects.emplace_back();
    active.owned = make_curve(needle_curves_[curve], values, i == by_curve ? 0 : -1);
    active.effect = active.owned.get();
  }
  const model::AugmentedNeedle augmented(
      needle_in(set, recording, shared, local), std::move(effects), columns ? column : of_curve,
      columns ? model::NeedleColumns{.curvature = 0, .lambda1 = 1, .lambda2 = 2, .wheelbase = -1}
              : model::NeedleColumns{});
  return model::predict(augmented, motion, path, headings_);
}

bool NeedleSystem::tip_path(const ModelSet& set, const model::Motion& motion, int recording, const VectorXd& shared,
                            const VectorXd& local, std::span<const CurveValues> discrepancy,
                            model::OpenLoop& out) const {
  if (!follow(set, motion, recording, shared, local, discrepancy, nullptr, out)) return false;
  for (auto& position : out.position_mm) position.head(registrations()) += local.segment(kEntryX, registrations());
  if (common_at_mm_.empty()) return true;
  for (std::size_t i = 0; i < motion.at.size(); ++i) {
    const auto weights = model::weights_at(common_at_mm_, false, motion.nodes[motion.at[i]].insertion_mm);
    for (std::size_t c = 0; c < recorded_.channels.size(); ++c) {
      const Channel& channel = recorded_.channels[c];
      if (channel.camera != recorded_.channels.front().camera) continue;  // another sees the same, in its own way
      double error = 0;
      for (std::size_t k = 0; k < 2; ++k)
        error += weights.weight[k] *
                 shared[static_cast<Index>(kBaseParameters + c * common_at_mm_.size() + weights.knot[k])];
      (channel.heading ? out.heading : out.position_mm)[i] += error * channel.axis;
    }
  }
  return true;
}

bool NeedleSystem::predict(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd& local,
                           bool derivatives, inference::Prediction& out) const {
  return predict_with(set, r, shared, local, {}, derivatives, out, nullptr);
}

bool NeedleSystem::predict_with(const ModelSet& set, std::size_t r, const VectorXd& shared, const VectorXd& local,
                                std::span<const CurveValues> curves, bool derivatives, inference::Prediction& out,
                                MatrixXd* by_values) const {
  thread_local model::OpenLoop path;
  const auto& motion = recorded_.recordings[r].motion;
  if (by_values) {
    Index count = 0;
    for (const auto& one : curves) count += one.values.size();
    *by_values = MatrixXd::Zero(data_.recordings[r].rows(), count);
    count = 0;
    for (std::size_t i = 0; i < curves.size() && acts_in(static_cast<int>(r)); ++i) {
      if (!follow(set, motion, static_cast<int>(r), shared, local, curves, nullptr, path, i)) return false;
      by_values->middleCols(count, curves[i].values.size()) = rows_of(r, path, true);
      count += curves[i].values.size();
    }
  }
  Columns columns;
  if (!follow(set, motion, static_cast<int>(r), shared, local, curves, derivatives ? &columns : nullptr, path))
    return false;
  out.reading = rows_of(r, path, false);
  MatrixXd entry = MatrixXd::Zero(out.reading.size(), registrations());
  Index row = 0;
  for (std::size_t c = 0; c < recorded_.channels.size(); ++c)
    for (std::size_t i = 0; i < data_.recordings[r].series[c].time_s.size(); ++i, ++row)
      if (!recorded_.channels[c].heading) entry.row(row) = recorded_.channels[c].axis.head(registrations()).transpose();
  out.reading += entry * local.segment(kEntryX, registrations());
  const Index common = base_size() - kBaseParameters;
  if (common > 0) out.reading += common_columns_[r] * shared.segment(kBaseParameters, common);
  if (!derivatives) return true;
  MatrixXd all = rows_of(r, path, true);  // by the recording's own needle
  const double own = 1 + local[kOwnCurvature];
  const double k = needle_in(set, static_cast<int>(r), shared, local).curvature_per_mm;
  out.by_local = MatrixXd::Zero(all.rows(), own_size() + static_cast<Index>(columns.local.size()));
  out.by_local.col(kOwnCurvature) = k / own * all.col(kCurvature);
  out.by_local.middleCols(kTiltX, 3) = all.middleCols(kBaseParameters, 3);
  if (by_hand()) out.by_local.middleCols(kBendX, 2) = all.middleCols(kBaseParameters + 3, 2);
  out.by_local.middleCols(kEntryX, registrations()) = entry;
  for (std::size_t i = 0; i < columns.local.size(); ++i)
    if (columns.local[i] != Columns::kNone)
      out.by_local.col(own_size() + static_cast<Index>(i)) = all.col(columns.local[i]);
  out.by_shared = MatrixXd::Zero(all.rows(), base_size() + static_cast<Index>(columns.shared.size()));
  const double k_shared = shared[kCurvature];
  out.by_shared.col(kCurvature) = (k_shared != 0 ? k / k_shared : own) * all.col(kCurvature);
  out.by_shared.col(kU) = all.col(kU);
  // lambda1 = u + lambda2^2/(2 pi)
  out.by_shared.col(kLambda2) = all.col(kLambda2) + shared[kLambda2] / std::numbers::pi * all.col(kU);
  if (common > 0) out.by_shared.middleCols(kBaseParameters, common) = common_columns_[r];
  for (std::size_t i = 0; i < columns.shared.size(); ++i) {
    if (columns.shared[i] == Columns::kNone) continue;
    auto column = out.by_shared.col(base_size() + static_cast<Index>(i));
    column = all.col(columns.shared[i]);
    if (columns.shared[i] == kCurvature) column *= k_shared * own;  // of a change: an effect's begin after the needle's
  }
  return true;
}

VectorXd NeedleSystem::by_inputs(const ModelSet& set, std::size_t r, const VectorXd& shared,
                                 const VectorXd& local) const {
  // Lead screws of 2 mm turned by 200 full steps; what a microstep is off by, and a screw within a turn, is about that.
  constexpr double kBase_mm = 0.01;
  if (std::ranges::none_of(set, [&](std::size_t e) { return physics_[e]->sudden(); })) return {};
  model::Motion motion = recorded_.recordings[r].motion;
  model::OpenLoop ahead, behind;
  const auto shift = [&](double by_mm) {  // where it entered is where it entered
    for (std::size_t i = 1; i < motion.nodes.size(); ++i) motion.nodes[i].insertion_mm += by_mm;
  };
  shift(kBase_mm);
  const bool one = follow(set, motion, static_cast<int>(r), shared, local, {}, nullptr, ahead);
  shift(-2 * kBase_mm);
  if (!one || !follow(set, motion, static_cast<int>(r), shared, local, {}, nullptr, behind)) return {};
  VectorXd variance = 0.25 * (rows_of(r, ahead, false) - rows_of(r, behind, false)).cwiseAbs2();
  Index row = 0;
  for (std::size_t c = 0; c < recorded_.channels.size(); ++c)
    for (const std::size_t reading : recorded_.recordings[r].series[c].message) {
      if (!recorded_.channels[c].heading)
        variance[row] +=
            recorded_.channels[c].axis.cwiseAbs2().dot(Eigen::Vector3d::Map(ahead.blur_mm2[reading].data()));
      ++row;
    }
  return variance.cwiseSqrt();
}

MatrixXd NeedleSystem::by_curves(std::size_t r, const VectorXd& base) const {
  Index columns = 0;
  for (const auto& curve : curves_) columns += static_cast<Index>(curve.at.size());
  if (!acts_in(static_cast<int>(r))) return MatrixXd::Zero(data_.recordings[r].rows(), columns);
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
                        path, headings_))
      return MatrixXd::Zero(out.rows(), out.cols());
    out.middleCols(static_cast<Index>(first * kValuesOfPart), column) = rows_of(r, path, true);
  }
  return out;
}

}  // namespace bevel::diagnosis
