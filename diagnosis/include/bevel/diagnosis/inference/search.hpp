// SPDX-License-Identifier: MIT
/// @file
/// Search over candidate models: an Occam window (Madigan and Raftery 1994, JASA 89) over all sets of up to `largest`
/// effects. A queue adds, drops and swaps effects; candidate models that the linear model predicts to be likely are
/// fitted.
#pragma once
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>

#include <bevel/diagnosis/inference/evidence.hpp>
#include <bevel/diagnosis/inference/proposals.hpp>

namespace bevel::inference {

/// Largest share of the posterior mass that may be in candidate models which were not fitted.
inline constexpr double kMostNotFitted = 0.1;

/// Settings of Search. Logarithms are natural.
struct SearchRules {
  std::size_t largest = 3;     ///< Largest number of effects in a candidate model.
  double window = 3.5;         ///< Log posterior below the best from which a model is not expanded (odds of 33).
  double curve_window = 15.0;  ///< Log posterior below the best from which no discrepancy is added to a model.
  double optimism = 2.0;       ///< Log evidence by which a refit may exceed the linear model's prediction.
  double doubt = 12.0;  ///< Log posterior below the window from which a model is pruned: its noise is not fitted.
  double linear_error = 0.15;  ///< Error of the linear model's predicted gain in log evidence, as a share of it.
  std::size_t starts = 2;      ///< Start values of an effect that are fitted.
  std::size_t foremost = 2;    ///< Best proposals that are fitted in place of a member.
  std::size_t pairs = 8;       ///< Pairs of effects that are fitted.
  long most_steps = 2000;  ///< Total steps of all fits (Likelihood::steps()); then only likely best models are fitted.
  double log_prior_odds_effect = -5.0;  ///< Log prior odds of one effect; its variants share them.
  std::size_t most_curves = 2;          ///< Largest number of curves of a discrepancy.
  /// Share of the posterior mass that models predicted to be likely, but not fitted for want of steps, may have. After
  /// the search they are fitted, the most likely first, until this share or further_steps is reached.
  double most_not_fitted = kMostNotFitted;
  long further_steps = 1000;  ///< Steps of the fits after the search.
  std::size_t at_once = 4;    ///< Fits that run before the next ones are chosen.
  std::size_t rounds = 6;     ///< Largest number of rounds, each with the noise of the previous round's best model.
  int threads = 2;            ///< Number of threads.
};

/// Fitted candidate model with its unnormalised posterior.
struct Visited {
  ModelSet set;                         ///< Candidate model.
  std::shared_ptr<const Evaluated> at;  ///< Evidence and fits.
  double log_without_curve = 0,         ///< Log of prior times evidence, without a discrepancy.
      log_with_curve = 0;               ///< Log of prior times evidence, with a discrepancy.
  /// Computes the log posterior with and without a discrepancy together.
  /// @return Natural log of prior times evidence, not normalised.
  double log_posterior() const;
  /// Tests whether the fit with a discrepancy is more likely than the one without.
  /// @return True if a discrepancy was fitted and is more likely.
  bool is_likelier_with_curve() const;
  /// Returns the more likely of the two fits.
  /// @return Fit with or without a discrepancy; valid as long as \p at.
  const Fit& likelier_fit() const;
};

/// Chooses the candidate model to expand next.
///
/// The order is: the most likely model; the models that lack one of its members; models within the window of the most
/// likely model, or, without a discrepancy, of the most likely model without one. The second window is needed because a
/// discrepancy can replace several effects and then lies far above the models on the way to them.
/// @param visited Fitted models.
/// @param expanded Models that were expanded.
/// @param window Width of the window, in log posterior.
/// @return Key in \p visited; null if no model is left.
const ModelSet* next_to_expand(const std::map<ModelSet, Visited>& visited, const std::set<ModelSet>& expanded,
                               double window);

/// Search for the likely candidate models of a system.
class Search {
 public:
  /// Prepares a search.
  /// @param system Model and data; must outlive this object.
  /// @param rules Settings.
  Search(const System& system, const SearchRules& rules);

