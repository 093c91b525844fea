// SPDX-License-Identifier: MIT
#pragma once
// The likelihood of readings under a set of effects, a discrepancy and autocorrelated noise, and its mode.
//
//   y_r = h(shared, local_r, c) + e_r             e_r ~ noise;  local_r: nuisances ~ N(0, sd^2), phases, instants
//                                                 c ~ N(0, K): the discrepancy, a sum of curves,
//                                                 h linear in it about none or about a tangent's values
//
// Solution (mode.cpp): Gauss-Newton with Levenberg's damping on the arrow-shaped normal equations, along geodesics
// where the linear model promises too much; bounds by an active set.
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include <bevel/diagnosis/inference/arrow.hpp>
#include <bevel/diagnosis/inference/layout.hpp>
#include <bevel/diagnosis/inference/noise.hpp>
#include <bevel/diagnosis/inference/prediction_memo.hpp>

namespace bevel::inference {

// Covariance of a curve's values: scale^2 exp(-|distance| / length), lengths as a share of the covariate's range. The
// scale is the root mean square over all readings of what such a curve does to them beside the base's own parameters,
// in standard deviations of the noise.
struct CurvePrior {
  std::size_t curve = 0;
  double scale = 0;
  double length = 0;
  bool operator==(const CurvePrior&) const = default;
};
Eigen::MatrixXd correlation_of(const Curve& curve, double length);

// Standard deviation of a nuisance that does not vary, relative or in its unit. Smaller ones cost digits: where the
// mode is elsewhere, the least square is a difference of numbers of its precision.
inline constexpr double kNone_sd = 1e-6;

// What is held while the mode is sought.
struct Scales {
  Eigen::VectorXd nuisance_sd;     // per group; 0: the recordings do not differ
  std::vector<CurvePrior> curves;  // of the discrepancy; empty: none
};

struct Residuals {
  Eigen::VectorXd white;      // measured - predicted
  Eigen::MatrixXd by_shared;  // d(prediction)/d(unknown), whitened
  Eigen::MatrixXd by_local;
};

// Columns of one curve or of several side by side, whitened, per recording: rows x values; the values' prior covariance
// is `covariance`, zero between curves.
struct CurveColumns {
  std::vector<Eigen::MatrixXd> columns;
  std::vector<Eigen::MatrixXd> raw;  // the same, not whitened
  Eigen::MatrixXd covariance;
  std::shared_ptr<const CurveTangent> tangent;  // what they are derivatives about; null: none
  explicit operator bool() const { return !columns.empty(); }
  // How far values are from those that the columns are derivatives about.
  Eigen::VectorXd steps_to(const Eigen::VectorXd& values) const {
    return tangent ? Eigen::VectorXd(values - tangent->values) : values;
  }
};

// A system, its readings but for the outliers, and the noise.
class Likelihood {
 public:
  // inputs: of the model that the readings are to be judged by (inputs_about).
  Likelihood(const System& system, const Readings& outliers, Noise noise,
             const std::vector<Eigen::VectorXd>& inputs = {});
  // The same readings with another noise.
  Likelihood(const Likelihood& other, Noise noise, const std::vector<Eigen::VectorXd>& inputs = {});
  // With other precisions of the innovations (Series::precision); {}: normal noise of the same deviation.
  Likelihood(const Likelihood& other, Noise noise, const std::vector<Eigen::VectorXd>& inputs,
             const ByReading& precision);

  const System& system() const { return *system_; }
  const Dataset& data() const { return data_; }
  const Noise& noise() const { return noise_; }
  double information() const { return information_; }  // of its innovations' precision (heavy_tails.hpp)
  const Readings& outliers() const { return outliers_; }
  std::size_t recordings() const { return data_.recordings.size(); }
  // Sum of the logarithms of the whitened readings' weights: minus half of log det of the noise's covariance; with
  // heavy tails, and what a density has beyond that of its precision.
  double log_weights() const { return log_weights_.sum(); }
  double log_weights(std::size_t recording) const { return log_weights_[static_cast<Eigen::Index>(recording)]; }

  // Beside these values of the curves, if any. False outside the model's domain.
  bool evaluate(const Layout& layout, std::size_t recording, const Eigen::VectorXd& shared,
                const Eigen::VectorXd& local, bool derivatives, Residuals& out, const CurveColumns& curve = {},
                const Eigen::VectorXd& curve_values = {}) const;
  // Measured - predicted in the channels' units, outliers left out; empty outside the model's domain.
  Eigen::VectorXd errors(const Layout& layout, std::size_t recording, const Eigen::VectorXd& shared,
                         const Eigen::VectorXd& local, const CurveColumns& curve = {},
                         const Eigen::VectorXd& curve_values = {}) const;
  // Columns of all of the system's rows: outliers taken out, whitened.
  Eigen::MatrixXd whitened(std::size_t recording, const Eigen::MatrixXd& columns) const;
  Eigen::MatrixXd kept(std::size_t recording, const Eigen::MatrixXd& columns) const;
  const std::vector<Whitening>& whitening(std::size_t recording) const { return whitening_[recording]; }  // by channel
  // Steps of all fits by it and by its copies: most of what a search costs, and the same on every machine. Thread-safe.
  void count_steps(int of_a_fit) const { *steps_ += of_a_fit; }
  long steps() const { return *steps_; }

 private:
  void set_noise(Noise noise, const std::vector<Eigen::VectorXd>& inputs);
  void whiten_rows(std::size_t recording, Eigen::Ref<Eigen::MatrixXd> rows) const;

