// SPDX-License-Identifier: MIT
/// @file
/// Interface between the inference engine and a model: predictions with derivatives, discrepancy terms, and effects
/// with priors. The engine uses nothing else of the model. Implementations: the needle (diagnosis/src/needle) and a
/// pendulum (tests/inference).
#pragma once
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <bevel/diagnosis/inference/dataset.hpp>
#include <bevel/diagnosis/inference/priors.hpp>

/// Bayesian model selection: which candidate models explain recordings, with which parameters and evidence.
namespace bevel::inference {

/// How a parameter varies between recordings.
enum class Scope {
  shared,   ///< Equal in all recordings.
  phase,    ///< Periodic; each recording has its own value.
  instant,  ///< Event time in s; each recording has its own, or 0 if the event does not occur in it.
};

/// Parameter of the nominal model or of an effect.
struct Parameter {
  std::string name;             ///< Name of the parameter.
  double lower = 0,             ///< Lower bound, in the parameter's unit.
      upper = 0;                ///< Upper bound, in the parameter's unit.
  double none = 0;              ///< Value at which the effect vanishes; NaN: it does not vanish by this parameter.
  std::vector<double> starts;   ///< Start values of fits: a grid where the likelihood has several local minima.
  Prior prior;                  ///< Prior density.
  Scope scope = Scope::shared;  ///< How the parameter varies between recordings.
  bool periodic = false;        ///< The parameter is an angle; its bounds span one period.
  bool shape = false;  ///< The predictions at two start values are not multiples of each other: no start is rescaled.
  /// periodic: index of the effect's parameter that advances by half a period when this one advances by a whole one;
  /// -1: none.
  int half_turns = -1;
  bool jumps = false;  ///< The predictions jump at this event time: it is scanned, because no derivative locates it.
};

/// Tests whether the change of the predictions is approximately proportional to the parameter's distance from `none`.
/// @param p Parameter.
/// @return True if `none` is defined and the parameter is not a shape.
inline bool is_size(const Parameter& p) { return !std::isnan(p.none) && !p.shape; }

/// Effect that the nominal model may lack. Two effects with one name are variants of one effect: a candidate model
/// contains at most one of them.
struct Effect {
  std::string name;                   ///< Name in the diagnosis report; equal for all variants.
  std::string label;                  ///< Name that distinguishes the variants.
  std::vector<Parameter> parameters;  ///< Parameters of the effect.
};

/// Insertion-specific parameter (random effect): one value per recording, normal with zero mean. The standard deviation
/// is that of its group and is estimated.
struct Nuisance {
  std::string name;       ///< Name of the parameter.
  std::size_t group = 0;  ///< Index into System::nuisance_groups().
};
/// Insertion-specific parameters that share a standard deviation.
struct NuisanceGroup {
  std::string name,  ///< Name of the group.
      unit;          ///< Unit of the standard deviations.
  /// Possible standard deviations, in \p unit. The first is 0: the recordings do not differ in these parameters.
  std::vector<double> standard_deviations;
};

/// Discrepancy term: one component as a function of one covariate, given by its values at `at`. The prior has zero mean
/// and correlation exp(-|distance| / length).
struct Curve {
  std::string component,   ///< Component of the model that the term is added to.
      unit,                ///< Unit of the component.
      covariate;           ///< Covariate that the term depends on.
  std::vector<double> at;  ///< Covariate values of the nodes.
  bool periodic = false;   ///< The covariate is an angle, and `at` divides the full circle.
};

/// Values of one discrepancy term at its nodes.
struct CurveValues {
  std::size_t curve = 0;   ///< Index into System::curves().
  Eigen::VectorXd values;  ///< One value per node Curve::at, in the component's unit.
};

/// Candidate model: ascending indices into System::effects().
using ModelSet = std::vector<std::size_t>;

/// Predicted measurements of one recording with their derivatives.
struct Prediction {
  Eigen::VectorXd reading;    ///< Predictions in the channels' units; one row per measurement.
  Eigen::MatrixXd by_shared;  ///< Derivatives, rows x shared parameters.
  Eigen::MatrixXd by_local;   ///< Derivatives, rows x local unknowns.
};

/// Model whose missing effects are inferred.
class System {
 public:
  virtual ~System() = default;
  /// Returns the recorded measurements.
  /// @return Measurements of all recordings.
  virtual const Dataset& data() const = 0;
  /// Returns the parameters of the nominal model. Every candidate model contains them.
  /// @return Parameters of the nominal model.
  virtual const std::vector<Parameter>& base() const = 0;
  /// Returns the effect library.
  /// @return Effects; a ModelSet holds indices into this list.
  virtual const std::vector<Effect>& effects() const = 0;
  /// Returns the insertion-specific parameters.
  /// @return Insertion-specific parameters, equal for all candidate models.
  virtual const std::vector<Nuisance>& nuisances() const = 0;
  /// Returns the groups of insertion-specific parameters.
  /// @return Groups; Nuisance::group is an index into this list.
  virtual const std::vector<NuisanceGroup>& nuisance_groups() const = 0;
  /// Returns the possible discrepancy terms.
  /// @return Terms; CurveValues::curve is an index into this list.
  virtual const std::vector<Curve>& curves() const = 0;
  /// Tests whether effects can be combined in one candidate model.
  /// @param set Candidate model.
  /// @return True if the combination is allowed.
  virtual bool allows(const ModelSet& set) const = 0;

