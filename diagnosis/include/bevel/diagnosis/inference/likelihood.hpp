// SPDX-License-Identifier: MIT
/// @file
/// Likelihood of measurements for a candidate model, a discrepancy and autocorrelated noise, and its mode.
///
/// \code{.unparsed}
///   y_r = h(shared, local_r, c) + e_r             e_r ~ noise;  local_r: nuisances ~ N(0, sd^2), phases, event times
///                                                 c ~ N(0, K): the discrepancy, a sum of curves;
///                                                 h is linear in c about zero or about a tangent's values
/// \endcode
///
/// The mode (mode.cpp) is found by Gauss-Newton steps with Levenberg damping on the block-arrow normal equations. The
/// steps follow geodesics where the linear model predicts too large a gain. An active set handles the bounds.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include <bevel/diagnosis/inference/arrow.hpp>
#include <bevel/diagnosis/inference/layout.hpp>
#include <bevel/diagnosis/inference/noise.hpp>
#include <bevel/diagnosis/inference/prediction_memo.hpp>

namespace bevel::inference {

/// Prior of a curve's values: covariance scale^2 exp(-|distance| / length).
struct CurvePrior {
  std::size_t curve = 0;  ///< Index into System::curves().
  /// Root mean square over all measurements of the curve's part that the nominal model's parameters do not absorb, in
  /// standard deviations of the noise.
  double scale = 0;
  double length = 0;  ///< Correlation length as a share of the covariate's range.
  /// Compares all members.
  /// @return True if the priors are equal.
  bool operator==(const CurvePrior&) const = default;
};
/// Computes the correlation matrix of a curve's values.
/// @param curve Curve with its nodes.
/// @param length Correlation length as a share of the covariate's range, positive.
/// @return Square matrix, one row per node; dimensionless.
Eigen::MatrixXd correlation_of(const Curve& curve, double length);

/// Standard deviation that replaces zero for an insertion-specific parameter, relative or in its unit. Smaller values
/// lose precision: where the mode is elsewhere, the minimum is a difference of large numbers.
inline constexpr double kNone_sd = 1e-6;

/// Hyperparameters that stay constant while the mode is sought.
struct Scales {
  Eigen::VectorXd nuisance_sd;     ///< Between-insertion standard deviation per group; 0: recordings do not differ.
  std::vector<CurvePrior> curves;  ///< Curves of the discrepancy; empty: no discrepancy.
};

/// Whitened residuals of one recording with their derivatives.
struct Residuals {
  Eigen::VectorXd white;      ///< Measured minus predicted, whitened.
  Eigen::MatrixXd by_shared;  ///< Derivatives of the prediction by the shared unknowns, whitened; rows x unknowns.
  Eigen::MatrixXd by_local;   ///< Derivatives of the prediction by the local unknowns, whitened; rows x unknowns.
};

/// Derivatives of the measurements by the values of one or several curves.
struct CurveColumns {
  std::vector<Eigen::MatrixXd> columns;  ///< Whitened derivatives per recording, rows x values, curve after curve.
  std::vector<Eigen::MatrixXd> raw;      ///< The derivatives without whitening.
  Eigen::MatrixXd covariance;            ///< Prior covariance of the values, zero between curves.
  std::shared_ptr<const CurveTangent> tangent;  ///< Values about which the derivatives hold; null: zero.
  /// Tests whether there are any curves.
  /// @return True if \p columns is not empty.
  explicit operator bool() const { return !columns.empty(); }
  /// Computes the distance of values from those about which the derivatives hold.
  /// @param values Values of all curves, curve after curve.
  /// @return Differences, in the components' units.
  Eigen::VectorXd steps_to(const Eigen::VectorXd& values) const {
    return tangent ? Eigen::VectorXd(values - tangent->values) : values;
  }
};

/// Likelihood of a system's measurements without the outliers, for one noise model.
class Likelihood {
 public:
  /// Makes a likelihood.
  /// @param system Model and data; must outlive this object and its copies.
  /// @param outliers Messages to leave out, ascending, per recording.
  /// @param noise Noise, with one sigma per channel.
  /// @param inputs Standard deviations from uncertain inputs (inputs_about()), per recording; empty: none.
  Likelihood(const System& system, const Readings& outliers, Noise noise,
             const std::vector<Eigen::VectorXd>& inputs = {});
  /// Makes a likelihood of the same measurements with another noise.
  /// @param other Likelihood of the measurements.
  /// @param noise New noise.
  /// @param inputs Standard deviations from uncertain inputs, per recording; empty: none.
  Likelihood(const Likelihood& other, Noise noise, const std::vector<Eigen::VectorXd>& inputs = {});
  /// Makes a likelihood of the same measurements with another noise and other precisions of the innovations.
  /// @param other Likelihood of the measurements.
  /// @param noise New noise.
  /// @param inputs Standard deviations from uncertain inputs, per recording; empty: none.
  /// @param precision Precisions of the innovations (Series::precision); empty: normal noise of the same deviation.
  Likelihood(const Likelihood& other, Noise noise, const std::vector<Eigen::VectorXd>& inputs,
             const ByReading& precision);

