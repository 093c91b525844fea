// SPDX-License-Identifier: MIT
#pragma once
/// @file
/// Model of the needle for the inference (diagnosis/src/inference). It predicts the cameras' measurements from the
/// actuator motion, with insertion-specific parameters, the effects of the library, and a discrepancy in each component
/// of the tip's twist and of the measurement.
///
/// With two groups of recordings the diagnosis identifies the change between them. Effects, discrepancy and changes of
/// the needle's parameters then act in the second group alone. Model errors common to both groups are absorbed by
/// shared parameters: the error of each channel as a function of depth.
#include <span>

#include <bevel/diagnosis/inference/system.hpp>
#include <bevel/diagnosis/needle/curves.hpp>
#include <bevel/diagnosis/needle/recorded_case.hpp>

namespace bevel::diagnosis {

/// Order of the shared parameters of the needle; the common errors of two groups follow.
enum BaseParameter : int {
  kCurvature,      ///< curvature k, 1/mm
  kU,              ///< u = lambda1 - lambda2^2/(2 pi), 1/rad; the domain of Eq. (26) is u >= 0
  kLambda2,        ///< lambda2
  kBaseParameters  ///< number of needle parameters
};
/// Order of the insertion-specific parameters.
enum Variation : int {
  kOwnCurvature,          ///< relative deviation of the curvature
  kTiltX,                 ///< rotation vector of the heading at the entry, x component, rad
  kTiltY,                 ///< rotation vector of the heading at the entry, y component, rad
  kRoll,                  ///< roll of the bevel at the entry, rad
  kEntryX,                ///< registration along x of {A}, mm
  kEntryY,                ///< registration along y of {A}, mm
  kVariations,            ///< number of parameters for a motorised rig
  kEntryZ = kVariations,  ///< insertion by hand: registration along z of {A}, mm
  kBendX,                 ///< insertion by hand: curvature toward +x of {A}, proportional to depth, 1/mm per 100 mm
  kBendY,                 ///< insertion by hand: curvature toward +y of {A}, proportional to depth, 1/mm per 100 mm
  kVariationsByHand       ///< number of parameters for insertions by hand
};

/// Effects that the nominal model already has. They are constant in every prediction.
struct KnownPhysics {
  std::vector<std::vector<model::ActiveEffect>> in_recording;  ///< per recording, in the order of the recordings
  std::vector<model::ActiveEffect> elsewhere;                  ///< in a motion that was not recorded
};

/// Standard deviation of the prior density of u about the model file, 1/rad; wider than the differences in Table I.
inline constexpr double kUWidth_per_rad = 0.5;
/// Standard deviation of the prior density of lambda2 about the model file; wider than the differences in Table I.
inline constexpr double kLambda2Width = 0.3;

/// Needle model and recordings as a system of the inference.
class NeedleSystem final : public inference::System {
 public:
  /// Builds parameters, priors, effects and curves for the recordings. A known effect is not a candidate.
  /// @param recorded recordings of one rig
  /// @param model parameters of the nominal model
  /// @param known effects of the nominal model
  /// @throws bevel::ArgumentError if the nominal model has more than two known effects and discrepancy terms (one for
  ///   recordings without time stamps)
  NeedleSystem(RecordedCase recorded, const model::NeedleParameters& model, KnownPhysics known = {});