  /// Progress callback with one line of text, called before each candidate model is expanded. It may throw to stop.
  using Progress = std::function<void(const std::string&)>;
  /// Runs the search. Predictions of the linear model depend on the noise and on the other effects. They are repeated
  /// about the most likely candidate model until its set and noise no longer change.
  /// @param outliers Messages to leave out, ascending, per recording.
  /// @param noise Initial noise.
  /// @param progress Progress callback; may be empty.
  /// @throws bevel::DomainError if the model without effects cannot follow the recordings.
  void run(const Readings& outliers, const Noise& noise, const Progress& progress = {});
  /// Returns the fitted candidate models.
  /// @return Map from candidate model to result; empty before run().
  const std::map<ModelSet, Visited>& visited() const { return visited_; }
  /// Returns the most likely candidate model. Call run() first.
  /// @return Element of visited().
  const Visited& best() const;
  /// Returns the model and the data.
  /// @return Argument of the constructor.
  const System& system() const { return system_; }
  /// Returns the prepared discrepancy terms. Call run() first.
  /// @return Discrepancy of the last round.
  const Discrepancy& discrepancy() const { return *discrepancy_; }
  /// Returns the prepared effects. Call run() first.
  /// @return Proposals of the last round.
  const Proposals& proposals() const { return *proposals_; }
  /// Returns the settings.
  /// @return Argument of the constructor.
  const SearchRules& rules() const { return rules_; }
  /// Returns the likelihood with whose noise the discrepancy terms were prepared. Call run() first.
  /// @return Likelihood of the last round.
  const Likelihood& likelihood() const { return *likelihood_; }
  /// Computes the marginal about the nominal model, with the noise of the linear model's predictions.
  /// @return Marginal about the fit without effects.
  Marginal base_marginal() const;
  /// Prediction of the linear model for a candidate model that has one effect more than a fitted one.
  struct Predicted {
    /// Natural log of prior times evidence, not normalised.
    double log_posterior = -std::numeric_limits<double>::infinity();
    /// Natural log Bayes factor of the joining effect against the fitted model, both without a discrepancy.
    double log_bayes_factor = -std::numeric_limits<double>::infinity();
    /// Natural log Bayes factor of the joining effect, both models with a discrepancy.
    double log_bayes_factor_with_curve = -std::numeric_limits<double>::infinity();
  };
  /// Predictions of the linear model, for candidate models that were fitted since and for others.
  /// @return Map from candidate model to prediction.
  const std::map<ModelSet, Predicted>& promised() const { return promised_; }
  /// Estimates the log of the posterior mass (prior times evidence) of the candidate models that were not fitted.
  /// Each counts with its predicted mass times the share of such a prediction that fits attain: the mean of
  /// min(1, fitted / predicted) over the fitted models that were predicted within the window of the likeliest, and of
  /// one more that attains it in full, so that few fits correct little.
  /// @return Natural log, not normalised.
  double log_not_visited() const;
  /// Computes the share of log_not_visited() in the total posterior mass.
  /// @return Share, in [0, 1].
  double share_not_visited() const;
  /// Computes the log prior of a candidate model, relative to the model without effects.
  /// @param set Candidate model.
  /// @return Natural log of the prior odds.
  double log_prior(const ModelSet& set) const;
  /// Computes the log prior odds of one variant of an effect.
  /// @param effect Index into System::effects().
  /// @return Natural log of the odds that the variant is in the model; the variants of an effect have equal shares.
  double log_prior_odds(std::size_t effect) const;
  /// Returns the settings of discrepancies. An unmodelled effect has the prior odds of all effect names together; one
  /// more curve has the prior odds of one more effect.
  /// @return Settings.
  const CurveRules& curve_rules() const { return curve_rules_; }
  /// Combines evidence and prior of a candidate model, which may belong to another system.
  /// @param set Candidate model.
  /// @param log_prior Log prior of \p set.
  /// @param at Evaluated candidate model.
  /// @return Candidate model with its unnormalised posterior.
  Visited weighed(const ModelSet& set, double log_prior, const std::shared_ptr<const Evaluated>& at) const;

