// SPDX-License-Identifier: MIT
/// @file
/// Predicted gain of each effect: its signature in the measurements is computed once about one fit, from a grid of
/// start values. For any other fit the linear model then estimates the log Bayes factor and the start values without a
/// new fit.
#pragma once
#include <span>

#include <bevel/diagnosis/inference/marginal.hpp>

namespace bevel::inference {

/// Start values of an effect with their predicted gain.
struct StartPoint {
  Eigen::VectorXd shared;              ///< Shared parameters of the effect, in their order.
  std::vector<Eigen::VectorXd> local;  ///< Other parameters of the effect, per recording.
  double log_bayes_factor = 0;         ///< Predicted natural log Bayes factor.
  bool base_at_prior = false;          ///< The signature was computed with the nominal model at its prior.
  /// Shared unknowns of the fit that the effect joins, if the signature was computed with other values than the fit's;
  /// empty: the fit's values.
  Eigen::VectorXd beside{};
};

/// Predicted gain of one effect.
struct Proposal {
  std::size_t effect = 0;          ///< Index into System::effects().
  double log_bayes_factor = 0;     ///< Natural log, averaged over the starts; -infinity: no start can be evaluated.
  std::vector<StartPoint> starts;  ///< Start values, the most likely first.
};

/// Detectability of each effect in the recordings, given the nominal model.
struct Reach {
  /// Detectability of one parameter at which an effect vanishes.
  struct Size {
    std::size_t effect = 0,    ///< Index into System::effects().
        parameter = 0;         ///< Index of the parameter in the effect.
    double one_deviation = 0;  ///< Size whose visible part has one standard deviation of the noise over all rows.
    double typical = 0;        ///< Size at which fits begin.
    double absorbed = 0;       ///< Share of the squared signature that nominal and local parameters absorb.
  };
  std::vector<Size> sizes;           ///< Every parameter at which an effect vanishes.
  std::vector<std::size_t> effects;  ///< Effects of the rows and columns of \p cosine.
  Eigen::MatrixXd cosine;            ///< Cosines between the visible parts of two effects.
};

/// Makes the unknowns of one recording for a layout with one more effect.
/// @param layout Layout with the effect.
/// @param from Layout without the effect.
/// @param shared Shared unknowns, in the order of \p from.
/// @param local Local unknowns of the recording, in the order of \p from.
/// @param effect Index into System::effects().
/// @param values Values of the effect's parameters.
/// @return Shared and local unknowns, in the order of \p layout.
std::pair<Eigen::VectorXd, Eigen::VectorXd> unknowns_with(const Layout& layout, const Layout& from,
                                                          const Eigen::VectorXd& shared, const Eigen::VectorXd& local,
                                                          std::size_t effect, const Eigen::VectorXd& values);
/// Moves the nominal model's parameters with normal prior to the prior means, and removes differences between
/// recordings.
/// @param fit Fit.
/// @return Changed fit; not refitted.
Fit with_base_at_prior(Fit fit);

/// Signatures of all effects about one fit.
class Proposals {
 public:
  /// Computes the signatures. The members of the fit stay in the model when another effect is added, if the combination
  /// is allowed.
  /// @param likelihood Likelihood that whitens the signatures.
  /// @param about Fit of any candidate model.
  Proposals(const Likelihood& likelihood, const Fit& about);

  /// Predicts the gain of every effect that may join a fit.
  /// @param fit Marginal about the fit.
  /// @param starts Largest number of start values per effect.
  /// @return Proposals, the most likely first.
  std::vector<Proposal> beside(const Marginal& fit, std::size_t starts) const;
  /// Predicts again the gain of effects whose signature is not proportional to a size (for example steps of a length).
  /// The shared unknowns are those that the linear model gives for each start: an unknown that absorbs the mean of the
  /// steps, as a latency does, also shifts them.
  /// @param by Likelihood that whitens the columns (Marginal).
  /// @param fit Fit that the effects join.
  /// @param beside Marginal about \p fit.
  /// @param starts Largest number of start values per effect.
  /// @param[in,out] proposals Result of beside().
  void look_with_others_moved(const Likelihood& by, const Fit& fit, const Marginal& beside, std::size_t starts,
                              std::vector<Proposal>& proposals) const;
  /// Predicts the joint gain of pairs of effects that join the nominal model.
  /// @param base Marginal about the fit of the nominal model.
  /// @param count Largest number of pairs.
  /// @return Predicted gain and pair, the most likely first.
  std::vector<std::pair<double, ModelSet>> pairs(const Marginal& base, std::size_t count) const;
  /// Computes the detectability of each effect at the middle of its starts; events occur in the middle of every
  /// recording.
  /// @param base Marginal about the fit of the nominal model.
  /// @return Detectability.
  Reach reach(const Marginal& base) const;

 private:
  struct Signature {
    Eigen::VectorXd values;  // the effect's parameters at this start
    Eigen::Index first = 0;  // column; as many as the effect has amplitudes
    bool base_at_prior = false;
  };
  struct Candidate {
    std::vector<std::size_t> amplitudes;
    int local = -1;  // parameter with a value per recording
    bool instant = false;
    std::vector<Signature> signatures;
    std::vector<std::vector<double>> choices;  // of the local parameter, per recording
    std::vector<Eigen::MatrixXf> columns;      // per recording; with a local parameter: signatures x choices
    Eigen::Index width() const {
      return local >= 0 ? 1 : std::max<Eigen::Index>(1, static_cast<Eigen::Index>(amplitudes.size()));
    }
  };
  // One signature of an effect, among columns of several effects.
  struct Side {
    std::size_t effect = 0, signature = 0;
    Eigen::Index first = 0, width = 0;
  };
  Candidate make_candidate(const Likelihood& likelihood, std::span<const Fit> views, std::size_t effect) const;
  Proposal judge(const Candidate& candidate, std::size_t effect, const Marginal& beside, std::size_t starts) const;
  // Steps of the shared unknowns that the linear model gives for each signature: shared x signatures.
  static Eigen::MatrixXd steps_beside(const Candidate& candidate, const Marginal& beside);
  Proposal judge_local(const Candidate& candidate, std::size_t effect, const Marginal& beside,
                       std::size_t starts) const;
  std::size_t nearest_signature(const Proposal& proposal) const;
  std::vector<Eigen::MatrixXf> side_by_side(std::vector<Side>& sides) const;
  Eigen::VectorXd prior_precision(const Side& side) const;

  const System* system_;
  std::vector<Candidate> candidates_;
};

}  // namespace bevel::inference