  /// Returns the model.
  /// @return Model with its complete data.
  const System& system() const { return *system_; }
  /// Returns the measurements without the outliers.
  /// @return Measurements with the input deviations and precisions in use.
  const Dataset& data() const { return data_; }
  /// Returns the noise.
  /// @return Noise of all channels.
  const Noise& noise() const { return noise_; }
  /// Returns the information of the innovations' precision (heavy_tails.hpp).
  /// @return Factor in (0, 1]; 1 for normal noise.
  double information() const { return information_; }
  /// Returns the messages that are left out.
  /// @return Message indices per recording.
  const Readings& outliers() const { return outliers_; }
  /// Counts the recordings.
  /// @return Number of recordings.
  std::size_t recordings() const { return data_.recordings.size(); }
  /// Sums the log weights of the whitened measurements of all recordings: minus half the log determinant of the noise
  /// covariance. With heavy tails it includes the part of the density that the precisions do not describe.
  /// @return Natural log, in the channels' units.
  double log_weights() const { return log_weights_.sum(); }
  /// Sums the log weights of the whitened measurements of one recording.
  /// @param recording Index of the recording.
  /// @return Natural log, in the channels' units.
  double log_weights(std::size_t recording) const { return log_weights_[static_cast<Eigen::Index>(recording)]; }