  /// Returns the recordings.
  /// @return the recordings
  const RecordedCase& recorded() const { return recorded_; }
  /// Returns the parameters of the nominal model.
  /// @return parameters of the model file
  const model::NeedleParameters& model() const { return model_; }
  /// Returns the known effects of a recording.
  /// @param recording index of the recording; -1: a motion that was not recorded
  /// @return effects of the nominal model
  const std::vector<model::ActiveEffect>& known(int recording) const;
  /// Returns the measurements of all recordings.
  /// @return the data set
  const inference::Dataset& data() const override { return data_; }
  /// Returns the shared parameters: BaseParameter, then the common errors of two groups.
  /// @return the parameters with their priors
  const std::vector<inference::Parameter>& base() const override { return base_; }
  /// Returns the candidate effects.
  /// @return effects of the library, and for two groups the changes of the needle's parameters
  const std::vector<inference::Effect>& effects() const override { return effects_; }
  /// Returns the insertion-specific parameters.
  /// @return the parameters in the order of Variation
  const std::vector<inference::Nuisance>& nuisances() const override { return nuisances_; }
  /// Returns the groups of insertion-specific parameters with a common standard deviation.
  /// @return the groups with their grids of standard deviations
  const std::vector<inference::NuisanceGroup>& nuisance_groups() const override { return groups_; }
  /// Returns the possible discrepancy terms.
  /// @return the curves of needle_curve(), in the same order
  const std::vector<inference::Curve>& curves() const override { return curves_; }
  /// Returns whether effects can be in one model: no effect of the library occurs twice, and the parameters fit into
  /// the path's Jacobian.
  /// @param set indices into effects(), ascending
  /// @return true if they can
  bool allows(const inference::ModelSet& set) const override;
  /// Predicts the measurements of a recording without discrepancy. Thread-safe.
  /// @param set effects of the model
  /// @param recording index of the recording
  /// @param shared base(), then the shared parameters of each effect
  /// @param local nuisances(), then the recording-specific parameters of each effect
  /// @param derivatives whether to compute the Jacobians
  /// @param out predicted measurements and Jacobians
  /// @return false if the tip leaves the domain of the slip law
  bool predict(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
               const Eigen::VectorXd& local, bool derivatives, inference::Prediction& out) const override;
  /// Computes the standard deviation of the predicted measurements by the uncertainty of the actuator position (0.01
  /// mm) and by the effects themselves. Only sudden effects are sensitive to it. Thread-safe.
  /// @param set effects of the model
  /// @param recording index of the recording
  /// @param shared as for predict()
  /// @param local as for predict()
  /// @return one standard deviation per measurement, mm or rad; empty if no effect of the set is sudden
  Eigen::VectorXd by_inputs(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                            const Eigen::VectorXd& local) const override;
  /// Computes the derivatives of the measurements by the values of all curves, without effects. Thread-safe.
  /// @param recording index of the recording
  /// @param base shared parameters
  /// @return measurements x values, one curve after the other; zero if the tip leaves the domain of the slip law
  Eigen::MatrixXd by_curves(std::size_t recording, const Eigen::VectorXd& base) const override;
  /// Returns whether the prediction is linear in the values of the curves.
  /// @return false
  bool is_linear_in_curves() const override { return false; }
  /// Predicts the measurements of a recording with discrepancy terms. Thread-safe.
  /// @param set effects of the model
  /// @param recording index of the recording
  /// @param shared as for predict()
  /// @param local as for predict()
  /// @param curves values of the discrepancy terms
  /// @param derivatives whether to compute the Jacobians of out
  /// @param out predicted measurements and Jacobians
  /// @param by_values derivatives by the values of the curves, one curve after the other; may be null
  /// @return false if the tip leaves the domain of the slip law
  bool predict_with(const inference::ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                    const Eigen::VectorXd& local, std::span<const inference::CurveValues> curves, bool derivatives,
                    inference::Prediction& out, Eigen::MatrixXd* by_values) const override;

