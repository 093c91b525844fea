// SPDX-License-Identifier: MIT
#pragma once
// The needle as the engine's client (diagnosis/src/inference): readings of the cameras from the base's motion, with
// what differs between insertions, the effects of the library, and a discrepancy in each component of the tip's twist
// and of the reading.
//
// Where the recordings are of two groups, the question is what changed: effects, discrepancy and changes of the
// needle's own parameters act in the second group alone, and what the model gets wrong in both groups alike is no
// matter: each channel's error against depth, common to all recordings, is among the shared parameters.
#include <span>

#include <bevel/diagnosis/inference/system.hpp>
#include <bevel/diagnosis/needle/curves.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>

namespace bevel::diagnosis {

// Shared parameters, in this order, then common errors; u = lambda1 - lambda2^2/(2 pi) >= 0 is the domain (26) as a
// bound.
enum BaseParameter : int { kCurvature, kU, kLambda2, kBaseParameters };
// What insertions have of their own: curvature as a share of the needle's, the heading's rotation vector at the entry
// (rad), the bevel's roll there (rad), registration across the axis (mm); guided by hand also registration along it,
// and a curvature toward +x and +y of {A} that grows with depth from none at the entry (/mm per 100 mm).
enum Variation : int {
  kOwnCurvature,
  kTiltX,
  kTiltY,
  kRoll,
  kEntryX,
  kEntryY,
  kVariations,
  kEntryZ = kVariations,
  kBendX,
  kBendY,
  kVariationsByHand
};

// Physics that the model in use has already: held as it is in every prediction.
struct KnownPhysics {
  std::vector<std::vector<model::ActiveEffect>> in_recording;  // in the order of the recordings
  std::vector<model::ActiveEffect> elsewhere;                  // in a motion that was not recorded
};

/// Standard deviations of the prior densities of u and lambda2 about the model file: all of Table I and beyond.
inline constexpr double kUWidth_per_rad = 0.5;
inline constexpr double kLambda2Width = 0.3;

class NeedleSystem final : public inference::System {
 public:
  // Throws ArgumentError where `known` is too much to add anything to. An effect that is known is no candidate.
  NeedleSystem(RecordedCase recorded, const model::NeedleParameters& model, KnownPhysics known = {});

  const RecordedCase& recorded() const { return recorded_; }
  const model::NeedleParameters& model() const { return model_; }  // in use
  // What the model in use says of a recording, as it stands; a recording's index, or -1 for a motion elsewhere.
  const std::vector<model::ActiveEffect>& known(int recording) const;
  const inference::Dataset& data() const override { return data_; }
  const std::vector<inference::Parameter>& base() const override { return base_; }
  const std::vector<inference::Effect>& effects() const override { return effects_; }
  const std::vector<inference::Nuisance>& nuisances() const override { return nuisances_; }
  const std::vector<inference::NuisanceGroup>& nuisance_groups() const override { return groups_; }
  const std::vector<inference::Curve>& curves() const override { return curves_; }
  bool allows(const inference::ModelSet& set) const override;
  bool predict(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
               const Eigen::VectorXd& local, bool derivatives, inference::Prediction& out) const override;
  // Of effects that are sudden, by where the base is: to a hundredth of a millimetre.
  Eigen::VectorXd by_inputs(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                            const Eigen::VectorXd& local) const override;
  Eigen::MatrixXd by_curves(std::size_t recording, const Eigen::VectorXd& base) const override;
  bool is_linear_in_curves() const override { return false; }
  bool predict_with(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                    const Eigen::VectorXd& local, std::span<const inference::CurveValues> curves, bool derivatives,
                    inference::Prediction& out, Eigen::MatrixXd* by_values) const override;