  /// Computes the whitened residuals of one recording.
  /// @param layout Layout of the candidate model.
  /// @param recording Index of the recording.
  /// @param shared Shared unknowns, in the order of \p layout.
  /// @param local Local unknowns of the recording, in the order of \p layout.
  /// @param derivatives Whether to compute the derivatives.
  /// @param[out] out Residuals and, if requested, derivatives.
  /// @param curve Columns of the curves; empty: none.
  /// @param curve_values Values of the curves.
  /// @return False outside the model's domain.
  bool evaluate(const Layout& layout, std::size_t recording, const Eigen::VectorXd& shared,
                const Eigen::VectorXd& local, bool derivatives, Residuals& out, const CurveColumns& curve = {},
                const Eigen::VectorXd& curve_values = {}) const;
  /// Computes the errors of one recording, without the outliers.
  /// @param layout Layout of the candidate model.
  /// @param recording Index of the recording.
  /// @param shared Shared unknowns, in the order of \p layout.
  /// @param local Local unknowns of the recording, in the order of \p layout.
  /// @param curve Columns of the curves; empty: none.
  /// @param curve_values Values of the curves.
  /// @return Measured minus predicted, in the channels' units; empty outside the model's domain.
  Eigen::VectorXd errors(const Layout& layout, std::size_t recording, const Eigen::VectorXd& shared,
                         const Eigen::VectorXd& local, const CurveColumns& curve = {},
                         const Eigen::VectorXd& curve_values = {}) const;
  /// Removes the outliers' rows and whitens the columns.
  /// @param recording Index of the recording.
  /// @param columns Matrix with all rows of the recording, or without the outliers.
  /// @return Whitened matrix, in standard deviations of the noise.
  Eigen::MatrixXd whitened(std::size_t recording, const Eigen::MatrixXd& columns) const;
  /// Removes the outliers' rows.
  /// @param recording Index of the recording.
  /// @param columns Matrix with all rows of the recording, or without the outliers.
  /// @return Matrix without the outliers' rows.
  Eigen::MatrixXd kept(std::size_t recording, const Eigen::MatrixXd& columns) const;
  /// Returns the whitening of one recording.
  /// @param recording Index of the recording.
  /// @return Coefficients, one entry per channel.
  const std::vector<Whitening>& whitening(std::size_t recording) const { return whitening_[recording]; }
  /// Adds the steps of a fit to the count of this likelihood and all its copies. Thread-safe.
  /// @param of_a_fit Number of steps.
  void count_steps(int of_a_fit) const { *steps_ += of_a_fit; }
  /// Returns the steps of all fits. They are most of a search's cost and do not depend on the machine. Thread-safe.
  /// @return Number of steps of this likelihood and all its copies.
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
  std::vector<std::vector<Eigen::Index>> rows_;    // the system's rows without the outliers
  std::vector<std::vector<Whitening>> whitening_;  // per recording and channel
  std::vector<Eigen::VectorXd> measured_;          // per recording
  Eigen::VectorXd log_weights_;                    // per recording
  double information_ = 1;
};

/// Change of the volume of the insertion-specific parameters with the shared unknowns (own_volume.hpp).
struct OwnVolume {
  Eigen::VectorXd about;               ///< Shared unknowns at which the slopes hold.
  std::vector<Eigen::VectorXd> slope;  ///< Half the gradient of log det(L_r' L_r + T_r), per recording.
};

/// Mode of a candidate model, with the likelihood about it.
struct Fit {
  /// Makes a fit that is not valid yet.
  /// @param l Layout of the candidate model.
  explicit Fit(Layout l) : layout(std::move(l)) {}
  Layout layout;                                 ///< Layout of the candidate model.
  Scales scales;                                 ///< Hyperparameters.
  Eigen::VectorXd shared;                        ///< Shared unknowns, in the order of \p layout.
  std::vector<Eigen::VectorXd> local;            ///< Local unknowns per recording, in the order of \p layout.
  Eigen::VectorXd curve_values;                  ///< Values of all curves, in their components' units; empty: none.
  std::shared_ptr<const CurveTangent> tangent;   ///< Curve values about which the model is linear; null: zero.
  std::shared_ptr<const Likelihood> likelihood;  ///< Likelihood with whose noise the fit was made.
  double cost = 0;                               ///< Squared whitened residuals plus the priors' terms.
  std::shared_ptr<const OwnVolume> own_volume;   ///< Term added to the cost at the mode; null: none.
  std::vector<Eigen::Index> held;                ///< Shared unknowns at an active bound.
  int iterations = 0;                            ///< Steps of the fit.
  bool valid = false;                            ///< The fit is inside the model's domain.
};

/// Transfers a fit to another layout, effect by effect. Unknowns that the fit lacks have their start values.
/// @param layout New layout.
/// @param from Fit.
/// @return Transferred unknowns and scales; not refitted.
Fit carried_to(Layout layout, const Fit& from);
/// Computes System::by_inputs() at a fit.
/// @param fit Fit with a likelihood.
/// @return Standard deviations per recording, in the channels' units; empty if any recording has none.
std::vector<Eigen::VectorXd> inputs_about(const Fit& fit);
/// Makes a likelihood with the same measurements and noise, without uncertain inputs.
/// @param likelihood Likelihood.
/// @return New likelihood.
std::shared_ptr<const Likelihood> without_inputs(const Likelihood& likelihood);
/// Makes a likelihood with the same measurements and noise, with the uncertain inputs at a fit.
/// @param fit Fit with a likelihood.
/// @param likelihood Likelihood.
/// @return New likelihood; \p likelihood itself if inputs_about() is empty.
std::shared_ptr<const Likelihood> with_inputs_of(const Fit& fit, const std::shared_ptr<const Likelihood>& likelihood);

/// Settings of a fit.
struct FitRules {
  int max_iterations = 25;            ///< Largest number of steps.
  double tolerance = 0.02;            ///< Change of the cost below which the fit ends.
  std::vector<Eigen::Index> fixed{};  ///< Shared unknowns that keep their start values.
  /// Term whose slopes are added to the cost (own_volume.hpp); null: none.
  std::shared_ptr<const OwnVolume> own_volume{};
};

/// Finds the mode of a candidate model.
/// @param likelihood Likelihood.
/// @param layout Layout of the candidate model.
/// @param shared Start values of the shared unknowns.
/// @param local Start values of the local unknowns, per recording.
/// @param scales Hyperparameters.
/// @param curve Columns of the curves; empty: none.
/// @param rules Settings.
/// @return Fit without its likelihood member; not valid if the start is outside the model's domain.
Fit fit(const Likelihood& likelihood, const Layout& layout, const Eigen::VectorXd& shared,
        const std::vector<Eigen::VectorXd>& local, const Scales& scales, const CurveColumns& curve = {},
        const FitRules& rules = {});
/// Function that computes the curves' columns at a fit, or without derivatives only the columns for its residuals.
/// It returns null outside the model's domain.
using CurveAt = std::function<std::shared_ptr<const CurveColumns>(const Fit&, bool derivatives)>;
/// Finds the mode from a fit's unknowns and curve values. Steps follow geodesics (Transtrum, Machta and Sethna 2011,
/// Phys. Rev. E 83, 036701) where the linear model predicts too large a gain.
/// @param likelihood Likelihood.
/// @param begin Start values. Its own_volume is used, not that of \p rules.
/// @param curve_at Columns of the curves at each place.
/// @param rules Settings.
/// @return Fit; not valid if the start is outside the model's domain.
Fit fit_from(const Likelihood& likelihood, Fit begin, const CurveAt& curve_at, const FitRules& rules = {});
/// Makes a function that returns the same columns for every fit.
/// @param curve Columns; not copied, so they must outlive the result.
/// @return Function for fit_from().
CurveAt everywhere(const CurveColumns& curve);

/// Computes Fit::cost at a fit's unknowns.
/// @param likelihood Likelihood.
/// @param fit Unknowns.
/// @param curve Columns of the fit's curves.
/// @return Squared whitened residuals plus the priors' terms; infinite outside the model's domain.
double cost_at(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve);

struct LinearRecording;
/// Computes the normal equations about a fit. The unknowns are steps from it: shared unknowns, then curve values.
/// @param likelihood Likelihood.
/// @param fit Fit.
/// @param curve Columns of the fit's curves.
/// @param[out] recordings Residuals and columns of each block, without the block; null: not stored.
/// @return One block per recording; empty outside the model's domain.
std::vector<ArrowBlock> linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve,
                                  std::vector<LinearRecording>* recordings = nullptr);