  /// Predicts the measurements of one recording. Thread-safe.
  /// @param set Candidate model.
  /// @param recording Index of the recording.
  /// @param shared Shared unknowns: base(), then the shared parameters of each member of \p set.
  /// @param local Local unknowns of the recording: nuisances(), then the other parameters of each member of \p set.
  /// @param derivatives Whether to compute the derivatives.
  /// @param[out] out Predictions and, if requested, their derivatives.
  /// @return False outside the model's domain.
  virtual bool predict(const ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                       const Eigen::VectorXd& local, bool derivatives, Prediction& out) const = 0;
  /// Computes the standard deviations of the predictions that uncertain model inputs and the uncertainty of the model
  /// itself cause. The arguments are the candidate model, the recording, and the unknowns as for predict().
  /// Thread-safe.
  /// @return One standard deviation per row, in the channels' units; empty if they do not matter to this model.
  virtual Eigen::VectorXd by_inputs(const ModelSet& /*set*/, std::size_t /*recording*/,
                                    const Eigen::VectorXd& /*shared*/, const Eigen::VectorXd& /*local*/) const {
    return {};
  }
  /// Computes the derivatives of the nominal model's predictions by the values of all discrepancy terms. Thread-safe.
  /// @param recording Index of the recording.
  /// @param base Parameters of the nominal model.
  /// @return Derivatives, rows x values of all curves(), term after term.
  virtual Eigen::MatrixXd by_curves(std::size_t recording, const Eigen::VectorXd& base) const = 0;
  /// Tests whether by_curves() describes the discrepancy terms completely. If not, predict_with() describes large ones.
  /// @return True if the predictions are linear in the values of the discrepancy terms.
  virtual bool is_linear_in_curves() const { return true; }
  /// Predicts the measurements of one recording with given values of discrepancy terms. Thread-safe.
  ///
  /// The arguments are those of predict(), the values of the terms before the flag for derivatives, and last the output
  /// of the derivatives by these values (rows x values, term after term; null: not computed).
  /// @return False outside the model's domain. This implementation always returns false.
  virtual bool predict_with(const ModelSet& /*set*/, std::size_t /*recording*/, const Eigen::VectorXd& /*shared*/,
                            const Eigen::VectorXd& /*local*/, std::span<const CurveValues> /*curves*/,
                            bool /*derivatives*/, Prediction& /*out*/, Eigen::MatrixXd* /*by_values*/) const {
    return false;
  }
};

}  // namespace bevel::inference
