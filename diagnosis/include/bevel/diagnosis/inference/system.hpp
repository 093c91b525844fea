// SPDX-License-Identifier: MIT
#pragma once
// What the engine sees of a model: readings with their derivatives by shared parameters and by each recording's own
// unknowns, a discrepancy's components, and effects with their priors. It knows nothing else of what it judges; a
// needle is one client (diagnosis/src/needle), a pendulum another (tests/inference).
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <bevel/diagnosis/inference/dataset.hpp>
#include <bevel/diagnosis/inference/priors.hpp>

namespace bevel::inference {

enum class Scope {
  shared,   // the same in all recordings
  phase,    // periodic, each recording has its own
  instant,  // in seconds; each recording has its own, or none (0)
};

struct Parameter {
  std::string name;
  double lower = 0, upper = 0;
  double none = 0;             // where the effect vanishes; NaN: not by this parameter
  std::vector<double> starts;  // where fits begin: a grid where the likelihood has several local minima
  Prior prior;
  Scope scope = Scope::shared;
  bool periodic = false;
  bool shape = false;   // readings at one start are no multiple of those at another: starts are taken as they stand
  int half_turns = -1;  // periodic: the parameter of this effect that turns by half a period when this one turns by one
  bool jumps = false;   // an instant at which readings jump: it is scanned, and no derivative says where it is
};

// Readings are about as far from those without the effect as the parameter is from where it vanishes.
inline bool is_size(const Parameter& p) { return !std::isnan(p.none) && !p.shape; }

// One effect that may be missing. Two may have one name (an effect that comes in kinds): at most one of them is in a
// set.
struct Effect {
  std::string name;   // what a verdict calls it
  std::string label;  // the same but for effects in kinds: tells them apart
  std::vector<Parameter> parameters;
};

// An unknown of its own in every recording, normal about zero; its standard deviation is one of a group's, unknown too.
struct Nuisance {
  std::string name;
  std::size_t group = 0;
};
struct NuisanceGroup {
  std::string name, unit;
  // The first is 0: in this way the recordings do not differ.
  std::vector<double> standard_deviations;
};

// A component of the discrepancy as a function of one covariate, by its values at `at`; zero mean, covariance
// exp(-|distance| / length). periodic: the covariate is an angle and `at` divides its circle.
struct Curve {
  std::string component, unit, covariate;
  std::vector<double> at;
  bool periodic = false;
};

// Values of one of a system's curves, at its `at`.
struct CurveValues {
  std::size_t curve = 0;
  Eigen::VectorXd values;
};

// A set of effects: indices into System::effects(), ascending.
using ModelSet = std::vector<std::size_t>;

struct Prediction {
  Eigen::VectorXd reading;    // rows of the recording
  Eigen::MatrixXd by_shared;  // rows x shared parameters
  Eigen::MatrixXd by_local;   // rows x local unknowns
};

class System {
 public:
  virtual ~System() = default;
  virtual const Dataset& data() const = 0;
  virtual const std::vector<Parameter>& base() const = 0;  // the model's own parameters, in every set
  virtual const std::vector<Effect>& effects() const = 0;
  virtual const std::vector<Nuisance>& nuisances() const = 0;
  virtual const std::vector<NuisanceGroup>& nuisance_groups() const = 0;
  virtual const std::vector<Curve>& curves() const = 0;
  // Whether these effects can be in a model together.
  virtual bool allows(const ModelSet& set) const = 0;

  // shared: base(), then each member's shared parameters; local: nuisances(), then each member's others. False outside
  // the model's domain. Thread-safe.
  virtual bool predict(const ModelSet& set, std::size_t recording, const Eigen::VectorXd& shared,
                       const Eigen::VectorXd& local, bool derivatives, Prediction& out) const = 0;
  // Standard deviations of the rows by what the model's inputs are not known to, and by what it leaves open itself,
  // where that matters to this set; unknowns as for predict. Empty: nowhere. Thread-safe.
  virtual Eigen::VectorXd by_inputs(const ModelSet& /*set*/, std::size_t /*recording*/,
                                    const Eigen::VectorXd& /*shared*/, const Eigen::VectorXd& /*local*/) const {
    return {};
  }
  // Derivatives of the readings by the values of all curves, one after the other, without effects. Thread-safe.
  virtual Eigen::MatrixXd by_curves(std::size_t recording, const Eigen::VectorXd& base) const = 0;
  // Whether by_curves() is all there is to say of curves; if not, predict_with() says what they do where they are
  // large.
  virtual bool is_linear_in_curves() const { return true; }
  // predict() where curves have these values; by_values, unless null: the readings' derivatives by them, one curve
  // after the other. False outside the model's domain. Thread-safe.
  virtual bool predict_with(const ModelSet& /*set*/, std::size_t /*recording*/, const Eigen::VectorXd& /*shared*/,
                            const Eigen::VectorXd& /*local*/, std::span<const CurveValues> /*curves*/,
                            bool /*derivatives*/, Prediction& /*out*/, Eigen::MatrixXd* /*by_values*/) const {
    return false;
  }
};

}  // namespace bevel::inference