  /// Converts shared parameters to parameters of the needle.
  /// @param shared base(), or more
  /// @return the nominal model with curvature, lambda1 and lambda2 from shared
  model::NeedleParameters needle(const Eigen::VectorXd& shared) const;
  /// Whether the shaft turns enough in some recording to separate slip from curvature. Otherwise lambda is held at the
  /// value of the model file, and its change is no candidate.
  /// @return true if the shaft turns by 0.1 rad or more while it inserts in at least one recording
  bool determines_slip() const { return determines_slip_; }
  /// Returns the needle parameter whose change between two groups an effect describes.
  /// @param effect index into effects()
  /// @return a BaseParameter; -1 for an effect of the library
  int changed_parameter(std::size_t effect) const;
  /// Returns the effect of the library that corresponds to a candidate effect.
  /// @param effect index into effects()
  /// @return the effect
  const model::Effect& physics(std::size_t effect) const { return *physics_[effect]; }
  /// Returns the library's parameter that corresponds to a parameter of a candidate effect.
  /// @param effect index into effects()
  /// @param parameter index into its parameters
  /// @return the parameter
  const model::EffectParameter& parameter(std::size_t effect, std::size_t parameter) const;
  /// Returns component and covariate of a possible discrepancy term.
  /// @param curve index into curves()
  /// @return the term without its values
  const NeedleCurve& needle_curve(std::size_t curve) const { return needle_curves_[curve]; }
  /// Converts a discrepancy term to the form of a model file.
  /// @param curve index into curves()
  /// @param values values at its knots, in the component's unit
  /// @param std_errors standard errors of values
  /// @return the discrepancy term
  model::DiscrepancyCurve model_curve(std::size_t curve, std::vector<double> values,
                                      std::vector<double> std_errors) const {
    return to_model(needle_curves_[curve], std::move(values), std::move(std_errors));
  }
  /// Predicts tip positions (in {A}, mm) at the measurements of any motion, and headings if a channel measures them.
  /// @param set effects of the model
  /// @param motion actuator motion
  /// @param recording index of the recording with this motion; -1: not recorded, of the second group if there are two
  /// @param shared as for predict()
  /// @param local as for predict()
  /// @param discrepancy values of the discrepancy terms
  /// @param out predicted path
  /// @return false if the tip leaves the domain of the slip law
  bool tip_path(const inference::ModelSet& set, const model::Motion& motion, int recording,
                const Eigen::VectorXd& shared, const Eigen::VectorXd& local,
                std::span<const inference::CurveValues> discrepancy, model::OpenLoop& out) const;

 private:
  // Columns of a path's Jacobian for the effects' shared and recording-specific parameters. kNone: the parameter has no
  // influence on this recording.
  struct Columns {
    static constexpr Eigen::Index kNone = -1;
    std::vector<Eigen::Index> shared, local;
  };
  // by_curve: if `columns` is null, the discrepancy term for whose values the path's Jacobian is computed.
  static constexpr std::size_t kNoCurve = static_cast<std::size_t>(-1);
  bool follow(const inference::ModelSet& set, const model::Motion& motion, int recording, const Eigen::VectorXd& shared,
              const Eigen::VectorXd& local, std::span<const inference::CurveValues> discrepancy, Columns* columns,
              model::OpenLoop& path, std::size_t by_curve = kNoCurve) const;
  Eigen::MatrixXd rows_of(std::size_t recording, const model::OpenLoop& path, bool derivatives) const;
  // Returns whether effects and discrepancy act in a recording.
  bool acts_in(int recording) const;
  void add_effects_of_library();
  void add_common_errors();
  // Needle parameters in a recording: with its insertion-specific curvature and the change of the second group.
  model::NeedleParameters needle_in(const inference::ModelSet& set, int recording, const Eigen::VectorXd& shared,
                                    const Eigen::VectorXd& local) const;
  bool by_hand() const { return !recorded_.has_clock; }
  // Number of registration parameters: kEntryX, kEntryY and, for insertions by hand, kEntryZ.
  Eigen::Index registrations() const { return (by_hand() ? kEntryZ : kEntryY) + 1 - kEntryX; }
  Eigen::Index own_size() const { return static_cast<Eigen::Index>(nuisances_.size()); }
  Eigen::Index base_size() const { return static_cast<Eigen::Index>(base_.size()); }

  RecordedCase recorded_;
  model::NeedleParameters model_;
  KnownPhysics known_;
  inference::Dataset data_;
  std::vector<inference::Parameter> base_;
  std::vector<inference::Effect> effects_;
  std::vector<const model::Effect*> physics_;  // one per effect
  std::vector<std::uint32_t> variants_;
  std::vector<inference::Nuisance> nuisances_;
  std::vector<inference::NuisanceGroup> groups_;
  std::vector<NeedleCurve> needle_curves_;
  std::vector<inference::Curve> curves_;
  std::vector<std::shared_ptr<const model::Effect>> curve_physics_;  // parts of the curves, in the order of curves_
  bool two_groups_, determines_slip_, headings_;
  std::vector<double> common_at_mm_;             // depths of the common errors of each channel; empty: one group
  std::vector<Eigen::MatrixXd> common_columns_;  // one per recording
};

}  // namespace bevel::diagnosis