  model::NeedleParameters needle(const Eigen::VectorXd& shared) const;
  /// Whether the shaft turns enough in some recording to separate slip from curvature. Otherwise lambda is held at the
  /// value of the model file, and its change is no candidate.
  bool determines_slip() const { return determines_slip_; }
  // Of these recordings' effects that no library holds: by how much a parameter of the needle changed; -1: none.
  int changed_parameter(std::size_t effect) const;
  // The library's effect behind one of effects().
  const model::Effect& physics(std::size_t effect) const { return *physics_[effect]; }
  // The library's parameter behind one of an effect's.
  const model::EffectParameter& parameter(std::size_t effect, std::size_t parameter) const;
  // What is behind one of curves(); with values, as a model file carries it.
  const NeedleCurve& needle_curve(std::size_t curve) const { return needle_curves_[curve]; }
  model::DiscrepancyCurve model_curve(std::size_t curve, std::vector<double> values,
                                      std::vector<double> std_errors) const {
    return to_model(needle_curves_[curve], std::move(values), std::move(std_errors));
  }
  // Positions of the tip at the readings of any motion, in {A}, mm, and headings where some are measured; unknowns as
  // for predict. recording: whose motion it is, or -1: of the second group, if there are two.
  bool tip_path(const inference::ModelSet& set, const model::Motion& motion, int recording,
                const Eigen::VectorXd& shared, const Eigen::VectorXd& local,
                std::span<const inference::CurveValues> discrepancy, model::OpenLoop& out) const;

 private:
  // Which columns of a path's Jacobian are the members' shared unknowns, and which their own in the recording. kNone:
  // not in this recording.
  struct Columns {
    static constexpr Eigen::Index kNone = -1;
    std::vector<Eigen::Index> shared, local;
  };
  // by_curve: which of the discrepancy's curves the path's Jacobian is by the values of, where `columns` is null.
  static constexpr std::size_t kNoCurve = static_cast<std::size_t>(-1);
  bool follow(const inference::ModelSet& set, const model::Motion& motion, int recording, const Eigen::VectorXd& shared,
              const Eigen::VectorXd& local, std::span<const inference::CurveValues> discrepancy, Columns* columns,
              model::OpenLoop& path, std::size_t by_curve = kNoCurve) const;
  Eigen::MatrixXd rows_of(std::size_t recording, const model::OpenLoop& path, bool derivatives) const;
  // Whether effects and discrepancy act in it.
  bool acts_in(int recording) const;
  void add_effects_of_library();
  void add_common_errors();
  // The needle of a recording: its own curvature, and what changed.
  model::NeedleParameters needle_in(const inference::ModelSet& set, int recording, const Eigen::VectorXd& shared,
                                    const Eigen::VectorXd& local) const;
  bool by_hand() const { return !recorded_.has_clock; }
  // kEntryX and kEntryY, and kEntryZ where it is unknown.
  Eigen::Index registrations() const { return (by_hand() ? kEntryZ : kEntryY) + 1 - kEntryX; }
  Eigen::Index own_size() const { return static_cast<Eigen::Index>(nuisances_.size()); }
  Eigen::Index base_size() const { return static_cast<Eigen::Index>(base_.size()); }

  RecordedCase recorded_;
  model::NeedleParameters model_;
  KnownPhysics known_;
  inference::Dataset data_;
  std::vector<inference::Parameter> base_;
  std::vector<inference::Effect> effects_;
  std::vector<const model::Effect*> physics_;  // of each effect
  std::vector<std::uint32_t> variants_;
  std::vector<inference::Nuisance> nuisances_;
  std::vector<inference::NuisanceGroup> groups_;
  std::vector<NeedleCurve> needle_curves_;
  std::vector<inference::Curve> curves_;
  std::vector<std::shared_ptr<const model::Effect>> curve_physics_;  // parts of the curves, in their order
  bool two_groups_, determines_slip_, headings_;
  std::vector<double> common_at_mm_;             // depths at which each channel has a common error; none: no groups
  std::vector<Eigen::MatrixXd> common_columns_;  // of each recording
};

}  // namespace bevel::diagnosis