 private:
  struct Job {
    ModelSet set;
    Layout layout;
    Eigen::VectorXd shared;
    std::vector<Eigen::VectorXd> local;
    Eigen::VectorXd nuisance_sd;
    bool beside_curve = false;
    bool beside_several = false;  // the prediction requires several curves
    bool foremost = false;        // fitted although outside the window: a smaller model that was not fitted yet
    // Predicted log posterior, with the linear model's possible error; models without a prediction are always fitted.
    double promised = std::numeric_limits<double>::infinity();
    double doubtful = 0;
    std::shared_ptr<const Fit> large_curve{};  // fit with curves too large for the linear model: start values
  };
  // Predicted gains of further effects about one fit, by the linear model.
  struct Beside {
    Fit about;
    std::vector<Proposal> proposals;
    // Converts a log Bayes factor to the larger model's log posterior, without the prior odds of the joining effect.
    std::function<double(double)> log_promised;
    double log_reference = 0;  // log posterior of the model that the effects join
    // For a fit with smaller standard deviations: only effects with a larger predicted gain than elsewhere start here,
    // and only after the prediction was repeated about the mode.
    std::function<Beside()> at_its_mode{};
  };
  void expand(const ModelSet& set);
  std::vector<Beside> look_beside(const Fit& fit, double log_here, bool with_others_moved) const;
  std::vector<Beside> look_in_curves_places(const Fit& with_curve, double log_here) const;
  std::vector<Job> larger_sets(const ModelSet& set, const Beside& beside);
  double most_promised(const ModelSet& set) const;
  double log_promised(const Beside& beside, const Proposal& one) const;
  double doubtful(double log_promised) const;  // by which a fit may exceed the prediction
  std::vector<Job> sets_without_a_member(const Fit& fit, double log_here);
  std::optional<Job> smaller_set(const Fit& about, std::size_t member, double log_here, double log_cost) const;
  // A fit, the member at `place` to remove, and the proposals about the fit without it (that member among them).
  struct Swapped {
    const Likelihood& own;
    const CurveColumns& curve;
    const Fit& fit;
    const Fit& about;
    std::size_t place;
    const std::vector<Proposal>& proposals;
    const Proposal& leaves;
  };
  void append_swaps(const Swapped& from, double log_here, std::vector<Job>& out);
  void keep(const ModelSet& set, const std::shared_ptr<const Evaluated>& at);
  void drop_repeated(std::vector<Job>& jobs) const;
  // Without a curve. Keeps all valid results; fits stop early below this log posterior.
  std::vector<std::shared_ptr<Evaluated>> evaluate_without_curve(std::span<const Job> jobs, double give_up_below);
  void evaluate_all(std::vector<Job> jobs);
  // Modes for which a curve was tried: candidate model and its log evidence.
  using Modes = std::vector<std::pair<ModelSet, double>>;
  void evaluate_with_curve(std::span<const Job> jobs, Modes& asked);
  static Job job_at(const Fit& fit);
  // Requests a curve for a job that starts from a fit with one; a large curve keeps its values as start.
  void ask_for_curve_of(const Fit& fit, Job& job) const;
  void ask_for_curve_of(const Fit& fit, std::shared_ptr<const Likelihood> by, Job& job) const;
  Job job_from(const Fit& fit, std::size_t effect, const StartPoint& start) const;
  Job job_from_alike(const Fit& fit, std::size_t effect, StartPoint start) const;
  bool has_instants(std::size_t effect) const;
  // Returns null if the noise is normal.
  std::shared_ptr<const Likelihood> with_heavy_tails(const Fit& fit) const;
  // Tests the noise of the most likely model. Only that one is conclusive: jumps that are modelled are not noise.
  bool look_for_heavy_tails();
  double best_log() const;
  const Fit& likeliest_fit() const { return best().likelier_fit(); }
  bool is_visited(const ModelSet& set) const { return visited_.contains(set); }

  // Start values of the nominal model's fit.
  struct Start {
    Eigen::VectorXd shared;
    std::vector<Eigen::VectorXd> local;
    Eigen::VectorXd nuisance_sd;
  };
  void look_in_rounds(std::shared_ptr<const Likelihood> reference, Start& start, std::vector<Job> known);
  // Tests whether a visited model is so far below the most likely one that no curve is tried.
  bool is_hopeless(const ModelSet& set) const;
  double hopeless_below() const;
  double hopeless_with_curve(const ModelSet& set) const;  // log evidence
  // Fits the best effects alone and without a curve, before any curve is tried.
  void look_at_foremost_effects();
  // Tests whether the nominal model stays pruned with the predicted gain of a curve.
  bool is_nothing_hopeless_with_a_curve() const;
  // Predictions with the round's noise are poor once the best model's noise differs; the last round continues.
  bool is_round_over() const;
  bool is_out_of_steps() const { return likelihood_->steps() >= rules_.most_steps; }
  void look_around();
  void look_at_what_is_left();  // in the window, the most likely first
  void fit_what_was_left();     // SearchRules::most_not_fitted

  const System& system_;
  SearchRules rules_;
  CurveRules curve_rules_;
  std::shared_ptr<const Likelihood> likelihood_;  // for the linear predictions; each model has its own noise
  std::unique_ptr<const Discrepancy> discrepancy_;
  std::unique_ptr<const Proposals> proposals_;
  std::map<ModelSet, Visited> visited_;
  std::set<ModelSet> expanded_, refitted_;       // once a round each
  std::set<std::pair<ModelSet, bool>> swapped_;  // with a curve and without one
  Progress progress_;
  std::map<ModelSet, Predicted> promised_;
  std::map<ModelSet, Job> left_;                      // not fitted for want of steps, with the largest prediction
  std::shared_ptr<const Likelihood> heavy_;           // noise with heavy tails; null: normal so far
  std::shared_ptr<const Evaluated> asked_for_tails_;  // most likely model when the tails were tested
  bool tails_known_ = false;                          // not tested again
  bool last_round_ = false;
  bool nothing_is_hopeless_ = false;  // nominal model pruned for any noise: no curve is tried
};

}  // namespace bevel::inference