  const System* system_;
  std::shared_ptr<PredictionMemo> memo_;  // shared by all copies: no noise changes a prediction
  std::shared_ptr<std::atomic<long>> steps_ = std::make_shared<std::atomic<long>>(0);  // shared by all copies
  Readings outliers_;
  Dataset data_;
  Noise noise_;
  std::vector<std::vector<Eigen::Index>> rows_;    // of the system's, that are left
  std::vector<std::vector<Whitening>> whitening_;  // per recording and channel
  std::vector<Eigen::VectorXd> measured_;          // per recording
  Eigen::VectorXd log_weights_;                    // per recording
  double information_ = 1;
};

// How the volume of what a recording's own unknowns leave open changes with the shared ones: half the gradient of
// log det(L_r' L_r + T_r) by them (own_volume.hpp).
struct OwnVolume {
  Eigen::VectorXd about;  // the shared unknowns there
  std::vector<Eigen::VectorXd> slope;
};

// The mode of a set of effects, and the likelihood about it.
struct Fit {
  explicit Fit(Layout l) : layout(std::move(l)) {}
  Layout layout;
  Scales scales;
  Eigen::VectorXd shared;
  std::vector<Eigen::VectorXd> local;
  Eigen::VectorXd curve_values;                  // of all curves, in their components' units; empty: no curve
  std::shared_ptr<const CurveTangent> tangent;   // what the model is linear about in them; null: none
  std::shared_ptr<const Likelihood> likelihood;  // by whose noise it was fitted
  double cost = 0;                               // squared whitened residuals and priors' pulls
  std::shared_ptr<const OwnVolume> own_volume;   // beside the cost, what the mode is one of; null: of the cost alone
  std::vector<Eigen::Index> held;                // shared unknowns that press against a bound
  int iterations = 0;
  bool valid = false;
};

// The unknowns and scales of a fit under another layout, effect by effect; what it lacked from the start. Not fitted.
Fit carried_to(Layout layout, const Fit& from);
// System::by_inputs() of a fit, per recording; empty: nothing.
std::vector<Eigen::VectorXd> inputs_about(const Fit& fit);
// The same readings and noise with them; itself where there is nothing. And without any.
std::shared_ptr<const Likelihood> without_inputs(const Likelihood& likelihood);
std::shared_ptr<const Likelihood> with_inputs_of(const Fit& fit, const std::shared_ptr<const Likelihood>& likelihood);

struct FitRules {
  int max_iterations = 25;
  double tolerance = 0.02;                        // of the cost
  std::vector<Eigen::Index> fixed{};              // shared unknowns that stay where they start
  std::shared_ptr<const OwnVolume> own_volume{};  // sought is the mode of the cost and this, by its slopes; null: none
};

Fit fit(const Likelihood& likelihood, const Layout& layout, const Eigen::VectorXd& shared,
        const std::vector<Eigen::VectorXd>& local, const Scales& scales, const CurveColumns& curve = {},
        const FitRules& rules = {});
// From a fit's unknowns and curve values on, with the curves' columns of each place that is looked at, or only with
// what its readings are without derivatives; null: outside the model's domain. Where the linear model promises too
// much, by steps along geodesics.
using CurveAt = std::function<std::shared_ptr<const CurveColumns>(const Fit&, bool derivatives)>;
Fit fit_from(const Likelihood& likelihood, Fit begin, const CurveAt& curve_at, const FitRules& rules = {});
// The same columns everywhere; not copied: they have to last as long.
CurveAt everywhere(const CurveColumns& curve);

// Squared whitened residuals and priors' pulls at a fit's unknowns, as Fit::cost; infinite outside the model's domain.
double cost_at(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve);

struct LinearRecording;
// The normal equations about a fit, unknowns as steps from the mode: shared, then the curve's values. Empty outside the
// model's domain. recordings: given what the blocks are made of, without these; null: not kept.
std::vector<ArrowBlock> linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                                  std::vector<LinearRecording>* recordings = nullptr);
// Priors of the shared part: precision and centre.
struct Pulls {
  Eigen::MatrixXd precision;
  Eigen::VectorXd centre;
};
Pulls pulls_of(const Layout& layout, const Eigen::VectorXd& shared, const Eigen::VectorXd& curve_values,
               const Eigen::MatrixXd& curve_covariance);
// Local unknowns in the arrow: all that are fitted, in order; their priors' precision and centre.
std::vector<Eigen::Index> free_locals(const Layout& layout);
Eigen::VectorXd local_precision_of(const Layout& layout, const Scales& scales);
// Of such a precision: what is scanned (a phase, an instant) taken as it stands.
void hold_scanned(const Layout& layout, Eigen::VectorXd& precision);
Eigen::VectorXd nuisance_centre(const Layout& layout, const Eigen::VectorXd& local);
// One recording of them, with the columns that it is made of: local unknowns, then shared ones and the curve's values.
struct LinearRecording {
  Residuals residuals;  // the curve's part taken out
  Eigen::MatrixXd L, Z;
  ArrowBlock block;
};
// False outside the model's domain.
bool linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve, std::size_t recording,
               LinearRecording& out);
// The linear model about a fit, what presses against a bound held.
ArrowSolution solve_about(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                          std::optional<std::vector<Eigen::Index>> covariance_of = {});
// The same where the nuisances have these standard deviations, per group; the blocks keep them.
ArrowSolution solve_at(const Eigen::VectorXd& nuisance_sd, const Fit& fit, std::vector<ArrowBlock>& blocks,
                       const CurveColumns& curve, std::optional<std::vector<Eigen::Index>> covariance_of = {});

}  // namespace bevel::inference