/// Normal priors of the shared unknowns and curve values, as steps from a fit.
struct Pulls {
  Eigen::MatrixXd precision;  ///< Precision matrix.
  Eigen::VectorXd centre;     ///< Means of the priors minus the current values.
};
/// Computes the normal priors about given values.
/// @param layout Layout of the candidate model.
/// @param shared Shared unknowns.
/// @param curve_values Values of all curves; may be empty.
/// @param curve_covariance Prior covariance of the curve values.
/// @return Priors; the shared unknowns first.
Pulls pulls_of(const Layout& layout, const Eigen::VectorXd& shared, const Eigen::VectorXd& curve_values,
               const Eigen::MatrixXd& curve_covariance);
/// Lists the local unknowns in the normal equations: all that are fitted (Layout::is_fitted()).
/// @param layout Layout of the candidate model.
/// @return Ascending indices into Layout::local().
std::vector<Eigen::Index> free_locals(const Layout& layout);
/// Computes the prior precisions of the local unknowns.
/// @param layout Layout of the candidate model.
/// @param scales Hyperparameters.
/// @return One precision per entry of free_locals().
Eigen::VectorXd local_precision_of(const Layout& layout, const Scales& scales);
/// Sets the precisions of scanned unknowns (phases and event times) so high that they stay constant.
/// @param layout Layout of the candidate model.
/// @param[in,out] precision Result of local_precision_of().
void hold_scanned(const Layout& layout, Eigen::VectorXd& precision);
/// Computes the prior means of the local unknowns as steps from given values.
/// @param layout Layout of the candidate model.
/// @param local Local unknowns of one recording.
/// @return One step per entry of free_locals(); 0 for scanned unknowns.
Eigen::VectorXd nuisance_centre(const Layout& layout, const Eigen::VectorXd& local);
/// Linear model of one recording. The columns of L are the local unknowns; those of Z are the shared unknowns, then the
/// curve values.
struct LinearRecording {
  Residuals residuals;  ///< Residuals, after subtraction of the curves.
  Eigen::MatrixXd L,    ///< Whitened derivatives by the local unknowns.
      Z;                ///< Whitened derivatives by the shared unknowns and the curve values.
  ArrowBlock block;     ///< Normal equations.
};
/// Computes the linear model of one recording about a fit.
/// @param likelihood Likelihood.
/// @param fit Fit.
/// @param curve Columns of the fit's curves.
/// @param recording Index of the recording.
/// @param[out] out Linear model.
/// @return False outside the model's domain.
bool linearise(const Likelihood& likelihood, const Fit& fit, const CurveColumns& curve, std::size_t recording,
               LinearRecording& out);
/// Solves the linear model about a fit. Unknowns that a step would move across a bound they are at stay there.
/// @param fit Fit.
/// @param blocks Normal equations about \p fit.
/// @param curve Columns of the fit's curves.
/// @param covariance_of Columns of the covariance to compute; nothing: all.
/// @return Steps from the fit, with their covariance.
ArrowSolution solve_about(const Fit& fit, const std::vector<ArrowBlock>& blocks, const CurveColumns& curve,
                          std::optional<std::vector<Eigen::Index>> covariance_of = {});
/// Solves the linear model about a fit with other between-insertion standard deviations.
/// @param nuisance_sd Standard deviation per group.
/// @param fit Fit.
/// @param[in,out] blocks Normal equations about \p fit; they keep the new prior precisions.
/// @param curve Columns of the fit's curves.
/// @param covariance_of Columns of the covariance to compute; nothing: all.
/// @return Steps from the fit, with their covariance.
ArrowSolution solve_at(const Eigen::VectorXd& nuisance_sd, const Fit& fit, std::vector<ArrowBlock>& blocks,
                       const CurveColumns& curve, std::optional<std::vector<Eigen::Index>> covariance_of = {});

}  // namespace bevel::inference
